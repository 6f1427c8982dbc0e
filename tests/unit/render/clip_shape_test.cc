// Shapes of the clip and of the clip applier's jaw.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "render_node/geometry/solid.h"

namespace fulcrum::render {
namespace {

Vec3f Low(const Solid& solid) {
  Vec3f low = solid.positions.front();
  for (const Vec3f& p : solid.positions) low = low.cwiseMin(p);
  return low;
}
Vec3f High(const Solid& solid) {
  Vec3f high = solid.positions.front();
  for (const Vec3f& p : solid.positions) high = high.cwiseMax(p);
  return high;
}

TEST(ClipShape, HasTwoLegsOfOneMillimetreAndItsLength) {
  for (const float length : {0.004f, 0.008f, 0.012f}) {
    const Solid clip = TitaniumClip(length);
    EXPECT_NEAR(Low(clip).z(), -0.5f * length, 3e-5f) << "the bend";
    EXPECT_NEAR(High(clip).z(), 0.5f * length, 1e-6f) << "the open ends";
    EXPECT_NEAR(High(clip).y(), 0.5e-3f, 3e-5f);
    EXPECT_NEAR(Low(clip).y(), -0.5e-3f, 3e-5f);
    float inner = 1, outer = 0;  // Of a leg, near its end.
    for (const Vec3f& p : clip.positions) {
      if (p.z() < 0.5f * length - 0.0004f || p.z() > 0.5f * length - 0.0002f) continue;
      inner = std::min(inner, std::abs(p.x()));
      outer = std::max(outer, std::abs(p.x()));
    }
    EXPECT_NEAR(outer - inner, 1e-3f, 5e-5f);
    EXPECT_NEAR(inner, 1e-4f, 3e-5f) << "closed";
  }
  EXPECT_NEAR(High(TitaniumClip(0)).z(), 0.002f, 1e-6f) << "at least 4 mm";
}

TEST(ClipShape, TheJawHasParallelSidesAndEndsAtTheTip) {
  const ToolShape shape{0.0025f, 0.33f, 0.001f, 0.008f};
  const Solid jaw = ClipApplierJaw(shape);
  EXPECT_NEAR(High(jaw).z(), shape.tip_length_m, 1e-6f);
  EXPECT_GE(Low(jaw).x(), -2.5e-4f) << "the leg of a clip stands out of the groove";
  EXPECT_LE(High(jaw).x(), shape.tip_radius_m);
  std::map<float, float> widths;  // By z.
  for (const Vec3f& p : jaw.positions) widths[p.z()] = std::max(widths[p.z()], std::abs(p.y()));
  for (const auto& [z, width] : widths) {
    if (z < 0.24f * shape.tip_length_m || z > 0.951f * shape.tip_length_m || width < 5e-4f) continue;
    EXPECT_NEAR(width, 0.85e-3f, 1e-6f) << z;
  }
}

}  // namespace
}  // namespace fulcrum::render
