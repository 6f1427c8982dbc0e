// Nearest points of segments and triangles.
#include "physics_node/collision/closest.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace fulcrum::physics {
namespace {

TEST(Closest, SegmentAndTriangleAgreeWithASearch) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> coordinate(-1, 1);
  const auto point = [&] { return Vec3f(coordinate(random), coordinate(random), coordinate(random)); };
  constexpr int kGrid = 60;
  for (int trial = 0; trial < 150; ++trial) {
    const Vec3f p0 = point(), p1 = point(), a = point(), b = point(), c = point();
    const ClosestPoints found = ClosestSegmentTriangle(p0, p1, a, b, c);
    float best = 1e9f;
    for (int i = 0; i <= kGrid; ++i) {
      const Vec3f on_segment = p0 + static_cast<float>(i) / kGrid * (p1 - p0);
      const auto w = ClosestOnTriangle(on_segment, a, b, c);
      best = std::min(best, (w[0] * a + w[1] * b + w[2] * c - on_segment).norm());
    }
    const float distance = std::sqrt(found.distance_sq);
    EXPECT_LE(distance, best + 1e-5f);
    EXPECT_GE(distance, best - (p1 - p0).norm() / kGrid);
    const auto& w = found.barycentric;
    EXPECT_NEAR(w[0] + w[1] + w[2], 1.0f, 1e-5f);
    EXPECT_LT((w[0] * a + w[1] * b + w[2] * c - found.on_triangle).norm(), 1e-5f);
    EXPECT_LT((p0 + found.t * (p1 - p0) - found.on_segment).norm(), 1e-5f);
  }
}

TEST(Closest, DegenerateShapesAreFinite) {
  const Vec3f p(1, 2, 3), q(0, 0, 0);
  for (const ClosestPoints& c : {ClosestSegmentTriangle(p, p, q, q, q), ClosestSegmentTriangle(p, q, q, q, p),
                                 ClosestSegmentTriangle(q, q, q, Vec3f(1, 0, 0), Vec3f(2, 0, 0))}) {
    EXPECT_TRUE(std::isfinite(c.distance_sq));
    EXPECT_NEAR(c.barycentric[0] + c.barycentric[1] + c.barycentric[2], 1.0f, 1e-5f);
  }
}

}  // namespace
}  // namespace fulcrum::physics
