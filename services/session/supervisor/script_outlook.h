// Predictions from the scene's script: the phase at a session time, and the effects that a run must show. Pure
// functions.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "services/base/config/cart.h"
#include "services/base/core/scene_view.h"

namespace fulcrum::supervisor {

/// Name of the phase: "approach", "grasp", "pull", "hold", "cut", "coagulate", "release"; empty without a script.
[[nodiscard]] std::string PhaseAt(const SceneView& scene, double session_time_s);

/// Session times [s].
struct TimeSpan {
  double begin_s = 0, end_s = 0;
};

/// Effects that a run up to some session time must show.
struct ScriptDemands {
  bool deformation = false;            ///< The script grasps, or works with the hook.
  bool cut = false;                    ///< The script cuts with the hook, and there is a sheet to cut.
  bool grasp = false;                  ///< The script grasps.
  std::vector<TimeSpan> cutting = {};  ///< When it demands the cut; empty: at any time.
};
/// Demands of the script up to session time `end_s` [s], without actions so shortly before it that the tissue cannot
/// have followed.
[[nodiscard]] ScriptDemands DemandsUntil(const SceneView& scene, double end_s);
/// Those that the nodes of the session can fulfil, on a cart whose operator is simulated: a person need not follow the
/// script. @param node_mask nodes of the session, one bit per NodeId.
[[nodiscard]] ScriptDemands PossibleDemands(ScriptDemands demands, std::uint32_t node_mask,
                                            const config::CartConfig& cart);

}  // namespace fulcrum::supervisor
