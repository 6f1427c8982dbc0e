#include "haptics_node/device/simulated_device.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "services/base/core/operator_script.h"

namespace fulcrum::haptics {
namespace {

// If session time and clock differ by more than this, a new session has begun and the device restarts at rest.
constexpr double kSessionJump_s = 0.05;

}  // namespace

Vec3d RestingAttachPoint(const Trocar& trocar) {
  const Vec3d inward = trocar.p_WP.norm() > 0 ? Vec3d(-trocar.p_WP.normalized()) : Vec3d(-Vec3d::UnitZ());
  return AttachPointForTip(trocar, trocar.p_WP + 0.5 * trocar.length_m * inward);
}

SimulatedDevice::SimulatedDevice(const HandModel& hand, const Trocar& trocar, std::span<const ScriptKey> script,
                                 std::uint32_t tool)
    : hand_(hand), trocar_(trocar), script_(script), tool_(tool) {}

SimulatedDevice::SimulatedDevice(const HandModel& hand, std::shared_ptr<const RecordedMotion> motion,
                                 const WorkspaceMap& map)
    : hand_(hand), motion_(std::move(motion)), map_(map) {}

Vec3d SimulatedDevice::Target(double session_time_s) const noexcept {
  if (motion_) return map_.ToWorld(motion_->PositionAt(session_time_s));
  const ScriptPoint point = EvaluateScript(script_, tool_, session_time_s);
  return point.present ? AttachPointForTip(trocar_, point.p_W.cast<double>()) : RestingAttachPoint(trocar_);
}

Vec3d SimulatedDevice::ReadPosition(const Tick& tick) noexcept {
  const Vec3d target = Target(tick.session_time_s);
  const double elapsed = 1e-9 * static_cast<double>(tick.stamp_ns - stamp_ns_);
  const bool same_session = std::abs(tick.session_time_s - session_time_s_ - elapsed) < kSessionJump_s ||
                            (tick.session_time_s < 0 && session_time_s_ < 0);
  if (!placed_ || !same_session) {
    placed_ = true;
    hand_.Place(target);
  } else if (elapsed > 0.0) {
    hand_.Advance(target, force_, elapsed);
  }
  session_time_s_ = tick.session_time_s;
  stamp_ns_ = tick.stamp_ns;
  return hand_.position();
}

}  // namespace fulcrum::haptics
