// Physics and heat in closed loop, in lock step and without a bus: a hook that is moved along a path cuts the deforming
// membrane, and the cut is returned to the membrane. Shared by the tests of the cut.
#pragma once

#include <functional>
#include <vector>

#include "physics_node/simulation/tissue_simulation.h"
#include "services/base/core/scene_view.h"
#include "thermal_node/coupling/thermal_solver.h"
#include "thermal_node/coupling/tip_tracker.h"

namespace fulcrum::cut {

/// Input at a moment of the session.
struct Moment {
  std::array<physics::ToolInput, kMaxTools> tools;
  CauteryMode mode = CauteryMode::kOff;
  float power_W = 0;
};
using Operator = std::function<Moment(double time_s)>;

/// State after a step of the loop.
struct LoopStep {
  double time_s = 0;
  CauteryContact contact;
  CauteryMode mode = CauteryMode::kOff;
  float length_m = 0;  ///< Length of the cut, as published.
  float power_W = 0;
};

class ClosedLoop {
 public:
  explicit ClosedLoop(const SceneView& scene);
  /// Advances by the period of physics; thermal_node processes every sample as in a live session.
  const LoopStep& Step(const Moment& moment);
  /// Runs for `duration_s`; returns all steps.
  std::vector<LoopStep> Run(const Operator& hand, double duration_s);

  [[nodiscard]] const thermal::ThermalSolver& thermal() const { return thermal_; }
  [[nodiscard]] thermal::ThermalSolver* mutable_thermal() { return &thermal_; }
  [[nodiscard]] physics::TissueSimulation& physics() { return physics_; }

 private:
  SceneView scene_;
  physics::TissueSimulation physics_;
  thermal::ThermalSolver thermal_;
  thermal::TipTracker tracker_;
  TopologyState topology_;
  OpenCells open_cells_;
  LoopStep step_;
  std::uint64_t steps_ = 0;
};

/// Tool frame at a tip position, as in the servo: z from the trocar to the tip, x the projection of world +x.
[[nodiscard]] physics::ToolPose PoseAtTip(const ToolDescription& tool, const Vec3f& p_WT);
/// World position `height_m` above the sheet at rest, at fractions (s, t) of the grid.
[[nodiscard]] Vec3f PlaceOnSheet(const SceneView& scene, const Vec2f& fractions, float height_m);

}  // namespace fulcrum::cut
