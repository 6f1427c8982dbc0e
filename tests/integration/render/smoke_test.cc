#include "render_node/scene_graph/smoke.h"

#include <gtest/gtest.h>

namespace fulcrum::render {
namespace {

constexpr double kAPuff_s = 0.1;

TEST(SmokeTest, GathersAsHazeAndClears) {
  Smoke smoke;
  EXPECT_EQ(smoke.HazeAt(0), 0);
  float before = 0;
  for (int k = 0; k < 400; ++k) {
    smoke.Add(Vec3f::Zero(), kAPuff_s * k);
    const float haze = smoke.HazeAt(kAPuff_s * k);
    EXPECT_GE(haze, before);
    EXPECT_LE(haze, 0.25f);
    before = haze;
  }
  EXPECT_GT(before, 0.2f);
  EXPECT_LT(smoke.HazeAt(46), 0.6f * before);
  EXPECT_EQ(smoke.HazeAt(80), 0);
}

TEST(SmokeTest, HazeDoesNotDependOnThePicturesBetween) {
  Smoke drawn, asked;
  for (int k = 0; k < 50; ++k) {
    drawn.Add(Vec3f::Zero(), kAPuff_s * k);
    asked.Add(Vec3f::Zero(), kAPuff_s * k);
    drawn.Update(kAPuff_s * k + 0.05);
  }
  EXPECT_EQ(drawn.HazeAt(7), asked.HazeAt(7));
}

TEST(SmokeTest, HazeChangesInStepsSoThatFewPicturesFollow) {
  Smoke smoke;
  for (int k = 0; k < 100; ++k) smoke.Add(Vec3f::Zero(), kAPuff_s * k);
  int steps = 0;
  for (int k = 0; k < 3000; ++k) steps += smoke.HazeAt(10 + 0.01 * k) != smoke.HazeAt(10.01 + 0.01 * k) ? 1 : 0;
  EXPECT_LE(steps, 16);
}

TEST(SmokeTest, SuctionClearsTheHazeInThreeFifthsOfTheTime) {
  Smoke left, drawn;
  const Vec3f sink(1, 0, 0);  // Far from the puffs.
  for (int k = 0; k < 100; ++k) {
    left.Add(Vec3f::Zero(), kAPuff_s * k);
    drawn.Add(Vec3f::Zero(), kAPuff_s * k);
  }
  drawn.SetSinks({&sink, 1}, 10);
  EXPECT_EQ(drawn.HazeAt(10), left.HazeAt(10));
  // 20 l/min through 3 l is a time constant of 9 s, beside that of 6 s.
  EXPECT_NEAR(drawn.HazeAt(10 + 3.6), left.HazeAt(10 + 6), 1.01f / 64);
  drawn.SetSinks({}, 13.6);
  EXPECT_NEAR(drawn.HazeAt(13.6 + 4), left.HazeAt(16 + 4), 1.01f / 64);
}

TEST(SmokeTest, APuffIsDrawnIntoTheTubeHoweverOftenItIsShown) {
  const auto squares = [](double step_s, bool sucks) {
    Smoke smoke;
    smoke.Add(Vec3f::Zero(), 1.0);
    smoke.Update(1.0);
    const Vec3f sink(0, 0.012f, 0.004f);
    if (sucks) smoke.SetSinks({&sink, 1}, 1.0);
    bool visible = true;
    for (int k = 1; k * step_s < 1.0001; ++k) {
      smoke.Update(1.0 + k * step_s);
      visible =
          smoke.geometry()->getNumPrimitiveSets() > 0 && smoke.geometry()->getPrimitiveSet(0)->getNumIndices() > 0;
    }
    return visible;
  };
  EXPECT_TRUE(squares(0.1, false));
  EXPECT_FALSE(squares(0.1, true));
  EXPECT_FALSE(squares(0.5, true));
}

}  // namespace
}  // namespace fulcrum::render
