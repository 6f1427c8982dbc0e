// Faults of a session, detected from Health and deaths, and the verdict.
#include "services/session/supervisor/verdict.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "services/base/core/tick.h"
#include "services/session/supervisor/node_pulse.h"
#include "services/session/supervisor/script_outlook.h"
#include "tests/support/pace_faults.h"

namespace fulcrum::supervisor {
namespace {

constexpr double kTurn_s = 0.1;

/// A session of one servo and one picture; each sends a Health in every turn unless a test changes it.
class VerdictTest : public ::testing::Test {
 protected:
  VerdictTest() { verdict_.Begin({.nodes = {NodeId::kHaptics, NodeId::kRender}, .remote = {}, .restarts = 3}); }

  struct Node {
    NodeId id;
    double asked_Hz, achieved_Hz;
    double ticks = 0, missed = 0;
    std::uint64_t epoch = 1;
    HealthState state = HealthState::kRunning;
    bool speaks = true;
    std::vector<Metric> metrics = {};
    std::string error = {};
  };

  void RunFor(double seconds) {
    for (int turns = static_cast<int>(seconds / kTurn_s + 0.5); turns > 0; --turns) {
      time_s_ += kTurn_s;
      for (Node* node : {&servo_, &picture_}) Speak(node);
      verdict_.Watch(time_s_, record_);
    }
  }
  void Speak(Node* node) {
    node->ticks += kTurn_s * node->achieved_Hz;
    node->missed += kTurn_s * (node->asked_Hz - node->achieved_Hz);
    if (!node->speaks) return;
    Health health;
    health.stamp.epoch = node->epoch;
    health.node = node->id;
    health.state = node->state;
    health.rate_asked_Hz = static_cast<float>(node->asked_Hz);
    health.ticks = static_cast<std::uint64_t>(node->ticks);
    health.overruns = static_cast<std::uint64_t>(node->missed);
    health.metrics = node->metrics;
    health.last_error = node->error;
    record_.AddHealth(time_s_, health);
  }
  void Die(Node* node, bool asked = false) {
    record_.AddDeath(time_s_, node->id, asked ? "was restarted by command" : "killed by signal 9", false, asked);
    node->speaks = false;
  }
  static void Return(Node* node) {
    ++node->epoch;
    node->ticks = node->missed = 0;
    node->speaks = true;
  }
  void DieAndReturn(Node* node, bool asked = false) {
    Die(node, asked);
    RunFor(0.3);
    Return(node);
    RunFor(0.5);
  }
  /// The faults at the end, one per line.
  std::string End() {
    verdict_.Close(time_s_, record_);
    return Faults();
  }
  std::string Faults() const {
    std::string text;
    for (const Fault& fault : verdict_.faults()) text += fault.text + "\n";
    return text;
  }

