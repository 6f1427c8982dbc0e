#include "render_node/geometry/surface.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "services/scene/builder/build.h"
#include "tests/unit/render/interleaved.h"

namespace fulcrum::render {
namespace {

// Single precision over coordinates of 0.1 m.
constexpr float kRounding_m = 1e-6f;

class SmallScene : public testing::Test {
 protected:
  const scene::SceneData data_ = scene::BuildProcedural(scene::Small());
  const SceneView view_ = data_.View();
};

using EmbeddingTest = SmallScene;

TEST_F(EmbeddingTest, FollowsAnyAffineMapExactly) {
  std::vector<Vec3f> rest(view_.surface_vertices.size()), moved(rest.size());
  MapEmbedded(view_.tets, view_.surface_vertices, Interleaved(view_.rest_position), rest);
  Mat3f a;
  a << 1.1f, 0.2f, -0.1f, 0.05f, 0.9f, 0.3f, -0.2f, 0.1f, 1.2f;
  const Vec3f b(0.02f, -0.01f, 0.03f);
  std::vector<Vec3f> particles(view_.rest_position.begin(), view_.rest_position.end());
  for (Vec3f& p : particles) {
    p = a * p + b;
  }
  MapEmbedded(view_.tets, view_.surface_vertices, Interleaved(particles), moved);
  float worst = 0;
  for (std::size_t k = 0; k < rest.size(); ++k) {
    worst = std::max(worst, (moved[k] - (a * rest[k] + b)).norm());
  }
  EXPECT_LT(worst, kRounding_m);
}

TEST_F(EmbeddingTest, LiesOnTheCoarseSurfaceWithinItsRoughness) {
  std::vector<Vec3f> rest(view_.surface_vertices.size());
  const std::vector<float> xyz = Interleaved(view_.rest_position);
  MapEmbedded(view_.tets, view_.surface_vertices, xyz, rest);
  const NearestOnSurface nearest(view_.rest_position, view_.tube_surface);
  // Ten segments round a radius of 10 mm: the chord lies 0.5 mm inside the arc, and folds add as much again.
  constexpr float kChord_m = 0.0015f;
  for (const Vec3f& p : rest) {
    EXPECT_LT((nearest.Find(p).At(xyz) - p).norm(), kChord_m);
  }
}

TEST_F(EmbeddingTest, NormalsAreUnitAndCloseOverAClosedSurface) {
  std::vector<Vec3f> positions(view_.rest_position.begin(), view_.rest_position.end()), normals(positions.size());
  ComputeNormals(positions, view_.tube_surface, normals);
  for (const Triangle& t : view_.tube_surface) {
    const Vec3f area = (positions[t[1]] - positions[t[0]]).cross(positions[t[2]] - positions[t[0]]);
    for (const Index corner : t) {
      EXPECT_NEAR(normals[corner].norm(), 1, 1e-5f);
    }
    EXPECT_GT(area.dot(normals[t[0]] + normals[t[1]] + normals[t[2]]), 0);
  }
}

TEST_F(EmbeddingTest, NearestPointEqualsBruteForceCloseToTheSurface) {
  const NearestOnSurface nearest(view_.rest_position, view_.tube_surface);
  const std::vector<float> xyz = Interleaved(view_.rest_position);
  for (Index node = 0; node < view_.membrane.node_count(); node += 37) {
    const Vec3f p = view_.rest_position[view_.membrane.first + node];
    float brute = std::numeric_limits<float>::max();
    for (const Triangle& t : view_.tube_surface) {
      const SurfacePoint point{
          t, NearestBarycentric(p, view_.rest_position[t[0]], view_.rest_position[t[1]], view_.rest_position[t[2]])};
      brute = std::min(brute, (point.At(xyz) - p).norm());
    }
    EXPECT_NEAR((nearest.Find(p).At(xyz) - p).norm(), brute, 1e-4f);
  }
}

TEST(NearestBarycentricTest, IsNoFartherThanAnySampleOfTheTriangle) {
  std::mt19937 engine(3);
  const auto random = [&engine] {
    const auto next = [&engine] { return static_cast<float>(engine() >> 8) * 0x1p-23f - 1; };
    const float x = next(), y = next(), z = next();
    return Vec3f(x, y, z);
  };
  for (int trial = 0; trial < 200; ++trial) {
    const Vec3f a = random(), b = random(), c = random(), p = 2 * random();
    const auto w = NearestBarycentric(p, a, b, c);
    EXPECT_NEAR(w[0] + w[1] + w[2], 1, 1e-5f);
    const float found = (w[0] * a + w[1] * b + w[2] * c - p).norm();
    for (int i = 0; i <= 12; ++i) {
      for (int j = 0; i + j <= 12; ++j) {
        const float u = static_cast<float>(i) / 12, v = static_cast<float>(j) / 12;
        EXPECT_LE(found, (a + u * (b - a) + v * (c - a) - p).norm() + 1e-5f);
      }
    }
  }
}

}  // namespace
}  // namespace fulcrum::render
