// Eq. 15 as printed. The numbers are the paper's, not those of the code.
#include "render_node/geometry/paper_colour.h"

#include <gtest/gtest.h>

namespace fulcrum::render {
namespace {

using Rgba = Eigen::Vector4f;

const Rgba kTissue(0.8f, 0.4f, 0.2f, 0.5f);

float Celsius(float v) { return 37 + 63 * v; }

TEST(PaperEquation15, VIsTheShareOfTheWayToVaporisation) {
  const PaperColour colour;
  EXPECT_EQ(colour.Share(37), 0);
  EXPECT_NEAR(colour.Share(68.5f), 0.5f, 1e-6f);
  EXPECT_EQ(colour.Share(150), 1);
}

TEST(PaperEquation15, BrownUpTo095) {
  for (const float v : {0.0f, 0.5f, 0.9499f}) {
    const Rgba expected = (1 - v) * kTissue + v * Rgba(0.5f, 0.16f, 0.16f, 0.7f);
    EXPECT_LT((PaperColour{}.Mix(kTissue, Celsius(v)) - expected).norm(), 1e-4f) << v;
  }
}

TEST(PaperEquation15, InvisibleWhiteAbove095) {
  for (const float v : {0.9501f, 0.98f, 0.99f, 1.0f}) {
    const Rgba expected = (1 - v) * kTissue + v * Rgba(1, 1, 1, 0);
    EXPECT_LT((PaperColour{}.Mix(kTissue, Celsius(v)) - expected).norm(), 1e-4f) << v;
  }
}

/// C1 and C2 are printed equal, so the threshold between them shows only when one of them is changed.
TEST(PaperEquation15, C1BeginsAt0988) {
  PaperColour colour;
  colour.c1 = Rgba(0, 0, 0, 1);
  EXPECT_GT(colour.Mix(kTissue, Celsius(0.9879f)).x(), 0.9f);
  EXPECT_LT(colour.Mix(kTissue, Celsius(0.9881f)).x(), 0.1f);
}

}  // namespace
}  // namespace fulcrum::render
