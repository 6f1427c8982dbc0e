#include "physics_node/collision/tool_shape.h"

#include <algorithm>
#include <cmath>

namespace fulcrum::physics {

ToolPose Interpolate(const ToolPose& from, const ToolPose& to, float u) {
  return {from.p_WT + u * (to.p_WT - from.p_WT), from.q_WT.slerp(u, to.q_WT),
          from.jaw_rad + u * (to.jaw_rad - from.jaw_rad)};
}

ToolShape ShapeOf(const ToolDescription& tool, const ToolPose& pose) {
  ToolShape shape;
  const auto add = [&](const Vec3f& a_T, const Vec3f& b_T, float radius, ToolPart part) {
    shape.capsules[static_cast<std::size_t>(shape.count++)] = {pose.ToWorld(a_T), pose.ToWorld(b_T), radius, part};
  };
  const float length = tool.tip_length_m;
  if (tool.kind == ToolKind::kHook) {
    add(Vec3f::Zero(), Vec3f(length, 0, 0), tool.tip_radius_m, ToolPart::kTip);
    add(Vec3f::Zero(), Vec3f(0, 0, -kHookNeck), tool.tip_radius_m, ToolPart::kTip);
    add(Vec3f(0, 0, -kHookNeck), Vec3f(0, 0, -std::max(tool.shaft_length_m, kHookNeck)), tool.shaft_radius_m,
        ToolPart::kShaft);
  } else if (tool.kind == ToolKind::kSuction) {  // Its handle moves a valve.
    add(Vec3f(0, 0, -length), Vec3f::Zero(), tool.tip_radius_m, ToolPart::kJaw);
    add(Vec3f(0, 0, -length), Vec3f(0, 0, -std::max(tool.shaft_length_m, length)), tool.shaft_radius_m,
        ToolPart::kShaft);
  } else if (tool.kind != ToolKind::kNone) {
    const float half = 0.5f * pose.jaw_rad;
    const Vec3f hinge(0, 0, -length);
    for (const float side : {1.0f, -1.0f}) {
      add(hinge, hinge + length * Vec3f(side * std::sin(half), 0, std::cos(half)), tool.tip_radius_m, ToolPart::kJaw);
    }
    add(hinge, Vec3f(0, 0, -std::max(tool.shaft_length_m, length)), tool.shaft_radius_m, ToolPart::kShaft);
  }
  return shape;
}

Capsule WorkingLine(const ToolDescription& tool, const ToolPose& pose) {
  if (tool.kind == ToolKind::kHook) {
    return {pose.ToWorld(Vec3f::Zero()), pose.ToWorld(Vec3f(tool.tip_length_m, 0, 0)), tool.tip_radius_m,
            ToolPart::kTip};
  }
  return {pose.ToWorld(Vec3f(0, 0, -tool.tip_length_m)), pose.p_WT, tool.tip_radius_m, ToolPart::kJaw};
}

}  // namespace fulcrum::physics
