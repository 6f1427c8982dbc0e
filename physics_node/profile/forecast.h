// What a step of a scene takes on this machine, measured in seconds: for a word before a session begins.
#pragma once

#include "services/base/core/scene_view.h"

namespace fulcrum::physics {

struct Forecast {
  double period_ms = 0;   ///< Of the scene's steps.
  double all_ms = 0;      ///< Median of a step in which all tissue moves.
  double working_ms = 0;  ///< The same while the tools do what the script does in its first stroke, or in its middle; 0
                          ///< without a script.
  double working_awake = 0;  ///< Share of the tissue that is awake then, at the end.
};

/// Steps the tissue alone: with all of it awake until it sleeps, then with the tools at that place of the script. Takes
/// as long as some 160 steps.
[[nodiscard]] Forecast ForecastScene(const SceneView& scene, int threads = 1);

}  // namespace fulcrum::physics
