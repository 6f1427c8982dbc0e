// A simulated device with a hand on it: mass, spring and damper that follow an intended place in session time, under
// the force that is sent to the device. It starts at rest at the intended place, so a restart needs no stored state.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <span>

#include "haptics_node/device/hand_model.h"
#include "haptics_node/device/haptic_device.h"
#include "haptics_node/device/recorded_motion.h"
#include "haptics_node/device/workspace_map.h"
#include "haptics_node/kinematics/trocar.h"
#include "services/base/core/operator_script.h"
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

  /// The hand of an assistant: while the script's jaw is closed it pulls against the tissue until the hand force at
  /// the tip is this [N], wherever the tissue goes. 0: it follows the script alone.
  void set_traction(double traction_N) { traction_N_ = traction_N; }
  /// The script stands still from this session time on [s].
  void set_script_end(double session_time_s) { script_end_s_ = session_time_s; }
  /// Attach point of a tool that the script does not move [m].
  void set_rest(const Vec3d& p_WA) { rest_ = p_WA; }
  /// Share of the force that reaches the hand, 0 … 1.
  void set_force_scale(double scale) { force_scale_ = scale; }

  [[nodiscard]] Vec3d ReadPosition(const Tick& tick) noexcept override;
  [[nodiscard]] float ReadRoll() const noexcept override { return point_.roll_rad; }
  void WriteForce(const Vec3d& f_W) noexcept override { sent_ = f_W; }
  [[nodiscard]] std::int64_t RestsUntil() const noexcept override;

 private:
  /// Intended attach point at this session time.
  [[nodiscard]] Vec3d Target(double session_time_s) noexcept;
  /// Moves offset_ towards the wanted traction.
  void Pull(double elapsed_s) noexcept;

  HandOnDevice hand_;
  Trocar trocar_;
  std::span<const ScriptKey> script_;
  std::uint32_t tool_ = 0;
  std::shared_ptr<const RecordedMotion> motion_;
  WorkspaceMap map_;
  double force_scale_ = 1;
  double traction_N_ = 0;
  double script_end_s_ = std::numeric_limits<double>::infinity();
  Vec3d rest_;

  bool placed_ = false;
  double session_time_s_ = 0;
  std::int64_t stamp_ns_ = 0;
  ScriptPoint point_;             ///< Of the script at session_time_s_.
  Vec3d offset_ = Vec3d::Zero();  ///< Of an assistant's tip from the script [m].
  Vec3d sent_ = Vec3d::Zero();    ///< Force on the hand, before its scale [N].
};

/// The scripted hand of a scene's tool: an assistant's keeps its traction, and a scope rests where it shows what the
/// scene's `render` describes. @param scene must outlive the device.
[[nodiscard]] std::unique_ptr<SimulatedDevice> MakeScriptedDevice(const SceneView& scene, std::uint32_t tool,
                                                                  const HandModel& hand);
/// Attach point of a scene's tool that is not moved [m].
[[nodiscard]] Vec3d RestOf(const SceneView& scene, std::uint32_t tool);

}  // namespace fulcrum::haptics
