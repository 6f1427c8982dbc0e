// A simulated device with a hand on it: mass, spring and damper that follow an intended place in session time, under
// the force that is sent to the device. It starts at rest at the intended place, so a restart needs no stored state.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "haptics_node/device/hand_model.h"
#include "haptics_node/device/haptic_device.h"
#include "haptics_node/device/recorded_motion.h"
#include "haptics_node/device/workspace_map.h"
#include "haptics_node/kinematics/trocar.h"
#include "services/base/core/scene_view.h"

namespace fulcrum::haptics {

/// Attach point of a tool at rest [m]: half of its shaft inside, pointing at the origin of W.
[[nodiscard]] Vec3d RestingAttachPoint(const Trocar& trocar);

class SimulatedDevice final : public HapticDevice {
 public:
  /// The hand moves the tip along the scene's script.
  /// @param script keys of all tools; it must outlive the device. A tool without keys rests.
  SimulatedDevice(const HandModel& hand, const Trocar& trocar, std::span<const ScriptKey> script, std::uint32_t tool);
  /// The hand plays a recorded motion of the attach point, transformed to the world by `map`.
  SimulatedDevice(const HandModel& hand, std::shared_ptr<const RecordedMotion> motion, const WorkspaceMap& map);

  /// Share of the force that reaches the hand, 0 … 1.
  void set_force_scale(double scale) { force_scale_ = scale; }

  [[nodiscard]] Vec3d ReadPosition(const Tick& tick) noexcept override;
  void WriteForce(const Vec3d& f_W) noexcept override { force_ = force_scale_ * f_W; }

 private:
  /// Intended attach point at this session time.
  [[nodiscard]] Vec3d Target(double session_time_s) const noexcept;

  HandOnDevice hand_;
  Trocar trocar_;
  std::span<const ScriptKey> script_;
  std::uint32_t tool_ = 0;
  std::shared_ptr<const RecordedMotion> motion_;
  WorkspaceMap map_;
  double force_scale_ = 1;

  bool placed_ = false;
  double session_time_s_ = 0;
  std::int64_t stamp_ns_ = 0;
  Vec3d force_ = Vec3d::Zero();
};

}  // namespace fulcrum::haptics
