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

}  // namespace
}  // namespace fulcrum::render
