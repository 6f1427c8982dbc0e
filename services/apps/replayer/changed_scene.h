// A scene with some of its parameters changed, for asking what would have been.
#pragma once

#include <string>
#include <vector>

#include "services/base/core/scene_view.h"
#include "services/scene/format/scene_file.h"

namespace fulcrum::replay {

/// The parameters of the sections that describe materials and methods, not shapes, can be changed: physics, thermal,
/// haptics, breathing. Each change is "section.key=value" as in the scene's description, and checked like that.
/// The result keeps the hash of the scene, for it stands in for it. It refers to the arrays of `scene`.
/// Throws InputError that names the change and what is valid.
[[nodiscard]] SceneView WithChanges(const scene::SceneFile& scene, const std::vector<std::string>& changes);

}  // namespace fulcrum::replay
