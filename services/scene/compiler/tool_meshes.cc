#include "services/scene/compiler/tool_meshes.h"

#include <algorithm>
#include <cmath>

#include "services/base/core/error.h"
#include "services/scene/readers/mesh_io.h"

namespace fulcrum::scene {
namespace {

constexpr std::size_t kMostTriangles = 20000;  ///< Per part: more than the picture can show.
constexpr double kFarthest_m = 1.0;            ///< Distance from the tip: no instrument is longer.

void AddPart(const std::filesystem::path& file, const ToolMeshSettings& settings, std::uint32_t tool, ToolPart part,
             SceneData* scene) {
  const TriangleMesh mesh = SurfaceOf(ReadMesh(file));
  if (mesh.triangles.size() > kMostTriangles) {
    throw InputError(file.string() + ": " + std::to_string(mesh.triangles.size()) +
                     " triangles; valid for a part of an instrument: at most " + std::to_string(kMostTriangles));
  }
  ToolMesh entry{tool,
                 part,
                 static_cast<Index>(scene->tool_vertices.size()),
                 static_cast<Index>(mesh.vertices.size()),
                 static_cast<Index>(scene->tool_triangles.size()),
                 static_cast<Index>(mesh.triangles.size())};
  const Eigen::AngleAxisd turn(settings.turn_rad, Vec3d::UnitZ());
  double farthest_m = 0;
  for (const Vec3d& p : mesh.vertices) {
    const Vec3d p_T = turn * (settings.scale_m * p) + settings.origin_m.cast<double>();
    farthest_m = std::max(farthest_m, p_T.norm());
    scene->tool_vertices.push_back(p_T.cast<float>());
  }
  if (!(farthest_m <= kFarthest_m)) {
    throw InputError(file.string() + ": reaches " + std::to_string(farthest_m) +
                     " m from the tip; valid: at most 1 m (is `unit` right?)");
  }
  for (const Triangle& t : mesh.triangles) {
    scene->tool_triangles.push_back({t[0] + entry.first_vertex, t[1] + entry.first_vertex, t[2] + entry.first_vertex});
  }
  scene->tool_meshes.push_back(entry);
}

}  // namespace

void AddToolMeshes(const SceneSettings& settings, SceneData* scene) {
  for (std::uint32_t tool = 0; tool < kMaxTools; ++tool) {
    const ToolMeshSettings& meshes = settings.tool_meshes[tool];
    if (meshes.body_file.empty()) {
      continue;
    }
    AddPart(meshes.body_file, meshes, tool, ToolPart::kBody, scene);
    if (meshes.jaw_files.size() == 2) {
      AddPart(meshes.jaw_files[0], meshes, tool, ToolPart::kJawPlus, scene);
      AddPart(meshes.jaw_files[1], meshes, tool, ToolPart::kJawMinus, scene);
    }
  }
  scene->fixed.hash = ContentHash(scene->View());
}

}  // namespace fulcrum::scene
