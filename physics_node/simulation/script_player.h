// Moves the tools of a scene along its script, like a rigid hand.
#pragma once

#include <array>

#include "physics_node/simulation/tissue_simulation.h"
#include "services/base/core/operator_script.h"
#include "services/base/core/scene_view.h"

namespace fulcrum::physics {

/// Tool frame at a tip position: z from the pivot to the tip, x the projection of world +X (as the haptics node does).
inline ToolPose PoseAtTip(const ToolDescription& tool, const Vec3f& p_WT, float jaw_rad) {
  const Vec3f z = (p_WT - tool.p_WP).normalized();
  const Vec3f x = (Vec3f::UnitX() - z.x() * z).normalized();
  Mat3f R;
  R << x, z.cross(x), z;
  return {p_WT, Quatf(R), jaw_rad};
}

inline std::array<ToolInput, kMaxTools> ScriptedTools(const SceneView& scene, double time_s) {
  std::array<ToolInput, kMaxTools> tools;
  for (std::uint32_t i = 0; i < kMaxTools; ++i) {
    const ScriptPoint point = EvaluateScript(scene.script, i, time_s);
    if (point.present) {
      tools[i] = {true, PoseAtTip(scene.tools[i], point.p_W, point.jaw_rad)};
    }
  }
  return tools;
}

}  // namespace fulcrum::physics
