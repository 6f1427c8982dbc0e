#include "haptics_node/device/simulated_device.h"

#include <algorithm>
#include <cmath>

#include "services/core/operator_script.h"

namespace fulcrum::haptics {
namespace {

constexpr double kStep_s = 1e-3;
// After a longer gap than this the hand has long settled; it also bounds the work of one tick.
constexpr double kMaxCatchUp_s = 0.1;
// Session time that runs apart from the clock by more than this is another session (or the first): begin anew.
constexpr double kSessionJump_s = 0.05;

}  // namespace

SimulatedDevice::SimulatedDevice(const HapticsParams& hand, const Trocar& trocar, std::span<const ScriptKey> script,
                                 std::uint32_t tool)
    : mass_kg_(hand.hand_mass_kg + kDeviceMass_kg),
      stiffness_N_m_(hand.hand_stiffness_N_m),
      damping_Ns_m_(hand.hand_damping_Ns_m),
      trocar_(trocar),
      script_(script),
      tool_(tool) {}

Vec3d SimulatedDevice::Target(double session_time_s) const noexcept {
  const ScriptPoint point = EvaluateScript(script_, tool_, session_time_s);
  if (point.present) return AttachPointForTip(trocar_, point.p_W.cast<double>());
  return AttachPointForTip(trocar_, trocar_.p_WP - 0.5 * trocar_.length_m * trocar_.p_WP.normalized());
}

Vec3d SimulatedDevice::ReadPosition(const Tick& tick) noexcept {
  const Vec3d target = Target(tick.session_time_s);
  const double elapsed = 1e-9 * static_cast<double>(tick.stamp_ns - stamp_ns_);
  const bool same_session = std::abs(tick.session_time_s - session_time_s_ - elapsed) < kSessionJump_s ||
                            (tick.session_time_s < 0 && session_time_s_ < 0);
  if (!placed_ || !same_session) {
    placed_ = true;
    position_ = target;
    velocity_.setZero();
  } else if (elapsed > 0.0) {
    // Implicit Euler on m a = k (target - x) + b (target' - v) + f: unconditionally stable for any hand.
    const double span = std::min(elapsed, kMaxCatchUp_s);
    const int steps = std::max(1, static_cast<int>(std::lround(span / kStep_s)));
    const double h = span / steps;
    const Vec3d target_velocity = (target - target_) / elapsed;
    const double inertia = mass_kg_ + h * damping_Ns_m_ + h * h * stiffness_N_m_;
    for (int i = 1; i <= steps; ++i) {
      const Vec3d wanted = target - (steps - i) * h * target_velocity;
      velocity_ = (mass_kg_ * velocity_ +
                   h * (stiffness_N_m_ * (wanted - position_) + damping_Ns_m_ * target_velocity + force_)) /
                  inertia;
      position_ += h * velocity_;
    }
  }
  target_ = target;
  session_time_s_ = tick.session_time_s;
  stamp_ns_ = tick.stamp_ns;
  return position_;
}

}  // namespace fulcrum::haptics
