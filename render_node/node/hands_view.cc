#include "render_node/node/hands_view.h"

#include <cmath>

#include "render_node/geometry/laparoscope.h"
#include "services/base/core/scope.h"
#include "services/base/core/tool_roll.h"

namespace fulcrum::render {

std::array<Vec3d, kMaxTools> RollReferences(const SceneView& scene) {
  const Vec3f field_centre = FieldCentre(scene), level_up = LevelUp(scene.render);
  std::array<Vec3d, kMaxTools> references;
  for (std::size_t i = 0; i < kMaxTools; ++i) references[i] = RollReference(scene.tools[i], field_centre, level_up);
  return references;
}

HandsView MakeHandsView(const SceneView& scene, const RenderParams& camera, int height, const ToolState& tools,
                        const HandleState& handles, const std::array<Vec3d, kMaxTools>& roll_references) {
  const Eigen::Matrix4f view = MakeLaparoscope(camera).view;
  constexpr float kRadPerDeg = 0.0174532925f;
  HandsView hands;
  hands.eye = camera.scope_tip_W;
  hands.right = view.row(0).head<3>().transpose();
  hands.up = view.row(1).head<3>().transpose();
  hands.forward = -view.row(2).head<3>().transpose();
  hands.pixel = 2.0f * std::tan(0.5f * kRadPerDeg * camera.fov_deg) / static_cast<float>(height);
  for (std::size_t i = 0; i < kMaxTools; ++i) {
    hands.present[i] = tools.tools[i].kind != ToolKind::kNone && !scene.tools[i].assists();
    hands.scope[i] = tools.tools[i].kind == ToolKind::kScope;
    hands.tip[i] = tools.tools[i].p_WT;
    if (tools.tools[i].kind != ToolKind::kNone) {
      hands.roll_rad[i] = ToolRoll(tools.tools[i].kind, tools.tools[i].q_WT, roll_references[i]);
    }
    const HandleSample& handle = handles.handles[i];
    hands.closed[i] = handle.present && IsClosed(handle.jaw_angle_rad, hands.scope[i]);
    hands.force_N[i] = tools.tools[i].f_W.norm();
  }
  return hands;
}

PictureHeader MakePictureHeader(const HandsView& view) {
  PictureHeader header;
  header.eye_W = view.eye;
  header.right_W = view.right;
  header.up_W = view.up;
  header.forward_W = view.forward;
  header.pixel_rad = view.pixel;
  header.tip_W = view.tip;
  for (std::size_t i = 0; i < kMaxTools; ++i) {
    header.present |= view.present[i] ? 1u << i : 0u;
    header.scopes |= view.scope[i] ? 1u << i : 0u;
  }
  return header;
}

}  // namespace fulcrum::render
