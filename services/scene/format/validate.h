// Checks of a whole scene: the properties on which every reader may rely.
#pragma once

#include <optional>
#include <string>

#include "services/base/core/scene_view.h"

namespace fulcrum::scene {

/// A fault of a scene and its place.
struct SceneFault {
  std::string section;  ///< As in services/scene/format/sections.h; "scene" for names, parameters, counts and tools.
  std::string reason;   ///< Names the element, its value and the valid values.
};

/// The first fault found, or nothing. Checks that every index is in range, every number finite and in its range, sizes
/// are consistent, tetrahedra have positive volume, colours share no particle, weights sum to one, and the script is
/// sorted.
std::optional<SceneFault> FindFault(const SceneView& scene);

}  // namespace fulcrum::scene
