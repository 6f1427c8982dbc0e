// The narrow phase, eight triangles at a time: against the closest points of one triangle, against a fine search in
// time, and equal bits on every instruction set.
#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <random>
#include <vector>

#include "physics_node/collision/closest.h"
#include "physics_node/collision/kernels.h"
#include "physics_node/collision/tool_shape.h"
#include "tests/unit/physics/kernels_scalar.h"

namespace fulcrum::physics {
namespace {

constexpr float kMm = 0.001f;

std::vector<const collision::Kernels*> VectorKernels() {
  std::vector<const collision::Kernels*> kernels;
  for (const InstructionSet set : kInstructionSets) {
    if (Has(set)) kernels.push_back(&collision::KernelsFor(set));
  }
  return kernels;
}

class Touch : public testing::Test {
 protected:
  /// A random point in a cube of 10 mm.
  Vec3f Point() { return Vec3f(coordinate_(random_), coordinate_(random_), coordinate_(random_)); }
  void MakeTriangles(float size) {
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      const Vec3f middle = Point();
      for (std::size_t corner = 0; corner < 3; ++corner) {
        SetCorner(corner, lane, middle + size * Point());
      }
    }
  }
  void SetCorner(std::size_t corner, std::size_t lane, const Vec3f& x) {
    for (int axis = 0; axis < 3; ++axis) {
      triangles_.corner[corner][axis][lane] = x[axis];
    }
  }
  [[nodiscard]] Vec3f Corner(std::size_t corner, std::size_t lane) const {
    const auto& x = triangles_.corner[corner];
    return {x[0][lane], x[1][lane], x[2][lane]};
  }
  static void Put(const Vec3f& p, float* out) { std::copy_n(p.data(), 3, out); }
  /// A segment that moves from p0-p1 to q0-q1.
  static SegmentMotion Moving(const Vec3f& p0, const Vec3f& p1, const Vec3f& q0, const Vec3f& q1) {
    SegmentMotion motion;
    Put(p0, motion.from[0]);
    Put(p1, motion.from[1]);
    Put(q0, motion.to[0]);
    Put(q1, motion.to[1]);
    return motion;
  }
  /// Runs the search on every instruction set and requires equal bits.
  [[nodiscard]] TouchBatch Look(const SegmentMotion& motion, const TouchSearch& search) const {
    using Bits = std::array<std::uint32_t, sizeof(TouchBatch) / sizeof(std::uint32_t)>;
    TouchBatch oracle{};
    scalar::kCollision.first_touch(motion, search, triangles_, &oracle);
    for (const collision::Kernels* kernels : VectorKernels()) {
      TouchBatch other{};
      kernels->first_touch(motion, search, triangles_, &other);
      EXPECT_EQ(std::bit_cast<Bits>(oracle), std::bit_cast<Bits>(other)) << kernels->name;
    }
    return oracle;
  }

  std::mt19937 random_{11};
  std::uniform_real_distribution<float> coordinate_{-5 * kMm, 5 * kMm};
  TriangleBatch triangles_{};
};

TEST_F(Touch, AtRestTheyAreTheClosestPointsOfEachTriangle) {
  int crossings = 0;
  for (int trial = 0; trial < 500; ++trial) {
    MakeTriangles(trial % 2 == 0 ? 2.0f : 0.2f);
    const Vec3f p0 = Point(), p1 = trial % 10 == 0 ? p0 : Point();
    const TouchBatch touch = Look(Moving(p0, p1, p0, p1), {1, 1, 0, 0, 1, 1, 1});
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      const Vec3f a = Corner(0, lane), b = Corner(1, lane), c = Corner(2, lane);
      const ClosestPoints one = ClosestSegmentTriangle(p0, p1, a, b, c);
      ASSERT_NEAR(std::sqrt(touch.distance_sq[lane]), std::sqrt(one.distance_sq), 1e-6f);
      ASSERT_EQ(touch.crosses[lane] > 0, one.crosses);
      crossings += one.crosses;
      // Where two places are equally near, either is right; therefore only distances are compared.
      const Vec3f on_triangle = touch.weight[0][lane] * a + touch.weight[1][lane] * b + touch.weight[2][lane] * c;
      const Vec3f on_segment = p0 + touch.t[lane] * (p1 - p0);
      ASSERT_NEAR((on_triangle - on_segment).norm(), std::sqrt(one.distance_sq), 2e-6f);
      ASSERT_NEAR(touch.weight[0][lane] + touch.weight[1][lane] + touch.weight[2][lane], 1.0f, 1e-4f);
      ASSERT_GE(std::min({touch.weight[0][lane], touch.weight[1][lane], touch.weight[2][lane]}), -1e-5f);
    }
  }
  EXPECT_GT(crossings, 100);
}

