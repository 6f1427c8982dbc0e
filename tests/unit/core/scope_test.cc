#include "services/base/core/scope.h"

#include <gtest/gtest.h>

#include <initializer_list>

namespace fulcrum {
namespace {

/// Orientation of a level scope whose shaft has this direction, as the servo makes it.
Quatf LevelAlong(const Vec3f& shaft, float roll_rad = 0) {
  const Vec3f right = shaft.cross(Vec3f::UnitZ()).normalized();
  Mat3f turn;
  turn << right, shaft.cross(right), shaft;
  return Quatf(turn) * Quatf(Eigen::AngleAxisf(roll_rad, Vec3f::UnitZ()));
}

TEST(Scope, AngledOpticsLookBelowTheShaft) {
  const Vec3f shaft = Vec3f(0.2f, 1, -0.3f).normalized();
  for (const float optics_deg : {0.0f, 30.0f, 45.0f}) {
    const Sight sight = SightOf(LevelAlong(shaft), optics_deg);
    EXPECT_NEAR(sight.forward.dot(shaft), std::cos(RadiansOf(optics_deg)), 1e-5f);
    EXPECT_LE(sight.forward.z(), shaft.z() + 1e-6f);
    EXPECT_NEAR(sight.right.z(), 0, 1e-6f) << "level";
    EXPECT_GT(sight.up.z(), 0);
    EXPECT_NEAR(sight.right.cross(sight.up).dot(sight.forward), -1, 1e-5f) << "camera: x right, y up, looking along -z";
  }
}

TEST(Scope, ItsTurnTiltsTheHorizonOfStraightOptics) {
  const Vec3f shaft = Vec3f(0.1f, 1, -0.5f).normalized();
  for (const float roll : {-0.5f, -0.1f, 0.0f, 0.2f, 1.0f}) {
    EXPECT_NEAR(RollOf(SightOf(LevelAlong(shaft, roll), 0), Vec3f::UnitZ()), -roll, 1e-4f)
        << "clockwise from the handle turns the picture the other way";
  }
}

TEST(Scope, TheTipForAPlaceLooksAtIt) {
  const Vec3f pivot(0.01f, -0.14f, 0.16f), place(0.02f, 0.01f, 0.02f);
  for (const float optics_deg : {0.0f, 30.0f, 45.0f}) {
    RenderParams render;
    render.scope_tip_W = {0, -0.1f, 0.05f};
    render.scope_angle_deg = optics_deg;
    const Vec3f tip = TipLookingAt(place, 0.05f, pivot, render);
    EXPECT_NEAR((place - tip).norm(), 0.05f, 1e-5f);
    const Sight sight = SightOf(LevelAlong((tip - pivot).normalized()), optics_deg);
    EXPECT_GT(sight.forward.dot((place - tip).normalized()), 1 - 1e-6f) << optics_deg;
  }
}

TEST(Scope, TheShaftForASceneShowsTheScene) {
  RenderParams render;
  render.scope_tip_W = {0.004f, -0.06f, 0.082f};
  render.scope_target_W = {0, 0.002f, 0.022f};
  for (const float optics_deg : {0.0f, 30.0f}) {
    render.scope_angle_deg = optics_deg;
    const Sight sight = SightOf(LevelAlong(ShaftOf(render)), optics_deg);
    EXPECT_GT(sight.forward.dot((render.scope_target_W - render.scope_tip_W).normalized()), 1 - 1e-6f);
  }
}

TEST(Scope, TheRingZoomsUpToTwice) {
  EXPECT_EQ(ZoomAt(-0.1f), 1);
  EXPECT_EQ(ZoomAt(0), 1);
  EXPECT_FLOAT_EQ(ZoomAt(kZoomRing_rad / 2), 1.5f);
  EXPECT_EQ(ZoomAt(3), 2);
}

}  // namespace
}  // namespace fulcrum
