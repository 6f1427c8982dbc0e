#include "haptics_node/device/simulated_device.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "services/base/core/script_rest.h"

namespace fulcrum::haptics {
namespace {

// If session time and clock differ by more than this, a new session has begun and the device restarts at rest.
constexpr double kSessionJump_s = 0.05;
// An assistant reaches the wanted traction on tissue of 40 N/m in half a second, and no faster than a careful hand.
constexpr double kPull_m_per_Ns = 0.05, kFastestPull_m_s = 0.010;
constexpr double kFarthestPull_m = 0.025;  // From the script.
constexpr double kLetGo_s = 0.3;           // Time constant of the way back to the script.
constexpr double kFeels_N = 0.02;          // A smaller force has no direction.

}  // namespace

Vec3d RestingAttachPoint(const Trocar& trocar) {
  const Vec3d inward = trocar.p_WP.norm() > 0 ? Vec3d(-trocar.p_WP.normalized()) : Vec3d(-Vec3d::UnitZ());
  return AttachPointForTip(trocar, trocar.p_WP + 0.5 * trocar.length_m * inward);
}

SimulatedDevice::SimulatedDevice(const HandModel& hand, const Trocar& trocar, std::span<const ScriptKey> script,
                                 std::uint32_t tool)
    : hand_(hand), trocar_(trocar), script_(script), tool_(tool), rest_(RestingAttachPoint(trocar)) {}

SimulatedDevice::SimulatedDevice(const HandModel& hand, std::shared_ptr<const RecordedMotion> motion,
                                 const WorkspaceMap& map)
    : hand_(hand), motion_(std::move(motion)), map_(map), rest_(Vec3d::Zero()) {}

Vec3d SimulatedDevice::Target(double session_time_s) noexcept {
  if (motion_) return map_.ToWorld(motion_->PositionAt(session_time_s));
  point_ = EvaluateScript(script_, tool_, std::min(session_time_s, script_end_s_));
  return point_.present ? AttachPointForTip(trocar_, point_.p_W.cast<double>() + offset_) : rest_;
}

void SimulatedDevice::Pull(double elapsed_s) noexcept {
  if (!(traction_N_ > 0)) return;
  const Vec3d f_T = ForceAtTip(PoseFromAttachPoint(trocar_, hand_.position()), sent_);
  const double force_N = f_T.norm();
  if (point_.jaw_rad > kJawCloses_rad) {
    offset_ *= std::exp(-elapsed_s / kLetGo_s);
  } else if (force_N > kFeels_N) {
    const double speed = std::clamp(kPull_m_per_Ns * (traction_N_ - force_N), -kFastestPull_m_s, kFastestPull_m_s);
    offset_ -= elapsed_s * speed / force_N * f_T;
    offset_ *= std::min(1.0, kFarthestPull_m / std::max(offset_.norm(), 1e-9));
  }
}

Vec3d SimulatedDevice::ReadPosition(const Tick& tick) noexcept {
  const double elapsed = 1e-9 * static_cast<double>(tick.stamp_ns - stamp_ns_);
  const bool same_session = std::abs(tick.session_time_s - session_time_s_ - elapsed) < kSessionJump_s ||
                            (tick.session_time_s < 0 && session_time_s_ < 0);
  if (!placed_ || !same_session) {
    placed_ = true;
    offset_.setZero();
    hand_.Place(Target(tick.session_time_s));
  } else {
    if (elapsed > 0.0) Pull(elapsed);
    const Vec3d target = Target(tick.session_time_s);
    if (elapsed > 0.0) hand_.Advance(target, force_scale_ * sent_, elapsed);
  }
  session_time_s_ = tick.session_time_s;
  stamp_ns_ = tick.stamp_ns;
  return hand_.position();
}

std::int64_t SimulatedDevice::RestsUntil() const noexcept {
  // The servo sees the hand at rest once more before it moves.
  constexpr double kBefore_s = 2e-3;
  if (motion_ || !placed_) return 0;
  double until_s = ScriptRestsUntil(script_, tool_, std::min(session_time_s_, script_end_s_));
  if (until_s >= script_end_s_) until_s = std::numeric_limits<double>::infinity();
  const double rest_s = std::clamp(until_s - session_time_s_ - kBefore_s, 0.0, 1.0);
  return stamp_ns_ + static_cast<std::int64_t>(1e9 * rest_s);
}

Vec3d RestOf(const SceneView& scene, std::uint32_t tool) {
  const Trocar trocar{scene.tools[tool].p_WP.cast<double>(), scene.tools[tool].shaft_length_m};
  return scene.tools[tool].kind == ToolKind::kScope ? AttachPointForTip(trocar, scene.render.scope_tip_W.cast<double>())
                                                    : RestingAttachPoint(trocar);
}

std::unique_ptr<SimulatedDevice> MakeScriptedDevice(const SceneView& scene, std::uint32_t tool, const HandModel& hand) {
  const ToolDescription& description = scene.tools[tool];
  const Trocar trocar{description.p_WP.cast<double>(), description.shaft_length_m};
  auto device = std::make_unique<SimulatedDevice>(hand, trocar, scene.script, tool);
  device->set_traction(static_cast<double>(scene.haptics.force_scale * description.traction_N));
  device->set_rest(RestOf(scene, tool));
  return device;
}

}  // namespace fulcrum::haptics