TEST_F(Touch, OnTheWayTheFirstOneCounts) {
  constexpr float kReach = 1 * kMm;
  int touched = 0;
  for (int trial = 0; trial < 200; ++trial) {
    MakeTriangles(0.2f);
    const Vec3f p0 = Point(), p1 = Point(), way = 2.0f * Point();
    const TouchSearch search{0.25f, 1, kReach, way.norm(), 1e-3f, 1, 1};
    const TouchBatch touch = Look(Moving(p0, p1, p0 + way, p1 + way), search);
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      float first = 2, nearest = 1;
      for (float u = search.u0; u <= 1.0f; u += 1.0f / 512) {
        const ClosestPoints at =
            ClosestSegmentTriangle(p0 + u * way, p1 + u * way, Corner(0, lane), Corner(1, lane), Corner(2, lane));
        const float distance = std::sqrt(at.distance_sq);
        nearest = std::min(nearest, distance);
        if (distance <= kReach) {
          first = u;
          break;
        }
      }
      const float found = std::sqrt(touch.distance_sq[lane]);
      if (first < 2) {
        ASSERT_LE(found, kReach);
        ASSERT_NEAR(touch.u[lane], first, 4e-3f);
        ++touched;
      } else {
        ASSERT_GE(found, nearest - way.norm() * 2e-3f);  // The nearest of the evaluated times.
      }
    }
  }
  EXPECT_GT(touched, 100);
}

TEST_F(Touch, WhatIsFarIsLeftAloneAndWhatIsHalfwayIsSeenByItsMiddle) {
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    const Vec3f middle(0, 0, static_cast<float>(lane) * kMm);
    SetCorner(0, lane, middle + Vec3f(0.1f * kMm, 0, 0));
    SetCorner(1, lane, middle + Vec3f(-0.1f * kMm, 0.1f * kMm, 0));
    SetCorner(2, lane, middle + Vec3f(0, -0.1f * kMm, 0));
  }
  const Vec3f p0(-kMm, 0, 0), p1(kMm, 0, 0);
  const TouchBatch touch = Look(Moving(p0, p1, p0, p1), {1, 1, 0, 0, 1, 5.5f * kMm, 2.5f * kMm});
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    if (lane > 5) {
      EXPECT_GT(touch.distance_sq[lane], 1e38f);
    } else {
      EXPECT_NEAR(std::sqrt(touch.distance_sq[lane]), static_cast<float>(lane) * kMm, 1e-5f);
      EXPECT_EQ(touch.weight[0][lane] == touch.weight[1][lane], lane > 2);
    }
  }
}