  double time_s_ = -0.2;
  Node servo_{NodeId::kHaptics, 1000, 998};
  Node picture_{NodeId::kRender, 15, 9};  // Software OpenGL.
  SessionRecord record_;
  Verdict verdict_;
};

TEST_F(VerdictTest, AHealthySessionIsWell) {
  RunFor(25);
  EXPECT_EQ(End(), "");
  EXPECT_EQ(verdict_.code(), ExitCode::kDone);
}

TEST_F(VerdictTest, AServoThatStopsIsNamedWhileItIsStopped) {
  RunFor(2);
  servo_.speaks = false;
  RunFor(1.1);
  EXPECT_EQ(Faults(), "");
  RunFor(0.3);
  EXPECT_EQ(Faults(), "haptics_node was silent for more than 1.2 s\n");
  EXPECT_NEAR(verdict_.faults()[0].time_s, time_s_, 0.25);
  servo_.speaks = true;
  RunFor(3);
  EXPECT_EQ(End(), "haptics_node was silent for more than 1.2 s\n") << "reported once";
  EXPECT_EQ(verdict_.code(), ExitCode::kFailure);
}

TEST_F(VerdictTest, HealthWithoutTicksIsStuck) {
  RunFor(2);
  picture_.achieved_Hz = 0;
  RunFor(1.5);
  EXPECT_EQ(Faults(), "render_node was stuck for more than 1.2 s\n");
}

TEST_F(VerdictTest, ASlowNodeHasSeldomTicks) {
  picture_ = {NodeId::kRender, 1, 1};
  RunFor(12);
  EXPECT_EQ(End(), "");
}

TEST_F(VerdictTest, WhileTheSupervisorWasSuspendedNobodyWasHeard) {
  RunFor(2);
  time_s_ += 4;
  RunFor(2);
  EXPECT_EQ(Faults(), "");
}

TEST_F(VerdictTest, ARateFarBelowTheOneAskedFor) {
  RunFor(11);
  servo_.achieved_Hz = 600;
  EXPECT_EQ(Faults(), "");
  RunFor(20);  // The second window begins 0.7 s earlier.
  EXPECT_EQ(Faults(), "haptics_node ran at 627.8 of 1000 Hz over 10 s; at least 75 % are needed\n");
}

TEST_F(VerdictTest, ARateOfAShortSessionIsJudgedAtItsEnd) {
  servo_.achieved_Hz = 600;
  RunFor(5);
  EXPECT_EQ(Faults(), "");
  EXPECT_NE(End().find("haptics_node ran at 600.0 of 1000 Hz"), std::string::npos) << Faults();
}

TEST_F(VerdictTest, MissedPeriodsOfTheWholeSession) {
  servo_.achieved_Hz = 800;
  RunFor(12);
  EXPECT_EQ(Faults(), "");
  EXPECT_EQ(End(), "haptics_node missed 20 % of its periods; at most 15 % are allowed\n");
}

// Tests of behaviour accept sessions of machines that are too slow, and nothing else.
TEST_F(VerdictTest, FaultsOfPaceAreToldFromOthers) {
  const auto said = [&] {
    std::string text = "60 s: NOT WELL\n";
    for (const Fault& fault : verdict_.faults()) text += "fault at 5.0 s: " + fault.text + "\n";
    return text;
  };
  servo_.achieved_Hz = 600;
  RunFor(20);
  End();
  EXPECT_EQ(verdict_.faults().size(), 2u) << Faults();
  EXPECT_EQ(testing::FaultsButPace(said()), "");
  EXPECT_TRUE(testing::IsOfPace("fault at 6.8 s: render_node was stuck for more than 1.2 s"));
  EXPECT_FALSE(testing::IsOfPace("fault at 6.8 s: physics_node was stuck for more than 1.2 s"));
  EXPECT_FALSE(
      testing::IsOfPace("fault at 9.0 s: haptics_node ran at 240.0 of 1000 Hz over 10 s; at least 75 % are needed"));
  EXPECT_FALSE(testing::IsOfPace("fault at 9.0 s: physics_node missed 80 % of its periods; at most 15 % are allowed"));
  verdict_.Fail(5, ExitCode::kFailure, "the recorder lost samples");
  EXPECT_EQ(testing::FaultsButPace(said()), "fault at 5.0 s: the recorder lost samples\n");
  EXPECT_EQ(testing::FaultsButPace("recording: /r.mcap, 3 samples lost\n" + said()), "");
  EXPECT_EQ(testing::FaultsButPace("recording: /r.mcap, 11 samples lost\n" + said()),
            "fault at 5.0 s: the recorder lost samples\n");
  EXPECT_TRUE(testing::IsOfPace("fault at 8.5 s: render_node did not run again within 5 s"));
  EXPECT_FALSE(testing::IsOfPace("fault at 8.5 s: thermal_node did not run again within 5 s"));
  const std::string died = "fault at 9.0 s: render_node died 4 times, of which 3 are allowed: ";
  EXPECT_TRUE(testing::IsOfPace(died + "was stuck in a step for too long and was killed"));
  EXPECT_FALSE(testing::IsOfPace(died + "killed by signal 11 (Segmentation fault)"));
}

TEST_F(VerdictTest, AMomentOfLoadIsNoFault) {
  for (int i = 0; i < 4; ++i) {
    RunFor(10);
    servo_.achieved_Hz = 500;
    RunFor(1);
    servo_.achieved_Hz = 998;
  }
  EXPECT_EQ(End(), "");
}

TEST_F(VerdictTest, DeathsUpToTheAllowedNumberAreWell) {
  RunFor(2);
  for (int death = 0; death < 3; ++death) DieAndReturn(&picture_);
  EXPECT_EQ(Faults(), "");
  DieAndReturn(&picture_);
  EXPECT_EQ(Faults(),
            "render_node died 4 times, of which 3 are allowed (verdict.restarts of the cart): killed by signal 9\n");
}

TEST_F(VerdictTest, TheFirstStepAfterARestartMayTakeLonger) {
  RunFor(12);
  Die(&picture_);
  RunFor(0.6);
  Return(&picture_);
  picture_.achieved_Hz = 0;
  picture_.state = HealthState::kWaiting;
  RunFor(0.2);
  picture_.state = HealthState::kRunning;
  RunFor(3);
  EXPECT_EQ(Faults(), "");
  picture_.achieved_Hz = 9;
  RunFor(2);
  EXPECT_EQ(Faults(), "");
  Die(&picture_);
  Return(&picture_);
  picture_.achieved_Hz = 0;
  RunFor(5.5);
  EXPECT_EQ(Faults(), "render_node was stuck for more than 5.0 s\n");
}

TEST_F(VerdictTest, RestartsByCommandAreNotCounted) {
  RunFor(2);
  for (int restart = 0; restart < 9; ++restart) DieAndReturn(&servo_, true);
  EXPECT_EQ(End(), "");
}

TEST_F(VerdictTest, ANodeThatStaysAway) {
  RunFor(2);
  Die(&servo_);
  RunFor(5.2);
  EXPECT_EQ(Faults(), "haptics_node did not run again within 5 s\n");
}

TEST_F(VerdictTest, ANodeThatIsReplacedByAProgramWithoutHealth) {
  RunFor(2);
  Die(&picture_, true);
  RunFor(20);
  EXPECT_EQ(End(), "");
}

TEST_F(VerdictTest, ANodeThatNeverBegins) {
  servo_.state = HealthState::kWaiting;
  RunFor(5.5);
  EXPECT_EQ(Faults(), "haptics_node did not begin within 5 s\n");
}

TEST_F(VerdictTest, MetricsThatAreZeroInASessionThatIsWell) {
  servo_.metrics = {{"foreign_samples", 0}, {"quarantined", 0}};
  RunFor(2);
  EXPECT_EQ(Faults(), "");
  servo_.metrics = {{"foreign_samples", 12}, {"quarantined", 3}};
  picture_.metrics = {{"png_failed", 2}};
  picture_.error = "frame_1.png: No space left on device";
  RunFor(1);
  EXPECT_NE(Faults().find("nodes dropped 12 samples of another session"), std::string::npos) << Faults();
  EXPECT_NE(Faults().find("physics_node reset 3 particles"), std::string::npos) << Faults();
  EXPECT_NE(Faults().find("render_node could not write 2 pictures: frame_1.png: No space left on device\n"),
            std::string::npos)
      << Faults();
}

class RecordedVerdictTest : public VerdictTest {
 protected:
  RecordedVerdictTest() {
    verdict_.Begin({.nodes = {NodeId::kHaptics, NodeId::kRecorder}, .remote = {}, .restarts = 3});
    picture_ = {NodeId::kRecorder, 20, 20};
  }
  Node& recorder_ = picture_;
};

TEST_F(RecordedVerdictTest, ADeathOfTheRecorderLosesSamples) {
  RunFor(2);
  DieAndReturn(&recorder_);
  EXPECT_EQ(Faults(), "samples were lost with the recorder, which died: killed by signal 9\n");
}

TEST_F(RecordedVerdictTest, ARecordingThatEndedInOrder) {
  RunFor(2);
  recorder_.metrics = {{"recording_ended", 1}};
  recorder_.error = "500 MB are left on the disk";
  RunFor(1);
  EXPECT_EQ(Faults(), "the recording ended before the session: 500 MB are left on the disk\n");
}

TEST_F(RecordedVerdictTest, LossesOfTheRecorder) {
  RunFor(2);
  Health health;
  health.stamp.epoch = 1;
  health.node = NodeId::kRecorder;
  health.state = HealthState::kDegraded;
  health.inputs = {{TopicId::kToolState, true, 1, 100, 7, 0}};
  record_.AddHealth(time_s_, health);
  verdict_.Watch(time_s_, record_);
  EXPECT_EQ(Faults(), "the recorder lost samples\n");
}

TEST(VerdictCodeTest, AnExitCodeOfItsOwnIsKept) {
  Verdict verdict;
  verdict.Fail(1, ExitCode::kFailure, "slow");
  verdict.Fail(2, ExitCode::kDeviceLost, "the device is gone");
  verdict.Fail(3, ExitCode::kFailure, "slow");
  EXPECT_EQ(verdict.code(), ExitCode::kDeviceLost);
  EXPECT_EQ(verdict.faults().size(), 2u);
}

TEST(DemandsTest, OnlyWhatTheNodesCanDoIsAskedFor) {
  const auto bits = [](std::initializer_list<NodeId> nodes) {
    std::uint32_t mask = 0;
    for (const NodeId node : nodes) mask |= 1u << static_cast<unsigned>(node);
    return mask;
  };
  using enum NodeId;
  const ScriptDemands all{.deformation = true, .cut = true};
  config::CartConfig cart;
  const auto possible = [&](std::uint32_t mask) { return PossibleDemands(all, mask, cart); };
  const std::uint32_t whole = bits({kHandleBridge, kHaptics, kPhysics, kThermal, kRender});
  EXPECT_TRUE(possible(whole).deformation);
  EXPECT_TRUE(possible(whole).cut);
  EXPECT_TRUE(possible(bits({kHandleBridge, kHaptics, kPhysics})).deformation);
  EXPECT_FALSE(possible(bits({kHandleBridge, kHaptics, kPhysics})).cut);
  EXPECT_FALSE(possible(bits({kHandleBridge, kHaptics, kThermal})).deformation);
  cart.pedal.kind = config::LinkKind::kSerial;
  EXPECT_FALSE(possible(whole).cut) << "a person need not press the pedal";
}

// ------------------------------------------------------------------------------------------------------ the pulse

class PulseTest : public ::testing::Test {
 protected:
  PulseTest() { pulse_.Start(kSecond_ns); }
  void Say(double time_s, std::uint64_t ticks, HealthState state = HealthState::kRunning, float rate_Hz = 15,
           NodeId node = NodeId::kRender) {
    Health health;
    health.node = node;
    health.state = state;
    health.ticks = ticks;
    health.rate_asked_Hz = rate_Hz;
    pulse_.Add(health, static_cast<std::int64_t>(1e9 * time_s));
  }
  [[nodiscard]] std::string At(double time_s, bool has_spare) const {
    const char* text = pulse_.Complaint(has_spare, static_cast<std::int64_t>(1e9 * time_s));
    return text == nullptr ? "" : text;
  }
  NodePulse pulse_;
};

TEST_F(PulseTest, SilenceIsAllowedForLongerWithoutASpare) {
  EXPECT_EQ(At(60, true), "");
  Say(10, 5);
  EXPECT_EQ(At(11.1, true), "");
  EXPECT_EQ(At(11.3, true), "sent no Health for too long and was killed");
  EXPECT_EQ(At(14.9, false), "");
  EXPECT_EQ(At(15.1, false), "sent no Health for too long and was killed");
}

TEST_F(PulseTest, HealthThatGoesOnWithoutTicksIsStuck) {
  Say(10, 5);
  Say(11, 5);
  EXPECT_EQ(At(11.1, true), "");
  Say(11.3, 5);
  EXPECT_EQ(At(11.3, true), "was stuck in a step for too long and was killed");
  Say(11.4, 6);
  EXPECT_EQ(At(11.4, true), "");
}

TEST_F(PulseTest, ARecorderMayWaitForItsDisk) {
  Say(10, 5, HealthState::kRunning, 20, NodeId::kRecorder);
  Say(39, 5, HealthState::kRunning, 20, NodeId::kRecorder);
  EXPECT_EQ(At(39, false), "");
  Say(41, 5, HealthState::kRunning, 20, NodeId::kRecorder);
  EXPECT_EQ(At(41, false), "was stuck in a step for too long and was killed");
  EXPECT_EQ(At(47, false), "sent no Health for too long and was killed");
}

TEST_F(PulseTest, TheFirstStepIsPartOfTheStart) {
  Say(10, 0);
  Say(14, 0);
  EXPECT_EQ(At(14, true), "");
  Say(15.1, 0);
  EXPECT_EQ(At(15.1, true), "was stuck in a step for too long and was killed");
}

TEST_F(PulseTest, ANodeThatWaitsForItsSessionHasNoTicks) {
  Say(10, 0, HealthState::kWaiting);
  Say(20, 0, HealthState::kWaiting);
  EXPECT_EQ(At(20, true), "");
  EXPECT_EQ(At(24.9, true), "") << "it may still be starting";
}

TEST_F(PulseTest, ALowRateHasSeldomTicks) {
  Say(10, 5, HealthState::kRunning, 1);
  Say(12.9, 5, HealthState::kRunning, 1);
  EXPECT_EQ(At(12.9, true), "");
  Say(13.1, 5, HealthState::kRunning, 1);
  EXPECT_NE(At(13.1, true), "");
}

TEST_F(PulseTest, WhileTheSupervisorWasSuspendedNothingCounts) {
  Say(10, 5);
  pulse_.ResetTimeouts(20 * kSecond_ns);
  EXPECT_EQ(At(21, true), "");
}

}  // namespace
}  // namespace fulcrum::supervisor
