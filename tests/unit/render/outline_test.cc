#include "render_node/geometry/outline.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "render_node/geometry/laparoscope.h"
#include "render_node/geometry/solid.h"

namespace fulcrum::render {
namespace {

/// A box with corners of its own for each face, as drawn with flat normals.
Solid Box(float half) {
  std::vector<std::vector<Vec3f>> outlines;
  for (const float z : {-half, half})
    outlines.push_back({{-half, -half, z}, {half, -half, z}, {half, half, z}, {-half, half, z}});
  Solid box;
  AppendLoft(outlines, {1, 1, 1, 1}, &box);
  return box;
}

class OutlineTest : public testing::Test {
 protected:
  OutlineTest() {
    params_.width = 400;
    params_.height = 400;
    params_.fov_deg = 60;
    params_.scope_tip_W = Vec3f(0, 0, 0.1f);
    params_.scope_target_W = Vec3f::Zero();
  }

  std::vector<EdgeLine> Lines(const Solid& solid) const {
    const Laparoscope scope = MakeLaparoscope(params_);
    std::vector<EdgeLine> lines;
    AppendOutline(MeshEdges(solid.positions, solid.triangles), scope.view, scope.projection, Vec2f(400, 400), &lines);
    return lines;
  }

  static std::vector<EdgeLine> Outer(const std::vector<EdgeLine>& lines) {
    std::vector<EdgeLine> outer;
    std::ranges::copy_if(lines, std::back_inserter(outer), [](const EdgeLine& line) { return !line.crease; });
    return outer;
  }

  RenderParams params_;
};

TEST_F(OutlineTest, CoverageIsTheAreaOfThePixelInside) {
  for (const float degrees : {0.0f, 7.0f, 26.6f, 45.0f, 80.0f, 90.0f, 133.0f, 250.0f}) {
    const float angle = degrees * 0.017453293f;
    const Vec2f normal(std::cos(angle), std::sin(angle));
    for (float distance = -0.9f; distance <= 0.9f; distance += 0.15f) {
      constexpr int kSamples = 200;
      int inside = 0;
      for (int k = 0; k < kSamples * kSamples; ++k) {
        const Vec2f at(static_cast<float>(k % kSamples) + 0.5f, static_cast<float>(k / kSamples) + 0.5f);
        if (normal.dot(at / kSamples - Vec2f(0.5f, 0.5f)) + distance <= 0) ++inside;
      }
      EXPECT_NEAR(Coverage(normal, distance), static_cast<float>(inside) / (kSamples * kSamples), 0.006f)
          << degrees << " degrees, " << distance;
    }
  }
}

TEST_F(OutlineTest, ABoxSeenFromTheFrontEndsAtItsFrontFace) {
  constexpr float kHalf = 0.01f;
  const std::vector<EdgeLine> outer = Outer(Lines(Box(kHalf)));
  ASSERT_EQ(outer.size(), 4u);
  const float reach = 200 / std::tan(0.5235988f) * kHalf / (0.1f - kHalf);  // [pixels]
  for (const EdgeLine& line : outer) {
    const Vec2f middle = 0.5f * (line.ends[0] + line.ends[1]) - Vec2f(200, 200);
    EXPECT_NEAR(middle.norm(), reach, 0.01f);
    EXPECT_NEAR(line.outward.dot(middle.normalized()), 1, 1e-4f);
    EXPECT_NEAR(line.depths[0], 0.09f, 1e-6f);
  }
}

TEST_F(OutlineTest, ADiagonalViewShowsSixEdgesOfTheOutlineAndTheCreasesBetween) {
  params_.scope_tip_W = Vec3f(0.06f, 0.05f, 0.07f);
  const std::vector<EdgeLine> lines = Lines(Box(0.01f));
  EXPECT_EQ(Outer(lines).size(), 6u);
  EXPECT_EQ(lines.size(), 12u) << "three creases in front and three that the box itself hides; no diagonal of a face";
}

TEST_F(OutlineTest, ASmoothTubeHasNoCreasesAlongIt) {
  Solid tube;
  const std::array<Vec3f, 2> path{Vec3f(-0.02f, 0, 0), Vec3f(0.02f, 0, 0)};
  const std::array<float, 2> radii{0.004f, 0.004f};
  AppendTube(path, radii, 24, {1, 1, 1, 1}, &tube);
  float highest = 0;
  int along = 0;
  for (const EdgeLine& line : Lines(tube)) {
    if (std::abs(line.ends[1].x() - line.ends[0].x()) < 20) continue;  // Of a cap.
    EXPECT_FALSE(line.crease);
    highest = std::max(highest, line.ends[0].y());
    ++along;
  }
  EXPECT_EQ(along, 2) << "one above, one below";
  EXPECT_NEAR(highest - 200, 200 / std::tan(0.5235988f) * 0.04f, 0.3f) << "a little more than radius / distance";
}

TEST_F(OutlineTest, WhatIsBehindTheLensOrOutsideThePictureIsLeftOut) {
  params_.scope_tip_W = Vec3f(0, 0, -0.03f);
  params_.scope_target_W = Vec3f(0, 0, -0.1f);
  EXPECT_TRUE(Lines(Box(0.01f)).empty()) << "behind";
  params_.scope_target_W = Vec3f(0, 0, 0);
  params_.scope_tip_W = Vec3f(0.2f, 0, 0.1f);
  params_.scope_target_W = Vec3f(0.2f, 0, 0);
  EXPECT_TRUE(Lines(Box(0.01f)).empty()) << "beside";
  params_.scope_tip_W = Vec3f(0.012f, 0.002f, 0);
  params_.scope_target_W = Vec3f(0.012f, 0.002f, 0.1f);
  const std::vector<EdgeLine> cut = Lines(Box(0.01f));
  EXPECT_FALSE(cut.empty());
  for (const EdgeLine& line : cut) {
    for (std::size_t k = 0; k < 2; ++k) {
      EXPECT_TRUE(line.ends.at(k).allFinite());
      EXPECT_GE(line.depths.at(k), 0.00399f);
    }
  }
}

}  // namespace
}  // namespace fulcrum::render