TEST_F(Touch, DegenerateAndDamagedTrianglesEnd) {
  MakeTriangles(0.2f);
  for (std::size_t corner = 0; corner < 3; ++corner) {
    SetCorner(corner, 1, Vec3f::Zero());
    SetCorner(corner, 2, static_cast<float>(corner) * Vec3f(kMm, 0, 0));
    SetCorner(corner, 3, 1e-12f * Point());
  }
  SetCorner(1, 4, Vec3f::Constant(std::nanf("")));
  SetCorner(2, 5, Vec3f::Constant(3e38f));
  const Vec3f p0(-kMm, 0, kMm), p1(kMm, 0, kMm), way(0, 0, -10 * kMm);
  for (const Vec3f& end : {p1, p0}) {
    const TouchBatch touch = Look(Moving(p0, end, p0 + way, end + way), {0, 1, kMm, way.norm(), 0.04f, 1, 1});
    for (const std::size_t lane : {1u, 2u, 3u}) {
      EXPECT_LE(touch.distance_sq[lane], 1.1f * kMm * kMm);
      EXPECT_NEAR(touch.weight[0][lane] + touch.weight[1][lane] + touch.weight[2][lane], 1.0f, 1e-4f);
    }
    EXPECT_GT(touch.distance_sq[4], 1e38f);
  }
}

TEST_F(Touch, FeetAreTheClosestPointsOfTheTriangles) {
  // Triangles of ten organ vertices, some of them degenerate.
  alignas(32) std::array<float, 40> particles{};
  PointBatch points;
  using Bits = std::array<std::uint32_t, sizeof(FootBatch) / sizeof(std::uint32_t)>;
  std::uniform_int_distribution<std::uint32_t> vertex(0, 9);
  for (int trial = 0; trial < 500; ++trial) {
    for (std::size_t v = 0; v < 10; ++v) {
      Put(Point(), &particles[4 * v]);
    }
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      const Vec3f p = Point();
      for (std::size_t i = 0; i < 3; ++i) {
        points.point[i][lane] = p[static_cast<int>(i)];
        points.corner[i][lane] = 4 * vertex(random_);
      }
    }
    FootBatch oracle{};
    scalar::kCollision.feet(particles.data(), points, &oracle);
    for (const collision::Kernels* kernels : VectorKernels()) {
      FootBatch other{};
      kernels->feet(particles.data(), points, &other);
      ASSERT_EQ(std::bit_cast<Bits>(oracle), std::bit_cast<Bits>(other)) << kernels->name;
    }
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      const auto corner = [&](std::size_t i) { return Vec3f(&particles[points.corner[i][lane]]); };
      const Vec3f p(points.point[0][lane], points.point[1][lane], points.point[2][lane]);
      const Vec3f a = corner(0), b = corner(1), c = corner(2);
      const auto one = ClosestOnTriangle(p, a, b, c);
      const Vec3f offset = p - one[0] * a - one[1] * b - one[2] * c;
      const auto& w = oracle.weight;
      ASSERT_NEAR(std::sqrt(oracle.distance_sq[lane]), offset.norm(), 1e-6f);
      ASSERT_NEAR((p - w[0][lane] * a - w[1][lane] * b - w[2][lane] * c).norm(), offset.norm(), 1e-6f);
      const float side = (b - a).cross(c - a).dot(offset);
      if (std::abs(side) > 1e-12f) {
        ASSERT_EQ(side > 0, oracle.side[lane] > 0);
      }
    }
  }
}

TEST(ToolShape, TheHandleOfASuctionTubeMovesNothing) {
  ToolDescription tube;
  tube.kind = ToolKind::kSuction;
  tube.shaft_radius_m = tube.tip_radius_m = 2.5f * kMm;
  tube.shaft_length_m = 330 * kMm;
  tube.tip_length_m = 18 * kMm;
  for (const float jaw_rad : {0.0f, 0.9f}) {
    const ToolShape shape = ShapeOf(tube, {Vec3f::Zero(), Quatf::Identity(), jaw_rad});
    ASSERT_EQ(shape.count, 2);
    EXPECT_EQ(shape.capsules[0].b, Vec3f(0, 0, 0)) << "the tip";
    EXPECT_EQ(shape.capsules[0].a, shape.capsules[1].a) << "a straight rod";
    EXPECT_EQ(shape.capsules[1].b, Vec3f(0, 0, -330 * kMm));
  }
}

}  // namespace
}  // namespace fulcrum::physics
