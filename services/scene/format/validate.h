// Checks of a whole scene: what every reader may rely on.
#pragma once

#include <optional>
#include <string>

#include "services/base/core/scene_view.h"

namespace fulcrum::scene {

/// What is wrong and where.
struct SceneFault {
  std::string section;  ///< As in services/scene/format/sections.h; "scene" for names, parameters, counts and tools.
  std::string reason;   ///< Names the element, its value and what is valid.
};

/// The first fault found, or nothing: every index in range, every number finite and in its range, sizes that belong
/// together, tetrahedra of positive volume, colours without shared particles, weights that sum to one, sorted script.
std::optional<SceneFault> FindFault(const SceneView& scene);

}  // namespace fulcrum::scene
