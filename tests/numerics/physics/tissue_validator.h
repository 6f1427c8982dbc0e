// Invariants of the tissue after any sequence of operations.
#pragma once

#include <string>

#include "physics_node/simulation/tissue_simulation.h"

namespace fulcrum::physics {

struct TissueBounds {
  float distance_m = 0;      ///< No particle of live, connected tissue is farther from rest.
  float speed_m_s = 0;       ///< Nothing moved faster in the last step.
  float force_N = 0;         ///< No tool feels more.
  bool no_inverted = false;  ///< No tetrahedron of the organ is inverted.
};

/// Describes a violated invariant after a Step; empty if there is none. Checked are: places finite and within bounds;
/// what is held alive, in range, held once and without inverse mass, what is not held with its own; contact pairs and
/// rows on live tissue only; pieces of membrane without an anchor frozen as debris, and only those.
[[nodiscard]] std::string FaultOf(TissueSimulation* simulation, const SceneView& scene, const StepReport& report,
                                  const TissueBounds& bounds);

}  // namespace fulcrum::physics
