// Where a clip holds a sheet: known answers on a flat sheet and on a fold.
#include "render_node/geometry/clip_footprint.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <vector>

#include "services/scene/builder/build.h"

namespace fulcrum::render {
namespace {

constexpr float kLength = 0.012f;  // Of the clip: several cells of the sheet [m].

class ClipFootprintTest : public testing::Test {
 protected:
  ClipFootprintTest() : data_(scene::BuildProcedural(scene::Small())), view_(data_.View()) {
    const Index row = view_.membrane.rows / 2, col = view_.membrane.cols / 2;
    node_ = row * view_.membrane.cols + col;
    middle_ = view_.membrane_material[node_];
    for (std::size_t k = 0; k < 3; ++k) {
      clip_.anchors[k] = view_.membrane.first + node_ + static_cast<Index>(k == 2 ? view_.membrane.cols : k);
    }
    clip_.length_m = kLength;
  }
  /// The sheet at `place` of its own coordinates, all else far away.
  [[nodiscard]] std::vector<float> Placed(const std::function<Vec3f(const Vec2f&)>& place) const {
    std::vector<float> xyz(3 * view_.rest_position.size(), 1.0f);
    for (Index k = 0; k < view_.membrane_material.size(); ++k) {
      Vec3f::Map(&xyz[3 * std::size_t{view_.membrane.first + k}]) = place(view_.membrane_material[k]);
    }
    return xyz;
  }
  /// Largest distance of neighbouring nodes [m].
  [[nodiscard]] float Cell() const {
    const Vec2f& across = view_.membrane_material[node_ + 1];
    const Vec2f& along = view_.membrane_material[node_ + view_.membrane.cols];
    return std::max((across - middle_).norm(), (along - middle_).norm());
  }

  const scene::SceneData data_;
  const SceneView view_;
  Index node_ = 0;
  Vec2f middle_ = Vec2f::Zero();
  Clip clip_;
};

TEST_F(ClipFootprintTest, OnAFlatSheetIsTheLineOfTheLegs) {
  const std::vector<float> xyz = Placed([](const Vec2f& m) { return Vec3f(m.x(), m.y(), 0); });
  for (const Vec2f& along : {Vec2f(1, 0), Vec2f(0, 1)}) {
    const Quatf turn = Quatf::FromTwoVectors(Vec3f::UnitZ(), Vec3f(along.x(), along.y(), 0));
    const auto line = FootprintOf(clip_, {Vec3f(middle_.x(), middle_.y(), 0), turn}, view_, xyz);
    ASSERT_TRUE(line);
    const Vec2f between = line->to - line->from;
    EXPECT_GT(std::abs(between.normalized().dot(along)), 0.99f);
    EXPECT_LT((0.5f * (line->from + line->to) - middle_).norm(), 0.6f * Cell());
    EXPECT_LT(between.norm(), kLength + 0.0024f);
    EXPECT_GT(between.norm(), kLength - 2 * Cell());
  }
}

TEST_F(ClipFootprintTest, OnAFoldRunsOverItsCrest) {
  // Both flanks hang down from the crest at t of the middle, 0.2 mm apart; the clip reaches over it from above.
  const std::vector<float> xyz = Placed([&](const Vec2f& m) {
    const float t = m.y() - middle_.y();
    return Vec3f(m.x(), std::copysign(1e-4f, t), -std::abs(t));
  });
  const Quatf down(0, 1, 0, 0);
  const auto line = FootprintOf(clip_, {Vec3f(middle_.x(), 0, -0.5f * kLength), down}, view_, xyz);
  ASSERT_TRUE(line);
  const Vec2f between = line->to - line->from;
  EXPECT_GT(std::abs(between.normalized().y()), 0.99f);
  EXPECT_LT((0.5f * (line->from + line->to) - middle_).norm(), 0.6f * Cell());
  EXPECT_GT(between.norm(), 2 * (kLength - Cell())) << "down both flanks";
}

TEST_F(ClipFootprintTest, WithoutNodesBetweenTheLegsIsAcrossTheAnchors) {
  std::vector<float> xyz =
      Placed([](const Vec2f&) { return Vec3f::Constant(std::numeric_limits<float>::quiet_NaN()); });
  const ClipPose pose{Vec3f::Zero(), Quatf::Identity()};
  const auto line = FootprintOf(clip_, pose, view_, xyz);
  ASSERT_TRUE(line);
  EXPECT_EQ(line->from, view_.membrane_material[node_ + 1]);
  EXPECT_EQ(line->to, view_.membrane_material[node_ + view_.membrane.cols]);
  clip_.anchors[1] = 0;
  EXPECT_FALSE(FootprintOf(clip_, pose, view_, xyz)) << "on a solid";
}

}  // namespace
}  // namespace fulcrum::render
