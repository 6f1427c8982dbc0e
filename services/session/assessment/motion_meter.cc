#include "services/session/assessment/motion_meter.h"

#include <cmath>
#include <numbers>
#include <utility>

#include "services/session/assessment/gap.h"
#include "services/session/assessment/smoothness.h"

namespace fulcrum::assessment {
namespace {

/// A movement ends when the tip has been slow for this time; a change of direction stops it for a shorter time.
constexpr int kSlowSamples = 10;
/// A longer movement is split here, which bounds memory and the size of the transform.
constexpr std::size_t kLongestMovement = 3000;
constexpr std::size_t kShortestMovement = 10;
/// A tool has returned after a restart of haptics_node when its tip is this near to its last place before [m], at the
/// latest after this time [s]: 0.6 m/s (operated) or 0.5 s (Touch) over any way within reach, and a margin.
constexpr double kReturned_m = 0.002, kReturn_s = 1.5;

}  // namespace

Vec3d LowPass::Filter(const Vec3d& x) {
  static const double k = std::tan(std::numbers::pi * kLowPass_Hz / kGridRate_Hz);
  static const double norm = 1 / (1 + std::numbers::sqrt2 * k + k * k), b = k * k * norm;
  static const double a1 = 2 * (k * k - 1) * norm, a2 = (1 - std::numbers::sqrt2 * k + k * k) * norm;
  if (fresh_) {
    fresh_ = false;
    x1_ = x2_ = y1_ = y2_ = x;
  }
  Vec3d y = b * (x + 2 * x1_ + x2_) - a1 * y1_ - a2 * y2_;
  x2_ = std::exchange(x1_, x);
  y2_ = std::exchange(y1_, y);
  return y;
}

void IdleClock::Add(bool rests, double dt_s, double after_s) {
  if (!rests) {
    rest_s_ = 0;
    return;
  }
  const double before_s = rest_s_;
  rest_s_ += dt_s;
  if (rest_s_ > after_s) total_s_ += before_s > after_s ? dt_s : rest_s_;
}

void MotionMeter::Add(double time_s, const ToolState& state) {
  std::array<Vec3d, kMaxTools> tips;
  for (std::size_t i = 0; i < kMaxTools; ++i) {
    tips[i] = state.tools[i].p_WT.cast<double>();
    const bool present = state.tools[i].kind != ToolKind::kNone;
    if (present && !tools_[i].present) tracks_[i] = {};
    tools_[i].present |= present;
  }
  if (last_s_ && !(time_s > *last_s_)) return;
  const bool restarted = last_s_ && state.stamp.epoch != epoch_;
  if (restarted || (last_s_ && time_s - *last_s_ > kGap_s)) Finish();
  if (restarted) Restart(time_s);
  epoch_ = state.stamp.epoch;
  for (std::size_t i = 0; i < kMaxTools; ++i) {
    Return& back = returns_[i];
    if (time_s >= back.until_s || (tips[i] - back.place).norm() < kReturned_m) back.until_s = -1;
  }
  if (last_s_) {
    for (double k = std::floor(*last_s_ * kGridRate_Hz) + 1; k / kGridRate_Hz <= time_s; ++k) {
      const double share = (k / kGridRate_Hz - *last_s_) / (time_s - *last_s_);
      std::array<Vec3d, kMaxTools> between;
      for (std::size_t i = 0; i < kMaxTools; ++i) between[i] = last_tips_[i] + share * (tips[i] - last_tips_[i]);
      Step(k / kGridRate_Hz, between);
    }
  }
  last_s_ = time_s;
  last_tips_ = tips;
}

void MotionMeter::Finish() {
  for (std::size_t i = 0; i < kMaxTools; ++i) {
    Close(&tracks_[i], &tools_[i]);
    tracks_[i] = {};
  }
  last_s_.reset();
}

void MotionMeter::Restart(double time_s) {
  for (std::size_t i = 0; i < kMaxTools; ++i) {
    if (!tools_[i].present) continue;
    if (returns_[i].until_s < 0) returns_[i].place = last_tips_[i];
    returns_[i].until_s = time_s + kReturn_s;
  }
}

void MotionMeter::Step(double time_s, const std::array<Vec3d, kMaxTools>& tips) {
  bool any = false, all_rest = true;
  for (std::size_t i = 0; i < kMaxTools; ++i) {
    if (!tools_[i].present || returns_[i].until_s >= 0) continue;
    const Vec3d tip = tracks_[i].filter.Filter(tips[i]);
    const double step_m = (tip - tracks_[i].last.value_or(tip)).norm();
    tracks_[i].last = tip;
    const double speed = step_m * kGridRate_Hz;
    const bool rests = speed < static_cast<double>(params_.idle_speed_m_s);
    // Slower motion is tremor and noise of the device, which would add path without end.
    if (2 * speed > static_cast<double>(params_.idle_speed_m_s)) tools_[i].path_m += step_m;
    tools_[i].idle.Add(rests, 1 / kGridRate_Hz, static_cast<double>(params_.idle_after_s));
    Follow(time_s, speed, &tracks_[i], &tools_[i]);
    any = true;
    all_rest = all_rest && rests;
  }
  if (any) idle_.Add(all_rest, 1 / kGridRate_Hz, static_cast<double>(params_.idle_after_s));
}

void MotionMeter::Follow(double time_s, double speed, Track* track, ToolMotion* tool) const {
  const bool slow = speed < static_cast<double>(params_.idle_speed_m_s);
  if (slow && track->profile.empty()) return;
  track->profile.push_back(speed);
  track->slow = slow ? track->slow + 1 : 0;
  const bool was_movement = track->is_movement;
  track->is_movement = was_movement || speed > static_cast<double>(params_.movement_speed_m_s);
  if (track->is_movement && !was_movement) {
    ++tool->movements;
    if (tool->first_s < 0) {
      tool->first_s = time_s - static_cast<double>(track->profile.size()) / kGridRate_Hz;
    }
  }
  if (track->is_movement) tool->last_s = time_s - track->slow / kGridRate_Hz;
  if (track->slow >= kSlowSamples || track->profile.size() >= kLongestMovement) Close(track, tool);
}

void MotionMeter::Close(Track* track, ToolMotion* tool) {
  track->profile.resize(track->profile.size() - static_cast<std::size_t>(track->slow));
  if (track->is_movement && track->profile.size() >= kShortestMovement) {
    if (const double arc = SpectralArcLength(track->profile, kGridRate_Hz); std::isfinite(arc)) {
      tool->smoothness_sum += arc;
      ++tool->smoothness_count;
    }
  }
  track->profile.clear();
  track->is_movement = false;
  track->slow = 0;
}

}  // namespace fulcrum::assessment
