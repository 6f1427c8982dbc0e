// Invariants of the tissue after any sequence of operations.
#pragma once

#include <string>

#include "physics_node/simulation/tissue_simulation.h"

namespace fulcrum::physics {

struct TissueBounds {
  float distance_m = 0;      ///< No particle of live, connected tissue is farther from rest.
  float speed_m_s = 0;       ///< Nothing moved faster in the last step.
  float force_N = 0;         ///< No tool force is larger.
  bool no_inverted = false;  ///< No tetrahedron of the organ is inverted.
};

/// Describes a violated invariant after a Step; empty if there is none. Checked are: positions are finite and within
/// bounds; held particles are alive, in range, held once and without inverse mass, the others have their own; contact
/// pairs and rows are on live tissue only; exactly the pieces of membrane without an anchor are frozen as debris.
[[nodiscard]] std::string FaultOf(TissueSimulation* simulation, const SceneView& scene, const StepReport& report,
                                  const TissueBounds& bounds);

}  // namespace fulcrum::physics
