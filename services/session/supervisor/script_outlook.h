// What the scene's script will do: the phase at a time, and what a run of it must have brought about. Pure.
#pragma once

#include <string>

#include "services/base/core/scene_view.h"

namespace fulcrum::supervisor {

/// For people: "approach", "grasp", "pull", "hold", "cut", "coagulate", "release"; empty without a script.
[[nodiscard]] std::string PhaseAt(const SceneView& scene, double session_time_s);

/// What has to be seen in a run that ends at some session time.
struct ScriptDemands {
  bool deformation = false;  ///< The script grasps, or works with the hook.
  bool cut = false;          ///< The script holds the pedal down with power.
};
/// Only what the script asks for early enough before `end_s` counts: tissue needs time to follow.
[[nodiscard]] ScriptDemands DemandsUntil(const SceneView& scene, double end_s);

}  // namespace fulcrum::supervisor
