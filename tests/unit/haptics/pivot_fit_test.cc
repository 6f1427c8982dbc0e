#include "haptics_node/device/pivot_fit.h"

#include <gtest/gtest.h>

#include <string>

#include "haptics_node/device/recorded_motion.h"
#include "services/base/core/error.h"
#include "tests/unit/haptics/swing.h"

namespace fulcrum::haptics {
namespace {

using testing::Swing;

const Vec3d kPivot(0.012, -0.095, -0.110);

TEST(PivotFit, FindsTheTrocarOfAPerfectSwing) {
  const PivotFit fit = FitPivot(Swing(kPivot, 0.3, 0));
  EXPECT_EQ(fit.refusal, "");
  EXPECT_LT((fit.p_DP - kPivot).norm(), 1e-9);
  EXPECT_LT(fit.largest_m, 1e-9);
  EXPECT_LT(fit.condition, 50);
  EXPECT_EQ(fit.poses, 1000u);
}

TEST(PivotFit, PlayOfTheTrocarIsTheResidualAndHardlyMovesThePivot) {
  const PivotFit fit = FitPivot(Swing(kPivot, 0.3, 0.0015));
  EXPECT_EQ(fit.refusal, "");
  EXPECT_LT((fit.p_DP - kPivot).norm(), 0.0005);
  // Uniform noise of ± 1.5 mm on three axes, of which two are across the shaft.
  EXPECT_NEAR(fit.residual_m, 0.0015 * std::sqrt(2.0 / 3), 0.0001);
  EXPECT_GT(fit.largest_m, fit.residual_m);
}

TEST(PivotFit, ASwingInOnePlaneIsEnough) {
  auto poses = Swing(kPivot, 0.4, 0.0005);
  for (DevicePose& pose : poses) {
    pose.d_D = Vec3d(pose.d_D.x(), -1, -1).normalized();
    pose.p_D = kPivot - 0.14 * pose.d_D;
  }
  const PivotFit fit = FitPivot(poses);
  EXPECT_EQ(fit.refusal, "");
  EXPECT_LT((fit.p_DP - kPivot).norm(), 1e-9);
}

TEST(PivotFit, SmallMotionIsRefused) {
  for (const double width : {0.0, 0.01, 0.05}) {
    const PivotFit fit = FitPivot(Swing(kPivot, width, 0.0005));
    EXPECT_NE(fit.refusal.find("the motion was too small: the shaft swung by"), std::string::npos) << fit.refusal;
    EXPECT_GT(fit.condition, kMaxPivotCondition);
  }
}

TEST(PivotFit, AToolOutsideATrocarIsRefused) {
  const PivotFit fit = FitPivot(Swing(kPivot, 0.3, 0.01));
  EXPECT_NE(fit.refusal.find("pass one point by"), std::string::npos) << fit.refusal;
}

TEST(PivotFit, TooFewPosesAreRefused) {
  const PivotFit fit = FitPivot(Swing(kPivot, 0.3, 0, 99));
  EXPECT_NE(fit.refusal.find("only 99 poses"), std::string::npos) << fit.refusal;
  EXPECT_NE(FitPivot({}).refusal, "");
}

TEST(RecordedMotion, TextReadsBack) {
  const auto poses = Swing(kPivot, 0.3, 0.001, 50);
  const RecordedMotion motion = RecordedMotion::Parse(ToText(poses), "m.csv");
  ASSERT_EQ(motion.poses().size(), poses.size());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    EXPECT_NEAR(motion.poses()[i].time_s, poses[i].time_s, 1e-9);
    EXPECT_LT((motion.poses()[i].p_D - poses[i].p_D).norm(), 1e-7);
    EXPECT_LT((motion.poses()[i].d_D - poses[i].d_D).norm(), 1e-6);
    EXPECT_EQ(motion.poses()[i].buttons, 1);
  }
}

constexpr const char* kHeader = "time_s,x_mm,y_mm,z_mm,axis_x,axis_y,axis_z,buttons\n";

TEST(RecordedMotion, PositionsAreLinearBetweenPosesAndAtRestOutside) {
  const RecordedMotion motion =
      RecordedMotion::Parse(std::string(kHeader) + "1,10,0,0,0,0,-1,0\r\n\n2,20,40,0,0,0,-1,1\n", "m.csv");
  EXPECT_EQ(motion.PositionAt(-1), Vec3d(0.010, 0, 0));
  EXPECT_EQ(motion.PositionAt(1), Vec3d(0.010, 0, 0));
  EXPECT_LT((motion.PositionAt(1.25) - Vec3d(0.0125, 0.010, 0)).norm(), 1e-15);
  EXPECT_EQ(motion.PositionAt(2), Vec3d(0.020, 0.040, 0));
  EXPECT_EQ(motion.PositionAt(99), Vec3d(0.020, 0.040, 0));
}

TEST(RecordedMotion, RefusesWithFileLineAndValidRange) {
  const auto refusal = [](const std::string& text) -> std::string {
    try {
      RecordedMotion::Parse(text, "m.csv");
    } catch (const InputError& error) {
      return error.what();
    }
    return "accepted";
  };
  const std::string head = kHeader;
  const std::string good = "0,0,0,0,0,0,-1,0\n";
  EXPECT_EQ(refusal(""),
            "m.csv:1: no poses; valid: at least one line below time_s,x_mm,y_mm,z_mm,axis_x,axis_y,"
            "axis_z,buttons");
  EXPECT_NE(refusal("x,y,z\n").find("m.csv:1: no motion file"), std::string::npos);
  EXPECT_NE(refusal(head + good + "1,2,3\n").find("m.csv:3: valid: eight finite numbers"), std::string::npos);
  EXPECT_NE(refusal(head + "nan,0,0,0,0,0,-1,0\n").find("eight finite numbers"), std::string::npos);
  EXPECT_NE(refusal(head + "0,0,inf,0,0,0,-1,0\n").find("eight finite numbers"), std::string::npos);
  EXPECT_NE(refusal(head + "0,0,0,0,0,0,-1,0,7\n").find("eight finite numbers"), std::string::npos);
  EXPECT_NE(refusal(head + good + good).find("m.csv:3: time_s 0.000000 does not exceed"), std::string::npos);
  EXPECT_NE(refusal(head + "0,3000,0,0,0,0,-1,0\n").find("valid: -2000 to 2000 mm"), std::string::npos);
  EXPECT_NE(refusal(head + "0,0,0,0,0,0,-2,0\n").find("valid: 0.99 to 1.01"), std::string::npos);
  EXPECT_NE(refusal(head + "0,0,0,0,0,0,-1,0.5\n").find("integer from 0 to 255"), std::string::npos);
  EXPECT_THROW(RecordedMotion::Load("/nowhere/m.csv"), InputError);
}

}  // namespace
}  // namespace fulcrum::haptics
