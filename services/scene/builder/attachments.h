// What joins two solids: springs of tissue, glued or sliding, by proximity or within named regions.
#pragma once

#include <vector>

#include "services/scene/builder/build.h"

namespace fulcrum::scene {

/// Springs from every vertex of a body's surface to the nearest point of another one within reach: a column of tissue
/// over the vertex's share of the surface, as long as the distance. Sliding only where the surfaces face each other.
/// `vertices`: of all solids, in double. Throws InputError, with what is near, where nothing is joined.
void AddAttachments(const SceneSettings& settings, const Anatomy& anatomy, const std::vector<Vec3d>& vertices,
                    SceneData* scene);

}  // namespace fulcrum::scene
