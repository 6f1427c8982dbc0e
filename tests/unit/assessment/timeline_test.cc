// What happened when in a session.
#include "services/session/assessment/timeline.h"

#include <gtest/gtest.h>

#include "tests/support/assessment_cases.h"

namespace fulcrum::assessment {
namespace {

ThermalEvent EventAt(double time_s, ThermalEventKind kind) {
  ThermalEvent event;
  event.stamp = test::StampAt(time_s);
  event.session_time_s = time_s;
  event.kind = kind;
  return event;
}

std::string Told(const Timeline& timeline) {
  std::string told;
  for (const Happening& one : timeline.happenings()) {
    char line[80];
    std::snprintf(line, sizeof(line), "%.1f-%.1f %s; ", one.time_s, one.until_s, KeyOf(one));
    told += line;
  }
  return told;
}

TEST(Timeline, TellsTouchGraspAndReleaseOfEachTool) {
  Timeline timeline(test::kStart_ns);
  timeline.Add(test::PushAt(-0.5, 2));  // Before the session.
  timeline.Add(test::GraspAt(1, Vec3d::Zero(), 1, 5));
  timeline.Add(test::GraspAt(2, Vec3d::Zero(), 1, 5));
  timeline.Add(test::PushAt(3, 2));  // Tool 1 presses, tool 0 holds nothing.
  timeline.Add(test::GraspAt(4, Vec3d::Zero(), 1, 5));
  timeline.Add(test::ToolAt(5, Vec3d::Zero(), Vec3d::Zero()));
  EXPECT_EQ(Told(timeline), "1.0-1.0 touch; 1.0-1.0 grasp; 3.0-3.0 release; 3.0-3.0 touch; 4.0-4.0 grasp; ");
  EXPECT_EQ(TextOf(timeline.happenings()[1]), "Grasper (tool 1) grasps");
  EXPECT_EQ(TextOf(timeline.happenings()[3]), "Hook (tool 2) touches");
}

TEST(Timeline, TellsEachClipOnce) {
  Timeline timeline(test::kStart_ns);
  const auto clips = [&](double time_s, std::uint32_t count) {
    ClipState state;
    state.stamp.stamp_ns = test::kStart_ns + static_cast<std::int64_t>(1e9 * time_s);
    state.count = count;
    for (Clip& clip : state.clips) clip.tool = 2;
    timeline.Add(state);
  };
  clips(0.5, 0);
  clips(1, 1);
  clips(2, 1);  // Physics has restarted.
  clips(3, 3);
  clips(4, 2);  // One has fallen off.
  clips(5, 3);
  EXPECT_EQ(Told(timeline), "1.0-1.0 clip; 3.0-3.0 clip; 3.0-3.0 clip; 5.0-5.0 clip; ");
  EXPECT_EQ(TextOf(timeline.happenings()[0]), "Clip applied (tool 3)");
}

TEST(Timeline, APedalLastsWhileItIsDown) {
  Timeline timeline(test::kStart_ns);
  for (const double time_s : {1.0, 1.1, 1.2}) timeline.Add(test::PedalAt(time_s, CauteryMode::kCut));
  timeline.Add(test::PedalAt(1.3, CauteryMode::kCoag));
  timeline.Add(test::PedalAt(1.4, CauteryMode::kOff));
  timeline.Add(test::PedalAt(9, CauteryMode::kCut));
  EXPECT_EQ(Told(timeline), "1.0-1.3 pedal_cut; 1.3-1.4 pedal_coag; 9.0-9.0 pedal_cut; ");
}

TEST(Timeline, EventsOfHeatThatRepeatAreOne) {
  Timeline timeline(test::kStart_ns);
  for (int i = 0; i < 10; ++i) timeline.Add(EventAt(2 + 0.1 * i, ThermalEventKind::kCut));
  timeline.Add(EventAt(2.5, ThermalEventKind::kUreterWarning));
  timeline.Add(EventAt(8, ThermalEventKind::kCut));
  EXPECT_EQ(Told(timeline), "2.0-2.9 cut; 2.5-2.5 ureter_warning; 8.0-8.0 cut; ");
  EXPECT_EQ(TextOf(timeline.happenings()[1]), "Ureter warning");
}

TEST(Timeline, ForcesAboveTheLimitAndSlips) {
  SceneView scene;
  scene.assessment.limit[static_cast<std::size_t>(Measure::kPeakForce)] = 1.5f;
  scene.physics.grip_force_N = 5;
  Timeline timeline(test::kStart_ns, &scene);
  for (int i = 0; i < 10; ++i) timeline.Add(test::PushAt(1 + 0.01 * i, i < 5 ? 2 : 1));
  timeline.Add(test::PushAt(1.5, 2));  // Soon again: one.
  timeline.Add(test::PushAt(4, 2));
  for (const double time_s : {5.0, 5.01, 5.02}) timeline.Add(test::GraspAt(time_s, Vec3d::Zero(), 1, 5));
  timeline.Add(test::PushAt(5.03, 1));  // Closed jaws hold no more.
  timeline.Add(test::ToolAt(6, Vec3d::Zero(), Vec3d::Zero()));
  EXPECT_EQ(
      Told(timeline),
      "1.0-1.0 touch; 1.0-1.5 force; 4.0-4.0 force; 5.0-5.0 touch; 5.0-5.0 grasp; 5.0-5.0 release; 5.0-5.0 slip; ");
  EXPECT_EQ(TextOf(timeline.happenings().back()), "Grasper (tool 1) loses its hold");
}

TEST(Timeline, AnAssistantIsNotJudged) {
  SceneView scene;
  scene.assessment.limit[static_cast<std::size_t>(Measure::kPeakForce)] = 1.5f;
  scene.physics.grip_force_N = 5;
  const auto told = [&scene] {
    Timeline timeline(test::kStart_ns, &scene);
    for (const double time_s : {1.0, 1.01, 1.02}) timeline.Add(test::GraspAt(time_s, Vec3d::Zero(), 4, 5));
    timeline.Add(test::ToolAt(1.03, Vec3d::Zero(), Vec3d::Zero()));
    timeline.Add(test::PushAt(1.04, 1));  // The hold is lost.
    return Told(timeline);
  };
  EXPECT_EQ(told(), "1.0-1.0 touch; 1.0-1.0 grasp; 1.0-1.0 force; 1.0-1.0 release; 1.0-1.0 touch; 1.0-1.0 slip; ");
  scene.tools[0].traction_N = 1.7f;
  EXPECT_EQ(told(), "1.0-1.0 touch; 1.0-1.0 grasp; 1.0-1.0 release; 1.0-1.0 touch; ");
}

TEST(Timeline, WhatIsFrequentLeavesRoomForAnInjury) {
  Timeline timeline(test::kStart_ns);
  for (int i = 0; i < 600; ++i) {
    timeline.Add(test::PedalAt(i, CauteryMode::kCut));
    timeline.Add(test::PedalAt(i + 0.5, CauteryMode::kOff));
  }
  timeline.Add(EventAt(700, ThermalEventKind::kUreterInjury));
  timeline.Add(EventAt(700.5, ThermalEventKind::kUreterInjury));
  timeline.Add(EventAt(701, ThermalEventKind::kSteam));
  ASSERT_EQ(timeline.happenings().size(), Timeline::kMost + 1);
  EXPECT_EQ(timeline.happenings().back().thermal, ThermalEventKind::kUreterInjury);
  EXPECT_EQ(timeline.happenings().back().until_s, 700.5);
  EXPECT_EQ(timeline.left_out(), 101u);
  // Those are limited as well.
  for (int i = 0; i < 600; ++i) timeline.Add(EventAt(800 + 2 * i, ThermalEventKind::kNerveWarning));
  EXPECT_EQ(timeline.happenings().size(), 2 * Timeline::kMost);
}

TEST(Timeline, ItsLengthIsLimited) {
  Timeline timeline(test::kStart_ns);
  for (std::size_t i = 0; i < Timeline::kMost + 7; ++i) {
    timeline.Add(test::PedalAt(static_cast<double>(i), CauteryMode::kCut));
    timeline.Add(test::PedalAt(static_cast<double>(i) + 0.5, CauteryMode::kOff));
  }
  EXPECT_EQ(timeline.happenings().size(), Timeline::kMost);
  EXPECT_EQ(timeline.left_out(), 7u);
}

}  // namespace
}  // namespace fulcrum::assessment
