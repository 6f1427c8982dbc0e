#include "services/base/core/tool_roll.h"

#include <gtest/gtest.h>

namespace fulcrum {
namespace {

TEST(ToolRoll, IsTheTurnAboutTheShaftWhereverTheToolPoints) {
  for (const ToolKind kind : {ToolKind::kHook, ToolKind::kScope}) {
    ToolDescription tool;
    tool.kind = kind;
    tool.p_WP = {0.05f, -0.1f, 0.15f};
    const Vec3d reference = RollReference(tool, Vec3f::Zero(), Vec3f::UnitZ());
    for (const Vec3d& way : {Vec3d(0.1, 0.9, -0.3), Vec3d(-0.7, 0.2, -0.6), Vec3d(0.3, -0.8, 0.4)}) {
      const Vec3d d_W = way.normalized();
      for (const double roll : {0.0, 0.5, -1.2, 3.1, -3.1}) {
        const Eigen::Quaterniond q = LevelOrientation(kind, d_W, reference) * Eigen::AngleAxisd(roll, Vec3d::UnitZ());
        EXPECT_NEAR(ToolRoll(kind, q.cast<float>(), reference), roll, 1e-5);
        EXPECT_NEAR(ToolRoll(kind, Quatf(-q.cast<float>().coeffs()), reference), roll, 1e-5) << "the same orientation";
      }
    }
  }
}

TEST(ToolRoll, TheReferenceIsNotAlongTheShaft) {
  ToolDescription tool;
  tool.kind = ToolKind::kHook;
  tool.p_WP = {0.2f, 0, 0.01f};
  EXPECT_EQ(RollReference(tool, Vec3f::Zero(), Vec3f::UnitZ()), Vec3d::UnitY());
  tool.p_WP = {0, 0.2f, 0.01f};
  EXPECT_EQ(RollReference(tool, Vec3f::Zero(), Vec3f::UnitZ()), Vec3d::UnitX());
}

}  // namespace
}  // namespace fulcrum
