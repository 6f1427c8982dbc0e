// Smooth surfaces between the labels of a segmentation, which neighbours share.
#pragma once

#include <cstdint>
#include <map>

#include "services/scene/anatomy/label_map.h"
#include "services/scene/readers/mesh_io.h"

namespace fulcrum::scene {

/// The boundary of each of `wanted` labels, outward, in frame W [mm]: constrained elastic surface nets (Gibson 1998) of
/// all labels at once (Frisken 2022), so that two labels that touch have the same vertices between them. A vertex lies
/// in the cube between eight voxel centres and never leaves it, whatever the smoothing: the surface is within a voxel
/// of the voxels' boundary, and nothing shrinks or vanishes.
std::map<int, TriangleMesh> SurfacesOf(const LabelMap& map, const std::vector<int>& wanted);

}  // namespace fulcrum::scene
