#include "haptics_node/device/simulated_device.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <vector>

#include "services/base/core/operator_script.h"
#include "tests/unit/haptics/rig.h"

namespace fulcrum::haptics {
namespace {

using testing::BenchTrocar;
using testing::TickAt;

const std::array<ScriptKey, 4> kScript{{{1.0f, 0, Vec3f(0, 0, 0.05f), 0, 0, 0},
                                        {2.0f, 0, Vec3f(0.03f, 0, 0.02f), 0, 0, 0},
                                        {3.0f, 0, Vec3f(0.03f, 0.02f, 0.02f), 0, 0, 0},
                                        {0.0f, 1, Vec3f(-0.03f, 0, 0.06f), 0, 0, 0}}};

Vec3d Tip(const Vec3d& p_WA) { return PoseFromAttachPoint(BenchTrocar(), p_WA).p_WT; }

TEST(SimulatedDevice, BeginsAtRestWhereTheScriptIs) {
  for (const std::uint64_t begin : {0u, 1500u, 2500u, 9000u}) {
    SimulatedDevice device({}, BenchTrocar(), kScript, 0);
    const Tick tick = TickAt(begin);
    const Vec3f wanted = EvaluateScript(kScript, 0, tick.session_time_s).p_W;
    EXPECT_LT((Tip(device.ReadPosition(tick)) - wanted.cast<double>()).norm(), 1e-7);
  }
}

TEST(SimulatedDevice, RestsAtTheFirstKeyWhileNoSessionIsKnown) {
  SimulatedDevice device({}, BenchTrocar(), kScript, 0);
  Vec3d tip;
  for (std::uint64_t i = 0; i < 500; ++i) {
    Tick tick = TickAt(i);
    tick.session_time_s = -1;
    tip = Tip(device.ReadPosition(tick));
  }
  EXPECT_LT((tip - Vec3d(0, 0, 0.05)).norm(), 1e-7);
}

TEST(SimulatedDevice, FollowsTheScriptWithinAMillimetreAndSettlesOnIt) {
  SimulatedDevice device({}, BenchTrocar(), kScript, 0);
  for (std::uint64_t i = 0; i < 4000; ++i) {
    const Tick tick = TickAt(i);
    const Vec3d wanted = EvaluateScript(kScript, 0, tick.session_time_s).p_W.cast<double>();
    const Vec3d tip = Tip(device.ReadPosition(tick));
    EXPECT_LT((tip - wanted).norm(), 0.001) << i;
    if (i == 3999) {
      EXPECT_LT((tip - wanted).norm(), 1e-6);
    }
  }
}

TEST(SimulatedDevice, AConstantForceMovesItByForceOverStiffness) {
  HapticsParams hand;
  SimulatedDevice device(hand, BenchTrocar(), kScript, 1);
  Vec3d before;
  Vec3d after;
  for (std::uint64_t i = 0; i < 2000; ++i) {
    after = device.ReadPosition(TickAt(i));
    if (i == 0) before = after;
    device.WriteForce(Vec3d(1, -2, 0.5));
  }
  EXPECT_LT((after - before - Vec3d(1, -2, 0.5) / hand.hand_stiffness_N_m).norm(), 1e-7);
}

// The same motion with skipped ticks: the hand moves with time, not with ticks.
TEST(SimulatedDevice, SkippedTicksDoNotSlowTheHand) {
  SimulatedDevice steady({}, BenchTrocar(), kScript, 0);
  SimulatedDevice halting({}, BenchTrocar(), kScript, 0);
  for (std::uint64_t i = 0; i < 1700; ++i) {
    const Vec3d p = steady.ReadPosition(TickAt(i));
    if (i % 7 != 0) continue;
    EXPECT_LT((halting.ReadPosition(TickAt(i)) - p).norm(), 2e-4) << i;
  }
}

TEST(SimulatedDevice, AnotherSessionIsTakenUpAtRest) {
  SimulatedDevice device({}, BenchTrocar(), kScript, 0);
  for (std::uint64_t i = 0; i < 1500; ++i) (void)device.ReadPosition(TickAt(i));
  Tick tick = TickAt(1500);
  tick.session_time_s = 2.9;
  const Vec3d there = device.ReadPosition(tick);
  EXPECT_LT((Tip(there) - EvaluateScript(kScript, 0, 2.9).p_W.cast<double>()).norm(), 1e-7);
}

TEST(SimulatedDevice, AToolWithoutKeysRests) {
  SimulatedDevice device({}, BenchTrocar(), std::span(kScript).first(3), 1);
  const Vec3d first = device.ReadPosition(TickAt(0));
  for (std::uint64_t i = 1; i < 100; ++i) EXPECT_EQ(device.ReadPosition(TickAt(i)), first);
  EXPECT_TRUE(first.allFinite());
}

TEST(SimulatedDevice, RestsHalfOfItsShaftInside) {
  // The pivot is 0.2 m above the origin, the shaft 0.4 m long.
  EXPECT_LT(Tip(RestingAttachPoint(BenchTrocar())).norm(), 1e-12);
}

TEST(SimulatedDevice, ALateClockIsTheSameSessionAndAnotherSessionIsTakenUpAtRest) {
  // The script moves at 42 mm/s, so that the hand is not exactly on it.
  const auto error = [](double jump_s) {
    SimulatedDevice device({}, BenchTrocar(), kScript, 0);
    for (std::uint64_t i = 0; i < 1500; ++i) (void)device.ReadPosition(TickAt(i));
    Tick tick = TickAt(1500);
    tick.session_time_s += jump_s;
    const Vec3d tip = Tip(device.ReadPosition(tick));
    return (tip - EvaluateScript(kScript, 0, tick.session_time_s).p_W.cast<double>()).norm();
  };
  EXPECT_GT(error(0.048), 1e-5);
  EXPECT_GT(error(-0.048), 1e-5);
  EXPECT_LT(error(0.052), 1e-7);
  EXPECT_LT(error(-0.052), 1e-7);
}

/// The tip's height in each millisecond, of a closed grasper with a wanted traction of 0.6 N, while the tissue pulls
/// down with a constant force. The jaws open at 4 s.
std::vector<double> HeightsUnder(double force_N) {
  const std::array<ScriptKey, 3> script{{{0.0f, 0, Vec3f(0, 0, 0.05f), 0, 0, 0},
                                         {4.0f, 0, Vec3f(0, 0, 0.05f), 0, 0, 0},
                                         {4.001f, 0, Vec3f(0, 0, 0.05f), 0.8f, 0, 0}}};
  SimulatedDevice device({}, BenchTrocar(), script, 0);
  device.set_traction(0.6);
  std::vector<double> heights;
  for (std::uint64_t i = 0; i < 5000; ++i) {
    const TrocarPose pose = PoseFromAttachPoint(BenchTrocar(), device.ReadPosition(TickAt(i)));
    heights.push_back(pose.p_WT.z());
    device.WriteForce(ForceAtAttachPoint(pose, Vec3d(0, 0, -force_N)));
  }
  return heights;
}

TEST(SimulatedDevice, AnAssistantPullsAtFiftyMillimetresASecondForEachNewtonThatIsMissing) {
  const auto moved = [](double force_N) {
    const std::vector<double> z = HeightsUnder(force_N);
    return z[2000] - z[1000];
  };
  EXPECT_NEAR(moved(0.5), 0.005, 2e-5);
  EXPECT_NEAR(moved(0.55), 0.0025, 2e-5);
  EXPECT_NEAR(moved(0.7), -0.005, 2e-5) << "gives way to a larger force";
  EXPECT_NEAR(moved(0.1), 0.010, 2e-5) << "no faster than a careful hand";
  EXPECT_NEAR(moved(2), -0.010, 2e-5);
  EXPECT_NEAR(moved(0.022), 0.010, 2e-5);
  EXPECT_NEAR(moved(0.018), 0, 1e-6) << "does not feel it";
}

TEST(SimulatedDevice, AnAssistantPullsByTwentyFiveMillimetresAtMostAndLetsGoWithTheTimeConstant) {
  const HapticsParams hand;
  const std::vector<double> z = HeightsUnder(0.1);
  const double still = 0.05 - 0.1 / hand.hand_stiffness_N_m;
  EXPECT_NEAR(z[3990] - still, 0.025, 2e-5);
  EXPECT_NEAR((z[4501] - still) / (z[4201] - still), std::exp(-1.0), 0.01) << "0.3 s later";
}

// A grasper closes at 1 s on tissue of 40 N/m, which later gives way by 10 mm.
TEST(SimulatedDevice, AnAssistantKeepsItsTractionAndFollowsTheTissue) {
  const std::array<ScriptKey, 3> script{{{0.0f, 0, Vec3f(0, 0, 0.05f), 0.8f, 0, 0},
                                         {1.0f, 0, Vec3f(0, 0, 0.05f), 0, 0, 0},
                                         {1.5f, 0, Vec3f(0, 0, 0.055f), 0, 0, 0}}};
  const Trocar trocar = BenchTrocar();
  constexpr double kStiffness_N_m = 40, kTraction_N = 0.6;
  SimulatedDevice device({}, trocar, script, 0);
  device.set_traction(kTraction_N);
  Vec3d anchor(0, 0, 0.05);
  double force_N = 0, fastest = 0;
  Vec3d before = Vec3d::Zero();
  for (std::uint64_t i = 0; i < 9000; ++i) {
    const TrocarPose pose = PoseFromAttachPoint(trocar, device.ReadPosition(TickAt(i)));
    if (i >= 5000 && i < 6000) anchor += Vec3d(0, 0, 10e-6);
    const Vec3d pull = i < 1000 ? Vec3d(Vec3d::Zero()) : Vec3d(kStiffness_N_m * (anchor - pose.p_WT));
    device.WriteForce(ForceAtAttachPoint(pose, pull));
    force_N = pull.norm();
    if (i > 1600) fastest = std::max(fastest, (pose.p_WT - before).norm() / 1e-3);
    before = pose.p_WT;
    if (i == 4999 || i == 8999) {
      EXPECT_NEAR(force_N, kTraction_N, 0.05 * kTraction_N) << i;
    }
  }
  EXPECT_LT(fastest, 0.05) << "no jerk in the hand";
}

}  // namespace
}  // namespace fulcrum::haptics
