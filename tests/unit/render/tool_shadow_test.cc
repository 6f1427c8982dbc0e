#include "render_node/geometry/tool_shadow.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace fulcrum::render {
namespace {

/// A level sheet 100 mm below a scope that looks straight down, and a grasper that points to the left above it.
class ToolShadowTest : public testing::Test {
 protected:
  ToolShadowTest() {
    for (float x = -0.09f; x < 0.09f; x += 0.001f) {
      for (float y = -0.06f; y < 0.06f; y += 0.001f) {
        xyz_.insert(xyz_.end(), {x, y, 0.0f});
      }
    }
    scene_.render.scope_tip_W = Vec3f(0, 0, 0.1f);
    scene_.render.scope_target_W = Vec3f::Zero();
    scene_.render.scope_angle_deg = 0;
    scene_.tools[0] = {ToolKind::kGrasper, Vec3f::Zero(), 0.0025f, 0.33f, 0.0015f, 0.02f};
  }

  std::array<ToolSample, kMaxTools> GrasperAt(float height_m) const {
    std::array<ToolSample, kMaxTools> tools{};
    tools[0].kind = ToolKind::kGrasper;
    tools[0].p_WT = Vec3f(-0.03f, 0, height_m);
    tools[0].q_WT = Quatf::FromTwoVectors(Vec3f::UnitZ(), -Vec3f::UnitX());
    return tools;
  }

  ToolShadow Cast(float height_m) const {
    ToolShadow shadow(scene_);
    shadow.Update(MakeLaparoscope(scene_.render), xyz_, GrasperAt(height_m));
    return shadow;
  }

  static float Darkest(const ToolShadow& shadow) {
    float darkest = 0;
    for (const auto& c : shadow.coordinates()) {
      darkest = std::max(darkest, c[2]);
    }
    return darkest;
  }
  /// Middle of the pair of vertices in the middle of the ribbon.
  static Vec3f Middle(const ToolShadow& shadow) {
    const std::size_t k = shadow.positions().size() / 4 * 2;
    return 0.5f * (shadow.positions()[k] + shadow.positions()[k + 1]);
  }
  static float Width(const ToolShadow& shadow) {
    const std::size_t k = shadow.positions().size() / 4 * 2;
    return (shadow.positions()[k] - shadow.positions()[k + 1]).norm();
  }

  SceneView scene_;
  std::vector<float> xyz_;
};

TEST_F(ToolShadowTest, NothingCastsNoShadow) {
  ToolShadow shadow(scene_);
  shadow.Update(MakeLaparoscope(scene_.render), xyz_, std::array<ToolSample, kMaxTools>{});
  EXPECT_TRUE(shadow.triangles().empty());
}

TEST_F(ToolShadowTest, LiesOnTheTissueBesideWhatCastsIt) {
  const ToolShadow shadow = Cast(0.015f);
  ASSERT_FALSE(shadow.triangles().empty());
  const Laparoscope scope = MakeLaparoscope(scene_.render);
  const Vec3f light =
      scope.view.block<3, 3>(0, 0).transpose() * (ToolShadow::LightPlace(scope) - scope.view.block<3, 1>(0, 3));
  for (std::size_t k = 2; k < shadow.positions().size(); ++k) {
    if (shadow.coordinates()[k][2] > 0) {
      EXPECT_NEAR(shadow.positions()[k].z(), 0, 5e-4f);
    }
  }
  // The shadow is displaced away from the light in proportion to the height.
  EXPECT_NEAR(Middle(shadow).y(), -light.y() * 0.015f / (light.z() - 0.015f), 3e-4f);
}

TEST_F(ToolShadowTest, GrowsWiderSofterAndPalerWithTheHeight) {
  const ToolShadow low = Cast(0.006f), high = Cast(0.03f);
  EXPECT_GT(Darkest(low), 0.4f);
  EXPECT_LT(Darkest(high), Darkest(low));
  EXPECT_GT(Width(high), 1.2f * Width(low));
  const std::size_t middle = low.positions().size() / 4 * 2;
  EXPECT_GT(high.coordinates()[middle][1], low.coordinates()[middle][1]);
}

TEST_F(ToolShadowTest, IsNeverDrawnInFrontOfTheInstrument) {
  for (const float height_m : {0.003f, 0.01f, 0.03f}) {
    const ToolShadow shadow = Cast(height_m);
    for (const auto& c : shadow.coordinates()) {
      EXPECT_LT(c[3], height_m);
    }
  }
}

TEST_F(ToolShadowTest, ThereIsNoneWithoutTissueBelowNorInside) {
  EXPECT_EQ(Darkest(Cast(-0.01f)), 0);
  xyz_.clear();
  EXPECT_EQ(Darkest(Cast(0.015f)), 0);
}

}  // namespace
}  // namespace fulcrum::render
