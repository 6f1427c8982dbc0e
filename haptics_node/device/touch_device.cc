#include "haptics_node/device/touch_device.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace fulcrum::haptics {
namespace {

// Longest time step [s]: after a delay of the servo, fading and gliding must not jump.
constexpr double kMaxDt_s = 0.02;

}  // namespace

TouchDevice::TouchDevice(std::shared_ptr<TouchDriver> driver, std::size_t tool, const WorkspaceMap& map,
                         double force_scale, const Vec3d& parked_W)
    : driver_(std::move(driver)), tool_(tool), map_(map), force_scale_(force_scale), position_W_(parked_W) {}

Vec3d TouchDevice::ReadPosition(const Tick& tick) noexcept {
  const double dt =
      tick_ns_ == 0 ? 0.0 : std::clamp(1e-9 * static_cast<double>(tick.stamp_ns - tick_ns_), 0.0, kMaxDt_s);
  tick_ns_ = tick.stamp_ns;
  if (driver_->link(tool_).sample.TryTake(&sample_)) {
    sample_ns_ = tick.stamp_ns;
    has_reading_ = true;
    TrackRoll();
  }
  TrackPresence(has_reading_ && 1e-9 * static_cast<double>(tick.stamp_ns - sample_ns_) <= kTouchStale_s, dt);
  TrackHeat(dt);
  gain_.store(presence_ * coolness_, std::memory_order_relaxed);
  return position_W_;
}

void TouchDevice::TrackPresence(bool present, double dt) noexcept {
  if (!present) {
    presence_ = std::max(0.0, presence_ - dt / kTouchFade_s);
  } else {
    const Vec3d hand_W = map_.ToWorld(sample_.p_D);
    if (!present_) {
      offset_W_ = position_W_ - hand_W;
      roll_offset_ = roll_ - hand_roll_;
      glide_ = 1;
    }
    const double left = glide_ * glide_ * (3 - 2 * glide_);
    position_W_ = hand_W + left * offset_W_;
    roll_ = hand_roll_ + left * roll_offset_;
    if (glide_ > 0) {
      glide_ = std::max(0.0, glide_ - dt / kTouchGlide_s);
      presence_ = std::max(0.0, presence_ - dt / kTouchFade_s);
    } else {
      presence_ = std::min(1.0, presence_ + dt / kTouchRise_s);
    }
  }
  present_ = present;
}

// From the device's x axis, projected on the plane across the stylus.
void TouchDevice::TrackRoll() noexcept {
  constexpr double kLeastSine = 0.1;  // Nearer to x the projection has no direction.
  const Vec3d& d = sample_.d_D;
  const Vec3d level = Vec3d::UnitX() - d.x() * d;
  const double angle = std::atan2(d.dot(level.cross(sample_.x_D)), level.dot(sample_.x_D));
  if (level.norm() < kLeastSine || !std::isfinite(angle)) return;
  hand_roll_ += std::remainder(angle - hand_roll_, 2 * std::numbers::pi);
}

void TouchDevice::TrackHeat(double dt) noexcept {
  const TouchLink& link = driver_->link(tool_);
  const double heat = link.motor_heat.load(std::memory_order_relaxed);
  const bool cut = link.warm.load(std::memory_order_relaxed);
  const double wanted = cut ? 0.0 : std::clamp((kMotorHot - heat) / (kMotorHot - kMotorWarm), 0.0, 1.0);
  coolness_ += std::clamp(wanted - coolness_, -kThermalRate_per_s * dt, kThermalRate_per_s * dt);
}

void TouchDevice::WriteForce(const Vec3d& f_W) noexcept {
  const double gain = force_scale_ * gain_.load(std::memory_order_relaxed);
  driver_->link(tool_).force_D.Store(gain * map_.ForceToDevice(f_W));
}

DeviceHealth TouchDevice::Describe() const {
  DeviceHealth health;
  health.motor_heat = driver_->link(tool_).motor_heat.load(std::memory_order_relaxed);
  health.gain = gain_.load(std::memory_order_relaxed);
  health.trouble = driver_->Trouble(tool_);
  const std::string serial = driver_->serial(tool_);  // Empty until the device is there.
  if (health.trouble.empty() && !trocar_device_.empty() && !serial.empty() && serial != trocar_device_) {
    health.trouble = "Touch " + serial + " works with a trocar that was measured with device " + trocar_device_ +
                     ": stop, and calibrate the trocar again";
  }
  if (health.trouble.empty() && health.motor_heat > kMotorWarm) {
    health.trouble = "Touch " + driver_->serial(tool_) + " has warm motors: its force is faded; let the hand rest";
  }
  return health;
}

}  // namespace fulcrum::haptics
