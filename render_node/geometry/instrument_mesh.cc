#include "render_node/geometry/instrument_mesh.h"

#include <cmath>

namespace fulcrum::render {
namespace {

constexpr float kCreaseCosine = 0.766f;  // Of 40 degrees.
constexpr Colour kSteel{0.52f, 0.53f, 0.55f, 1.0f};
constexpr Colour kInsulation{0.012f, 0.012f, 0.014f, 0.25f};
// Steel begins this far behind the hinge, as on the instruments of geometry/solid.cc, or behind the hook's heel.
constexpr float kBehindHinge = 0.008f;  // [m]

}  // namespace

Solid InstrumentSolid(const SceneView& scene, const ToolMesh& mesh) {
  const ToolDescription& tool = scene.tools[mesh.tool];
  const float steel_from_z = tool.kind == ToolKind::kHook      ? -kHookNeck
                             : tool.kind == ToolKind::kSuction ? -tool.shaft_length_m
                                                               : -tool.tip_length_m - kBehindHinge;
  const auto triangles = scene.tool_triangles.subspan(mesh.first_triangle, mesh.triangle_count);
  std::vector<Vec3f> areas;  // Normals times twice the area, so that vertex normals are weighted by area.
  std::vector<std::vector<Index>> faces(mesh.vertex_count);
  for (Index k = 0; k < mesh.triangle_count; ++k) {
    const auto& [a, b, c] = triangles[k];
    const Vec3f& p = scene.tool_vertices[a];
    areas.emplace_back((scene.tool_vertices[b] - p).cross(scene.tool_vertices[c] - p));
    for (const Index corner : triangles[k]) {
      faces[corner - mesh.first_vertex].push_back(k);
    }
  }
  Solid solid;
  for (Index k = 0; k < mesh.triangle_count; ++k) {
    const float own = areas[k].norm();
    if (!(own > 0)) {
      continue;
    }
    float middle_z = 0;
    for (const Index corner : triangles[k]) {
      middle_z += scene.tool_vertices[corner].z() / 3;
    }
    const auto first = static_cast<Index>(solid.positions.size());
    for (const Index corner : triangles[k]) {
      Vec3f normal = Vec3f::Zero();
      for (const Index other : faces[corner - mesh.first_vertex]) {
        if (areas[other].dot(areas[k]) >= kCreaseCosine * areas[other].norm() * own) {
          normal += areas[other];
        }
      }
      solid.positions.push_back(scene.tool_vertices[corner]);
      solid.normals.push_back(normal.normalized());
      solid.colours.push_back(middle_z > steel_from_z ? kSteel : kInsulation);
    }
    solid.triangles.push_back({first, first + 1, first + 2});
  }
  return solid;
}

}  // namespace fulcrum::render
