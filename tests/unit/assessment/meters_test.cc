// Limits of the meters of the assessment: the last value that counts and the first that does not.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "services/session/assessment/damage_map.h"
#include "services/session/assessment/force_meter.h"
#include "services/session/assessment/line_meter.h"
#include "services/session/assessment/motion_meter.h"
#include "tests/support/assessment_cases.h"

namespace fulcrum::assessment {
namespace {

HookSample Hook(double time_s, double along_m, bool touching = true) {
  HookSample hook;
  hook.time_s = time_s;
  hook.touching = touching;
  hook.energised = true;
  hook.material = Vec2f(0.02f, 0.02f + static_cast<float>(along_m));
  return hook;
}

/// Length of the trace [m] after two samples on the line.
double TracedBy(double step_m, double step_s) {
  const test::AssessedScene scene;
  LineMeter meter(scene.view);
  meter.Add(Hook(0, 0));
  meter.Add(Hook(step_s, step_m));
  return meter.traced_m();
}

TEST(LineMeter, AJumpOrASilenceIsNoTrace) {
  EXPECT_NEAR(TracedBy(0.0049, 0.01), 0.0049, 1e-8);
  EXPECT_EQ(TracedBy(0.0051, 0.01), 0) << "farther than 5 mm between two messages";
  EXPECT_NEAR(TracedBy(0.001, 0.1), 0.001, 1e-8);
  EXPECT_EQ(TracedBy(0.001, 0.11), 0) << "more than 0.1 s later";
}

TEST(LineMeter, ALiftedHookBeginsAnotherTrace) {
  const test::AssessedScene scene;
  LineMeter meter(scene.view);
  meter.Add(Hook(1, 0));
  meter.Add(Hook(1.01, 0.001, false));
  meter.Add(Hook(1.02, 0.002));
  EXPECT_EQ(meter.traced_m(), 0);
  meter.Add(Hook(1.03, 0.003));
  EXPECT_NEAR(meter.traced_m(), 0.001, 1e-8);
}

TEST(LineMeter, APedalInTheAirIsSaidAfterThreeTenthsOfASecond) {
  const test::AssessedScene scene;
  LineMeter meter(scene.view);
  const auto said_at = [&](double begin_s) {
    for (int i = 0; i < 100; ++i) {
      if (meter.Add(Hook(begin_s + 0.01 * i, 0, false)).pedal_without_contact) return 0.01 * i;
    }
    return 1.0;
  };
  meter.Add(Hook(0.99, 0));
  EXPECT_NEAR(said_at(1), 0.3, 0.015);
  // From the beginning again after a touch.
  meter.Add(Hook(2.99, 0));
  EXPECT_NEAR(said_at(3), 0.3, 0.015);
}

TEST(LineMeter, TheDeviationBeyondTheLimitIsSaid) {
  const test::AssessedScene scene;
  LineMeter meter(scene.view);
  const float limit_m =
      1e-3f * static_cast<float>(scene.view.assessment.limit[static_cast<std::size_t>(Measure::kDeviationMax)]);
  HookSample hook = Hook(1, 0.01);
  hook.material.x() = 0.02f - 0.99f * limit_m;
  EXPECT_FALSE(meter.Add(hook).off_line);
  hook.time_s = 1.01;
  hook.material.x() = 0.02f - 1.01f * limit_m;
  EXPECT_TRUE(meter.Add(hook).off_line);
}

/// What the meter finds of a tip that jumps by `step_m` at 1 s; 4 s at 1 kHz.
ToolMotion MotionOfAJump(const AssessmentParams& params, double step_m) {
  MotionMeter meter(params);
  for (int i = 0; i < 4000; ++i) {
    meter.Add(1e-3 * i, test::ToolAt(1e-3 * i, Vec3d(i <= 1000 ? 0 : step_m, 0, 0), Vec3d::Zero()));
  }
  meter.Finish();
  return meter.tool(0);
}

TEST(MotionMeter, AMovementOfTenSamplesHasASmoothness) {
  const test::AssessedScene scene;
  const AssessmentParams& params = scene.view.assessment;
  int of_ten = 0;
  for (double step_m = 2e-4; step_m < 0.1; step_m *= 1.02) {
    // The samples of the low-passed tip from the first to the last that is not slow.
    LowPass filter;
    Vec3d before = filter.Filter(Vec3d::Zero());
    int first = -1, last = -1;
    double fastest = 0;
    for (int k = 1; k < 100; ++k) {
      const Vec3d tip = filter.Filter(Vec3d(step_m, 0, 0));
      const double speed = (tip - before).norm() * kGridRate_Hz;
      before = tip;
      if (speed < static_cast<double>(params.idle_speed_m_s)) continue;
      if (first < 0) first = k;
      last = k;
      fastest = std::max(fastest, speed);
    }
    const int samples = last - first + 1;
    if (fastest < 1.01 * static_cast<double>(params.movement_speed_m_s)) continue;
    const ToolMotion motion = MotionOfAJump(params, step_m);
    EXPECT_EQ(motion.movements, 1) << step_m;
    EXPECT_EQ(motion.smoothness_count, samples >= 10 ? 1 : 0) << samples << " samples of a step of " << step_m;
    of_ten += samples == 10 ? 1 : 0;
  }
  EXPECT_GT(of_ten, 0);
}

TEST(MotionMeter, ADriftIsNoMovement) {
  const test::AssessedScene scene;
  const AssessmentParams& params = scene.view.assessment;
  ASSERT_LT(params.idle_speed_m_s, 0.9f * params.movement_speed_m_s);
  const double speed = 0.5 * static_cast<double>(params.idle_speed_m_s + params.movement_speed_m_s);
  MotionMeter meter(params);
  for (int i = 0; i < 4000; ++i) {
    const double way = speed * std::clamp(1e-3 * i - 1, 0.0, 1.0);
    meter.Add(1e-3 * i, test::ToolAt(1e-3 * i, Vec3d(way, 0, 0), Vec3d::Zero()));
  }
  meter.Finish();
  EXPECT_EQ(meter.tool(0).movements, 0);
  EXPECT_EQ(meter.tool(0).smoothness_count, 0);
}

/// A tool that rests 60 mm from the start of its script. At 3 s the writer is silent for `silence_s`; then another one
/// moves the tool from the start to its place with 0.6 m/s.
ToolMotion MotionOfARestart(const AssessmentParams& params, double silence_s, double rests_at_m) {
  MotionMeter meter(params);
  for (int i = 0; i < 8000; ++i) {
    const double time_s = 1e-3 * i;
    if (time_s > 3 && time_s < 3 + silence_s) continue;
    const bool again = time_s > 3;
    const double way_m = again ? std::min(rests_at_m, 0.6 * (time_s - 3 - silence_s)) : 0.06;
    ToolState state = test::ToolAt(time_s, Vec3d(way_m, 0, 0), Vec3d::Zero());
    state.stamp.epoch = again ? 2 : 1;
    // 20 mm and back, long after the return.
    if (time_s > 6)
      state.tools[0].p_WT.x() += 0.01f * static_cast<float>(1 - std::cos(std::numbers::pi * (time_s - 6)));
    meter.Add(time_s, state);
  }
  meter.Finish();
  return meter.tool(0);
}

TEST(MotionMeter, TheWayBackAfterARestartOfHapticsIsNotCounted) {
  const test::AssessedScene scene;
  // A process that is back within a gap's time, and one that needs longer.
  for (const double silence_s : {0.05, 0.5}) {
    const ToolMotion motion = MotionOfARestart(scene.view.assessment, silence_s, 0.06);
    EXPECT_NEAR(1e3 * motion.path_m, 40, 1) << silence_s;
    EXPECT_EQ(motion.movements, 1) << silence_s;
    EXPECT_GT(motion.first_s, 5.9) << silence_s;
  }
  // A hand that is elsewhere now: it is measured again after 1.5 s.
  EXPECT_NEAR(1e3 * MotionOfARestart(scene.view.assessment, 0.5, 0.05).path_m, 40, 1);
}

/// The longest time held [s] of a lift of 8 mm in 1 s, then a pull of 2 N up to 10 s; the next physics_node begins at
/// 3.5 s after a silence of 40 ms, without a grasp in its first messages.
double HeldOverARestart(std::uint64_t next_epoch, int messages_without_grasp) {
  test::AssessedScene scene;
  scene.view.assessment.limit[static_cast<std::size_t>(Measure::kLift)] = 6;
  scene.view.assessment.limit[static_cast<std::size_t>(Measure::kPeakForce)] = 3.5f;
  ForceMeter meter(scene.view.assessment, scene.view.physics);
  for (int i = 0; i < 1000; ++i) {
    if (next_epoch != 1 && i >= 346 && i < 350) continue;
    const double lift_m = 0.008 * std::clamp(0.01 * i - 1, 0.0, 1.0);
    ContactModel model = test::GraspAt(0.01 * i, Vec3d(0, 0, lift_m), 2, 8);
    model.stamp.epoch = i < 350 ? 1 : next_epoch;
    if (i >= 350 && i < 350 + messages_without_grasp) model.devices[0].count = 0;
    EXPECT_FALSE(meter.Add(0.01 * i, model).slips);
  }
  EXPECT_NEAR(meter.tool(0).lift_m, 0.008, 1e-6);
  return meter.tool(0).lift_hold_s;
}

TEST(ForceMeter, AHoldGoesOnAfterARestartOfPhysics) {
  EXPECT_NEAR(HeldOverARestart(1, 0), 8.24, 0.03);
  EXPECT_NEAR(HeldOverARestart(2, 0), 8.2, 0.05);
  EXPECT_NEAR(HeldOverARestart(2, 5), 8.15, 0.05);
  // A grasp that is not restored within 0.5 s is another hold: its lift begins where the tip is then.
  EXPECT_LT(HeldOverARestart(2, 60), 2);
}

TEST(ForceMeter, ASilenceOrAnotherPhysicsNodeIsNotCounted) {
  const auto impulse_Ns = [](double step_s, std::uint64_t epoch) {
    const test::AssessedScene scene;
    ForceMeter meter(scene.view.assessment, scene.view.physics);
    ContactModel model = test::PushAt(0, 2);
    model.stamp.epoch = 1;
    meter.Add(0, model);
    model.stamp.epoch = epoch;
    meter.Add(step_s, model);
    return meter.tool(1).force_time_Ns;
  };
  EXPECT_NEAR(impulse_Ns(0.1, 1), 0.2, 1e-6);
  EXPECT_EQ(impulse_Ns(0.11, 1), 0) << "more than 0.1 s later";
  EXPECT_EQ(impulse_Ns(0.01, 2), 0) << "started again";
  EXPECT_EQ(impulse_Ns(0.11, 2), 0);
}

TEST(DamageMap, ATexelLiesWhereItsCentreIs) {
  // A line along y at x = 0, damage in the texel (30, 40) of 0.1 mm: its centre is at 3.05 mm.
  const SheetLine line(std::vector<Vec2f>{{0, 0}, {0, 1}});
  TemperaturePatch patch = test::PatchAt(1, 0, 0, [](const Eigen::Vector2d&) { return false; });
  patch.texels[4 * (40 * std::size_t{kPatchTexels} + 30) + 1] = 200;
  const auto beyond = [&](double margin_m) {
    DamageMap map(line, margin_m, 1e-4);
    map.Add(patch);
    return map.beyond_margin_m2();
  };
  EXPECT_NEAR(beyond(3.049e-3), 1e-8, 1e-14);
  EXPECT_EQ(beyond(3.051e-3), 0);
  EXPECT_EQ(beyond(1e-4 * 30.5), 0) << "on the margin";
  // A line along x: the same of y, at 4.05 mm.
  const SheetLine across(std::vector<Vec2f>{{0, 0}, {1, 0}});
  for (const auto& [margin_m, texels] : {std::pair{4.049e-3, 1}, {4.051e-3, 0}}) {
    DamageMap map(across, margin_m, 1e-4);
    map.Add(patch);
    EXPECT_NEAR(map.beyond_margin_m2(), texels * 1e-8, 1e-14);
  }
}

TEST(DamageMap, ATexelOfTwoPatchesCountsOnce) {
  const SheetLine line(std::vector<Vec2f>{{0, 0}, {0, 1}});
  DamageMap map(line, 1e-3, 1e-4);
  // The texel (100, 70) of the atlas, in patches with different origins.
  for (const auto& [x, y] : {std::pair{0u, 0u}, {64u, 8u}, {3u, 70u}}) {
    TemperaturePatch patch = test::PatchAt(1, x, y, [](const Eigen::Vector2d&) { return false; });
    patch.texels[4 * ((70 - y) * std::size_t{kPatchTexels} + 100 - x) + 1] = 200;
    map.Add(patch);
  }
  EXPECT_NEAR(map.beyond_margin_m2(), 1e-8, 1e-14);
}

TEST(Assessment, WithoutAHookNothingIsSaidOfIt) {
  test::AssessedScene scene;
  const auto pedal_s = [&] {
    const Assessor assessor(scene.view);
    return assessor.figures().session[static_cast<std::size_t>(Measure::kPedalWithoutContact)];
  };
  EXPECT_EQ(pedal_s(), 0);
  scene.view.tools[1].kind = ToolKind::kGrasper;
  EXPECT_TRUE(std::isnan(pedal_s()));
}

TEST(ScopeMeter, WhatIsInTheMiddleIsNotOffCentre) {
  // The hook counts, not the grasper.
  test::AssessedScene scene;
  scene.view.tools[0].kind = ToolKind::kHook;
  scene.view.tools[1].kind = ToolKind::kGrasper;
  scene.view.tools[2].kind = ToolKind::kScope;
  scene.view.render.scope_angle_deg = 0;
  Assessor assessor(scene.view);
  assessor.Begin(test::kStart_ns);
  for (int i = 0; i < 500; ++i) {
    const Vec3d eye(0.1 * std::cos(1.7 * i), 0.1 * std::sin(2.3 * i), 0.05 + 1e-4 * i);
    ToolState state = test::ToolAt(0.03 * i, Vec3d::Zero(), Vec3d(0.1, 0, 0));
    state.tools[2].kind = ToolKind::kScope;
    state.tools[2].p_WT = eye.cast<float>();
    state.tools[2].q_WT = Quatf::FromTwoVectors(Vec3f::UnitZ(), -state.tools[2].p_WT);
    assessor.Add(state);
  }
  EXPECT_NEAR(assessor.figures().session[static_cast<std::size_t>(Measure::kOffCentre)], 0, 0.1);
}

}  // namespace
}  // namespace fulcrum::assessment
