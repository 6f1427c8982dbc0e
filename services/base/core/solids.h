// Which solid of a scene an organ's vertex belongs to.
#pragma once

#include <vector>

#include "services/base/core/scene_view.h"

namespace fulcrum {

inline constexpr Index kMaxSolids = 25;  ///< Of a scene: the organ and others.

/// By organ vertex: index in TissueScene::solids; 0 in a scene of one organ. Ranges that reach beyond the vertices are
/// cut off.
[[nodiscard]] inline std::vector<Index> SolidOfVertices(const TissueScene& scene) {
  std::vector<Index> solid(scene.tube_vertex_count, 0);
  for (Index i = 0; i < scene.solids.size(); ++i) {
    const std::uint64_t first = scene.solids[i].first_vertex, end = first + scene.solids[i].vertex_count;
    for (std::uint64_t v = first; v < end && v < solid.size(); ++v) solid[v] = i;
  }
  return solid;
}

/// How many bodies of tetrahedra the scene has.
[[nodiscard]] inline Index SolidCount(const TissueScene& scene) {
  if (!scene.solids.empty()) return static_cast<Index>(scene.solids.size());
  return scene.tube_vertex_count > 0 ? 1 : 0;
}

/// Whether burning this solid harms an organ; fat does not count, because a dissection goes through it.
[[nodiscard]] inline bool IsOrgan(const TissueScene& scene, Index solid) {
  return scene.solids.empty() || (solid < scene.solids.size() && scene.solids[solid].look != SolidLook::kFat);
}

[[nodiscard]] inline float YoungsModulusOf(const TissueScene& scene, Index solid) {
  return scene.solids.empty() ? scene.physics.tube_youngs_modulus_Pa : scene.solids[solid].youngs_modulus_Pa;
}

}  // namespace fulcrum
