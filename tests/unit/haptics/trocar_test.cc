#include "haptics_node/kinematics/trocar.h"

#include <gtest/gtest.h>

#include <random>

#include "services/base/core/tool_roll.h"

namespace fulcrum::haptics {
namespace {

const Trocar kTrocar{Vec3d(0.02, -0.01, 0.2), 0.35};

Vec3d Random(std::mt19937* random, double scale) {
  std::uniform_real_distribution<double> uniform(-scale, scale);
  const double x = uniform(*random);
  const double y = uniform(*random);
  return {x, y, uniform(*random)};
}

/// Attach points outside the clamped range.
Vec3d RandomAttachPoint(std::mt19937* random) {
  for (;;) {
    const Vec3d p = kTrocar.p_WP + Random(random, 0.2);
    const double outside = (p - kTrocar.p_WP).norm();
    if (outside > 0.03 && outside < kTrocar.length_m - 0.03) return p;
  }
}

TEST(Trocar, TipLiesOnTheLineThroughThePivotAtTheShaftsLength) {
  std::mt19937 random(1);
  for (int i = 0; i < 100; ++i) {
    const Vec3d p_WA = RandomAttachPoint(&random);
    const TrocarPose pose = PoseFromAttachPoint(kTrocar, p_WA);
    EXPECT_NEAR((pose.p_WT - p_WA).norm(), kTrocar.length_m, 1e-12);
    EXPECT_NEAR((pose.p_WT - p_WA).cross(kTrocar.p_WP - p_WA).norm(), 0.0, 1e-12);
    EXPECT_GT((pose.p_WT - kTrocar.p_WP).dot(pose.d_W), 0.0);
  }
}

TEST(Trocar, JacobianEqualsFiniteDifferences) {
  std::mt19937 random(2);
  const double h = 1e-6;
  for (int i = 0; i < 100; ++i) {
    const Vec3d p_WA = RandomAttachPoint(&random);
    const TrocarPose pose = PoseFromAttachPoint(kTrocar, p_WA);
    for (int k = 0; k < 3; ++k) {
      const Vec3d step = h * Vec3d::Unit(k);
      const Vec3d derivative =
          (PoseFromAttachPoint(kTrocar, p_WA + step).p_WT - PoseFromAttachPoint(kTrocar, p_WA - step).p_WT) / (2 * h);
      // Central differences: error h^2 times the third derivative, which grows as 1/l_h^2 times the lever.
      EXPECT_LT((derivative - pose.J.col(k)).norm(), 1e-7) << p_WA.transpose();
    }
  }
}

TEST(Trocar, LargestLeverBoundsEveryDirection) {
  std::mt19937 random(8);
  for (int i = 0; i < 100; ++i) {
    const TrocarPose pose = PoseFromAttachPoint(kTrocar, RandomAttachPoint(&random));
    double largest = 0;
    for (int k = 0; k < 200; ++k) {
      largest = std::max(largest, ForceAtAttachPoint(pose, Random(&random, 1).normalized()).norm());
    }
    EXPECT_LE(largest, LargestLever(pose) + 1e-12);
    EXPECT_GE(largest, 0.9 * LargestLever(pose));
  }
}

TEST(Trocar, ForceMappingConservesPower) {
  std::mt19937 random(3);
  for (int i = 0; i < 100; ++i) {
    const TrocarPose pose = PoseFromAttachPoint(kTrocar, RandomAttachPoint(&random));
    const Vec3d v_A = Random(&random, 1);
    const Vec3d f_T = Random(&random, 3);
    const Vec3d f_A = ForceAtAttachPoint(pose, f_T);
    EXPECT_NEAR(f_A.dot(v_A), f_T.dot(pose.J * v_A), 1e-12 * (1 + pose.J.norm()));
    EXPECT_LT((ForceAtTip(pose, f_A) - f_T).norm(), 1e-12 * (1 + pose.J.norm()));
  }
}

TEST(Trocar, AttachPointForTipIsTheInverse) {
  std::mt19937 random(4);
  for (int i = 0; i < 100; ++i) {
    const Vec3d p_WA = RandomAttachPoint(&random);
    const Vec3d tip = PoseFromAttachPoint(kTrocar, p_WA).p_WT;
    EXPECT_LT((AttachPointForTip(kTrocar, tip) - p_WA).norm(), 1e-12);
  }
}

TEST(Trocar, PartsAreClampedAndThePivotItselfIsFinite) {
  const Vec3d far(0, 0, 5);
  const TrocarPose out = PoseFromAttachPoint(kTrocar, far);
  EXPECT_NEAR((out.p_WT - kTrocar.p_WP).norm(), kMinShaftPart_m, 1e-12);
  EXPECT_NEAR((out.J * out.d_W).norm(), 0.0, 1e-12);  // Clamped: no motion along the shaft.
  const TrocarPose at_pivot = PoseFromAttachPoint(kTrocar, kTrocar.p_WP);
  EXPECT_TRUE(at_pivot.p_WT.allFinite());
  EXPECT_TRUE(at_pivot.J.allFinite());
  EXPECT_TRUE(ForceAtTip(at_pivot, Vec3d(1, 2, 3)).allFinite());
  EXPECT_TRUE(AttachPointForTip(kTrocar, kTrocar.p_WP).allFinite());
}

TEST(Trocar, ToolFrameHasZAlongTheShaftAndXTowardsTheReference) {
  std::mt19937 random(5);
  for (int i = 0; i < 100; ++i) {
    const Vec3d d = Random(&random, 1).normalized();
    const Eigen::Matrix3d R = ToolOrientation(d, Vec3d::UnitX()).toRotationMatrix();
    EXPECT_LT((R.col(2) - d).norm(), 1e-12);
    EXPECT_GE(R.col(0).dot(Vec3d::UnitX()), 0.0);
    EXPECT_NEAR(R.col(1).dot(Vec3d::UnitX()), 0.0, 1e-12);
    EXPECT_NEAR(R.determinant(), 1.0, 1e-12);
  }
  EXPECT_TRUE(ToolOrientation(Vec3d::UnitX(), Vec3d::UnitX()).coeffs().allFinite());
}

}  // namespace
}  // namespace fulcrum::haptics
