#include "render_node/geometry/background_anatomy.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "render_node/geometry/surface.h"
#include "services/base/core/breathing.h"
#include "services/base/core/error.h"
#include "services/scene/builder/build.h"
#include "services/scene/compiler/compile.h"

namespace fulcrum::render {
namespace {

// Distances are interpolated between nodes 12 mm apart, and lines lead to one place of the tissue for each node.
constexpr float kTissueTolerance_m = 0.002f, kLineTolerance_m = 0.004f, kWallTolerance_m = 0.0022f;

float DistanceToLine(const Vec3f& p, const Vec3f& a, const Vec3f& b) {
  const Vec3f ab = b - a;
  return (p - a - std::clamp((p - a).dot(ab) / ab.squaredNorm(), 0.0f, 1.0f) * ab).norm();
}

/// Smallest distances of the decoration [m] to tissue, to lines between it and scope or trocars, to fixed surfaces
/// moved by `shift`.
struct Distances {
  float tissue = 1, lines = 1, walls = 1;
};
Distances DistancesIn(const SceneView& scene, const BackgroundAnatomy& anatomy, const Vec3f& shift = Vec3f::Zero()) {
  Distances least;
  std::vector<Vec3f> origins{scene.render.scope_tip_W};
  for (const ToolDescription& tool : scene.tools) {
    if (tool.kind != ToolKind::kNone) origins.push_back(tool.p_WP);
  }
  float tissue2 = 1;
  for (std::size_t k = 0; k < anatomy.vertices().size(); k += 2) {
    const Vec3f& p = anatomy.vertices()[k].p_W;
    for (const Vec3f& q : scene.rest_position) tissue2 = std::min(tissue2, (p - q).squaredNorm());
    for (std::size_t i = k % 53; i < scene.rest_position.size(); i += 53) {
      for (const Vec3f& origin : origins) {
        least.lines = std::min(least.lines, DistanceToLine(p, origin, scene.rest_position[i]));
      }
    }
  }
  least.tissue = std::sqrt(tissue2);
  for (const StaticSurface& surface : scene.static_surfaces) {
    const bool breathes = Breathes(surface.role);
    std::vector<float> xyz;
    for (const Vec3f& p : scene.static_vertices) xyz.insert(xyz.end(), p.data(), p.data() + 3);
    const NearestOnSurface nearest(scene.static_vertices,
                                   scene.static_triangles.subspan(surface.first_triangle, surface.triangle_count));
    for (const BackgroundAnatomy::Vertex& vertex : anatomy.vertices()) {
      const Vec3f p = vertex.p_W - (breathes ? shift : Vec3f(Vec3f::Zero()));
      least.walls = std::min(least.walls, (nearest.Find(p).At(xyz) - p).norm());
    }
  }
  return least;
}

void ExpectClear(const std::string& name, const SceneView& scene, const BackgroundAnatomy& anatomy) {
  const Distances least = DistancesIn(scene, anatomy);
  EXPECT_GT(least.tissue, FreeSpace::kToTissue_m - kTissueTolerance_m) << name;
  EXPECT_GT(least.lines, FreeSpace::kToLines_m - kLineTolerance_m) << name;
  EXPECT_GT(least.walls, FreeSpace::kToWalls_m - kWallTolerance_m) << name;
  EXPECT_LE(anatomy.triangles().size(), BackgroundAnatomy::kMostTriangles) << name;
  const Cavity& cavity = anatomy.cavity();
  for (const BackgroundAnatomy::Vertex& vertex : anatomy.vertices()) {
    ASSERT_LT((vertex.p_W - cavity.centre).norm(), cavity.radius) << name;
    ASSERT_NEAR(vertex.normal.norm(), 1, 1e-4) << name;
    ASSERT_GE(vertex.openness, 0) << name;
    ASSERT_LE(vertex.openness, 1) << name;
  }
  for (const Triangle& t : anatomy.triangles()) {
    for (const Index corner : t) ASSERT_LT(corner, anatomy.vertices().size()) << name;
  }
}

TEST(BackgroundAnatomy, KeepsClearInEveryShippedScene) {
  for (const auto& entry :
       std::filesystem::directory_iterator(std::filesystem::path(FULCRUM_SOURCE_DIR) / "deploy/scenes")) {
    if (entry.path().extension() != ".yaml") continue;
    const std::string name = entry.path().stem();
    scene::SceneData data;
    try {
      data = scene::CompileScene(entry.path(), {}, {}).data;
    } catch (const InputError&) {
      ASSERT_TRUE(name == "openhelp" || name == "pelvis") << name;  // Their meshes are not part of the project.
      continue;
    }
    const SceneView scene = data.View();
    const BackgroundAnatomy anatomy(scene, 0);
    ExpectClear(name, scene, anatomy);
    EXPECT_GT(anatomy.triangles().size(), 1000u) << name;
  }
}

TEST(BackgroundAnatomy, KeepsClearForAnySeed) {
  const scene::SceneData data = scene::BuildProcedural(scene::BuiltIn());
  const SceneView scene = data.View();
  for (std::uint32_t seed = 1; seed < 6; ++seed) {
    ExpectClear("seed " + std::to_string(seed), scene, BackgroundAnatomy(scene, seed));
  }
}

TEST(BackgroundAnatomy, IsTheSameForTheSameSeedOnly) {
  const scene::SceneData data = scene::BuildProcedural(scene::Small());
  const BackgroundAnatomy one(data.View(), 3), same(data.View(), 3), other(data.View(), 4);
  const auto place = [](const BackgroundAnatomy::Vertex& vertex) { return vertex.p_W; };
  EXPECT_TRUE(std::ranges::equal(one.vertices(), same.vertices(), {}, place, place));
  EXPECT_EQ(one.triangles(), same.triangles());
  EXPECT_FALSE(std::ranges::equal(one.vertices(), other.vertices(), {}, place, place));
}

TEST(BackgroundAnatomy, KeepsClearOfABreathingWall) {
  scene::SceneData data = scene::BuildProcedural(scene::BuiltIn());
  data.fixed.breathing.amplitude_m = 0.012f;
  data.fixed.breathing.direction = Vec3f(0, 0, -1);  // Inwards.
  const SceneView scene = data.View();
  const BackgroundAnatomy anatomy(scene, 0);
  EXPECT_GT(anatomy.triangles().size(), 1000u);
  for (const float share : {0.0f, 0.5f, 1.0f}) {
    const Vec3f shift = share * scene.breathing.amplitude_m * scene.breathing.direction;
    EXPECT_GT(DistancesIn(scene, anatomy, shift).walls, FreeSpace::kToWalls_m - kWallTolerance_m) << share;
  }
}

TEST(BackgroundAnatomy, TissueInTheWayLeavesNoRoom) {
  scene::SceneData data = scene::BuildProcedural(scene::Small());
  const SceneView free = data.View();
  const BackgroundAnatomy before(free, 0);
  ASSERT_FALSE(before.vertices().empty());
  // A particle where a loop was: the loop goes elsewhere.
  const Vec3f taken = before.vertices().front().p_W;
  data.rest_position.back() = taken;
  const SceneView scene = data.View();
  const BackgroundAnatomy after(scene, 0);
  for (const BackgroundAnatomy::Vertex& vertex : after.vertices()) {
    ASSERT_GT((vertex.p_W - taken).norm(), FreeSpace::kToTissue_m - kTissueTolerance_m);
  }
}

TEST(BackgroundAnatomy, IsDarkerWhereALoopIsNear) {
  const scene::SceneData data = scene::BuildProcedural(scene::BuiltIn());
  const BackgroundAnatomy anatomy(data.View(), 0);
  const BackgroundAnatomy::Vertex& vertex = anatomy.vertices()[anatomy.vertices().size() / 2];
  EXPECT_LT(anatomy.Openness(vertex.p_W + 0.003f * vertex.normal, -vertex.normal), 0.5f) << "towards the loop";
  EXPECT_FLOAT_EQ(anatomy.Openness(Vec3f(10, 0, 0), Vec3f::UnitX()), 1) << "far from all";
}

TEST(GridField, IsTheDistanceToThePoints) {
  GridField field(Vec3f::Zero(), 0.1f, 0.01f, 1);
  const std::vector<Eigen::Vector4f> points{{0.02f, 0.01f, -0.03f, 0}, {-0.05f, 0.02f, 0.04f, 0.01f}};
  field.LowerAll(points);
  for (const Vec3f& p : {Vec3f(0, 0, 0), Vec3f(0.05f, -0.04f, 0.03f), Vec3f(-0.06f, 0.06f, 0.06f)}) {
    float expected = 1;
    for (const Eigen::Vector4f& point : points) expected = std::min(expected, (point.head<3>() - p).norm() - point.w());
    EXPECT_NEAR(field.At(p, -1), expected, 0.002f) << p.transpose();
  }
  EXPECT_EQ(field.At(Vec3f(0.2f, 0, 0), -1), -1);
}

}  // namespace
}  // namespace fulcrum::render
