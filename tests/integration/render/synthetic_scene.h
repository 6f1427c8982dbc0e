// Synthetic state of an operation without physics and heat: the renderer's inputs at a time of the scene's script. The
// grasper lifts a tent, the hook has cut along its path so far, the slit gapes and its edges are browned.
#pragma once

#include <vector>

#include "services/base/core/scene_view.h"

namespace fulcrum::render {

struct SyntheticMoment {
  TissueFrame tissue;
  TopologyState topology;
  std::vector<TemperaturePatch> patches;
  ToolState tools;
  HandleState handles;
  std::vector<Vec2f> cut_path;           ///< Material (s, t) [m] of the cut so far; empty before it.
  Vec2f grasp_material = Vec2f::Zero();  ///< Where the grasper holds [m].
};

[[nodiscard]] SyntheticMoment MakeSyntheticMoment(const SceneView& scene, double time_s);

/// Material place of the membrane node nearest to p_W at rest.
[[nodiscard]] Vec2f NearestMaterial(const SceneView& scene, const Vec3f& p_W);

}  // namespace fulcrum::render
