// A scene with changed parameters, for a what-if replay.
#pragma once

#include <string>
#include <vector>

#include "services/base/core/scene_view.h"
#include "services/scene/format/scene_file.h"

namespace fulcrum::replay {

/// Applies changes to a scene. Each is "section.key=value" as in the scene's description, and checked in the same way;
/// valid sections describe materials and methods, not shapes: physics, thermal, haptics, breathing. Mesh files are not
/// read. The result keeps the hash of the scene, so that recordings of it are accepted, and refers to the arrays of
/// `scene` and to `solids`, its list of solids. Throws InputError that names the change and the valid values.
[[nodiscard]] SceneView WithChanges(const scene::SceneFile& scene, const std::vector<std::string>& changes,
                                    std::vector<Solid>* solids);

}  // namespace fulcrum::replay
