#include "services/apps/replayer/frame_text.h"

#include <cmath>
#include <utility>
#include <vector>

#include "render_node/geometry/solid.h"
#include "services/apps/replayer/report_format.h"
#include "services/base/core/contact_force.h"
#include "services/base/core/json_text.h"

namespace fulcrum::replay {
namespace {

/// A keypoint lies on the axis: its instrument's own surface is nearer by the shaft's radius and this much [m].
constexpr double kAxisMargin_m = 0.001;

std::string Vector(const Vec3d& v) { return Format("[%.6f, %.6f, %.6f]", v.x(), v.y(), v.z()); }

std::string Matrix(const Eigen::Matrix4d& m) {
  std::string text = "[";
  for (int row = 0; row < 4; ++row) {
    text += row > 0 ? ", [" : "[";
    for (int k = 0; k < 4; ++k) text += Format(k > 0 ? ", %.9g" : "%.9g", m(row, k));
    text += "]";
  }
  return text + "]";
}

using Keypoints = std::vector<std::pair<const char*, Vec3d>>;

/// In frame T: the tip at the origin, the shaft along -z.
Keypoints KeypointsOf(const ToolDescription& tool, float jaw_rad) {
  const auto length = static_cast<double>(tool.tip_length_m);
  if (tool.kind == ToolKind::kHook) {
    return {{"heel", {0, 0, 0}}, {"toe", {length, 0, 0}}, {"neck", {0, 0, -static_cast<double>(render::kHookNeck)}}};
  }
  if (tool.kind == ToolKind::kSuction) return {{"tip", {0, 0, 0}}, {"neck", {0, 0, -length}}};
  const double half = 0.5 * static_cast<double>(jaw_rad);
  const Vec3d hinge(0, 0, -length), out(length * std::sin(half), 0, length * std::cos(half));
  return {{"jaw_plus", hinge + out}, {"jaw_minus", hinge + Vec3d(-out.x(), 0, out.z())}, {"hinge", hinge}};
}

std::string KeypointText(const char* name, const Vec3d& p_W, double radius_m, const Truth& truth) {
  const auto [place, depth] = truth.PlaceOf(p_W);
  const bool ahead = depth > 0;
  return Format("{\"name\": \"%s\", \"world_m\": ", name) + Vector(p_W) +
         (ahead ? Format(", \"pixel\": [%.3f, %.3f]", place.x(), truth.camera().height - place.y())
                : std::string(", \"pixel\": null")) +
         Format(", \"visible\": %s}", truth.Sees(p_W, radius_m + kAxisMargin_m) ? "true" : "false");
}

std::string Intrinsics(const render::Pinhole& camera, const char* separator) {
  return Format("\"fx\": %.6f", camera.focal) + separator + Format("\"fy\": %.6f", camera.focal) + separator +
         Format("\"cx\": %.3f", camera.centre_x) + separator + Format("\"cy\": %.3f", camera.height - camera.centre_y);
}

}  // namespace

std::string CalibrationText(const render::Pinhole& camera, double baseline_m, std::span<const Solid> solids) {
  std::string text = Format("{\n  \"width\": %d,\n  \"height\": %d,\n  ", camera.width, camera.height) +
                     Intrinsics(camera, ",\n  ") +
                     Format(",\n  \"field_radius\": %.3f,\n  \"baseline_m\": %.6f,\n", camera.radius, baseline_m);
  text += Format(
      "  \"depth_unit_m\": %g,\n  \"flow_unit_px\": %g,\n  \"flow_zero\": 32768,\n  \"temperature_unit_C\": %g,\n",
      kDepthUnit_m, kFlowUnit_px, kTemperatureUnit_C);
  text += "  \"classes\": [";
  for (int k = 0; k < kTruthClasses; ++k) {
    text += Format("%s\"%s\"", k > 0 ? ", " : "", NameOf(static_cast<TruthClass>(k)));
  }
  text += Format(
      "],\n  \"first_tool_instance\": %d,\n  \"first_organ_instance\": %d,\n"
      "  \"first_clip_instance\": %d,\n  \"organs\": [",
      kFirstToolInstance, kFirstOrganInstance, kFirstClipInstance);
  const char* separator = "";
  for (const Solid& solid : solids) {
    if (solid.look == SolidLook::kBowel) continue;
    text += separator + JsonString(solid.name);
    separator = ", ";
  }
  return text + "]\n}\n";
}

FrameState::FrameState(const render::RenderNode& node, const ContactModel& contacts)
    : tools(node.tools().tools), handles(node.handles()) {
  for (std::size_t k = 0; k < kMaxTools; ++k) force_N[k] = TissueForce(contacts.devices[k]).norm();
}

std::string FrameText(std::uint64_t frame, double time_s, const FrameState& state, const SceneView& scene,
                      const Truth& truth) {
  std::string text =
      Format("{\"frame\": %llu, \"time_s\": %.6f, \"world_to_camera\": ", static_cast<unsigned long long>(frame),
             time_s) +
      Matrix(truth.world_to_camera()) + ", " + Intrinsics(truth.camera(), ", ") +
      Format(", \"pedals\": %u, \"tools\": [", state.handles.pedals);
  const char* separator = "";
  for (std::size_t k = 0; k < kMaxTools; ++k) {
    const ToolSample& tool = state.tools[k];
    if (!TouchesTissue(tool.kind)) continue;
    const Eigen::Quaterniond turn = tool.q_WT.cast<double>();
    const Vec3d tip_W = tool.p_WT.cast<double>();
    const float jaw_rad = state.handles.handles[k].jaw_angle_rad;
    text += separator + Format("{\"tool\": %zu, \"instance\": %zu, \"tip_m\": ", k, kFirstToolInstance + k) +
            Vector(tip_W) +
            Format(", \"quaternion_xyzw\": [%.9g, %.9g, %.9g, %.9g]", turn.x(), turn.y(), turn.z(), turn.w()) +
            ", \"trocar_m\": " + Vector(scene.tools[k].p_WP.cast<double>()) +
            Format(", \"jaw_rad\": %.5f, \"force_N\": %.4f, \"keypoints\": [", static_cast<double>(jaw_rad),
                   state.force_N[k]);
    const char* comma = "";
    for (const auto& [name, p_T] : KeypointsOf(scene.tools[k], jaw_rad)) {
      text += comma + KeypointText(name, tip_W + turn * p_T, static_cast<double>(scene.tools[k].shaft_radius_m), truth);
      comma = ", ";
    }
    text += "]}";
    separator = ", ";
  }
  return text + "]}";
}

}  // namespace fulcrum::replay
