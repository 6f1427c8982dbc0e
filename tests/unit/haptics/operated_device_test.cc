#include "haptics_node/device/operated_device.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "haptics_node/device/simulated_device.h"
#include "services/base/core/operator_choice.h"
#include "tests/unit/haptics/node_bus.h"
#include "tests/unit/haptics/rig.h"

namespace fulcrum::haptics {
namespace {

using testing::BenchScene;
using testing::BenchTrocar;
using testing::NodeBus;
using testing::TickAt;

Vec3d Tip(const Vec3d& p_WA) { return PoseFromAttachPoint(BenchTrocar(), p_WA).p_WT; }

OperatorTool At(const Vec3f& tip) { return {tip, 0, 0, true}; }

/// Ticks from `begin` to below `end`, with a sample of the operator each 20 ms; the last tip.
Vec3d Operate(OperatedDevice* device, std::uint64_t begin, std::uint64_t end, const OperatorTool& intention) {
  Vec3d tip;
  for (std::uint64_t i = begin; i < end; ++i) {
    if (i % 20 == 0) device->Follow(intention, TickAt(i).stamp_ns);
    tip = Tip(device->ReadPosition(TickAt(i)));
  }
  return tip;
}

TEST(OperatedDevice, RestsUntilItIsOperatedAndThenComesToThePlace) {
  OperatedDevice device({}, BenchTrocar(), RestingAttachPoint(BenchTrocar()));
  const Vec3d rest = Tip(device.ReadPosition(TickAt(1)));
  EXPECT_LT((Operate(&device, 2, 500, OperatorTool()) - rest).norm(), 1e-12);
  const Vec3f wanted = rest.cast<float>() + Vec3f(0.02f, -0.01f, 0.01f);
  EXPECT_LT((Operate(&device, 500, 1500, At(wanted)) - wanted.cast<double>()).norm(), 1e-6);
}

TEST(OperatedDevice, TurnsAboutItsShaftAtBoundedSpeed) {
  OperatedDevice device({}, BenchTrocar(), RestingAttachPoint(BenchTrocar()));
  const Vec3f rest = Tip(device.ReadPosition(TickAt(1))).cast<float>();
  OperatorTool intention = At(rest);
  intention.roll_rad = 1;
  Operate(&device, 2, 60, intention);
  EXPECT_GT(device.ReadRoll(), 0.2f);
  EXPECT_LT(device.ReadRoll(), 0.6f);
  Operate(&device, 60, 400, intention);
  EXPECT_FLOAT_EQ(device.ReadRoll(), 1);
}

TEST(OperatedDevice, AnotherHandThatCountsItsTurnsAnewDoesNotTurnTheTool) {
  OperatedDevice device({}, BenchTrocar(), RestingAttachPoint(BenchTrocar()));
  OperatorTool intention = At(Tip(device.ReadPosition(TickAt(1))).cast<float>());
  intention.roll_rad = 4.7f;
  for (std::uint64_t i = 2; i < 1000; i += 20) {
    intention.roll_rad = std::min(4.7f, 0.1f * static_cast<float>(i) / 20);
    Operate(&device, i, i + 20, intention);
  }
  Operate(&device, 1000, 2000, intention);
  EXPECT_NEAR(device.ReadRoll(), intention.roll_rad, 1e-5f);
  const float turned = intention.roll_rad;
  // It takes the tool from the one that operates …
  intention.roll_rad -= 6.2831853f;
  for (std::uint64_t i = 2000; i < 2500; ++i) {
    Operate(&device, i, i + 1, intention);
    ASSERT_NEAR(std::remainder(device.ReadRoll() - turned, 6.2831853f), 0, 1e-5f) << i;
  }
  // … or finds it released.
  Operate(&device, 2500, 3000, OperatorTool());
  intention.roll_rad = turned;
  for (std::uint64_t i = 3000; i < 3500; ++i) {
    Operate(&device, i, i + 1, intention);
    ASSERT_NEAR(std::remainder(device.ReadRoll() - turned, 6.2831853f), 0, 1e-5f) << i;
  }
}

TEST(OperatedDevice, AFarPlaceIsReachedAtBoundedSpeed) {
  OperatedDevice device({}, BenchTrocar(), RestingAttachPoint(BenchTrocar()));
  Vec3d before = device.ReadPosition(TickAt(1));
  double fastest = 0;
  for (std::uint64_t i = 2; i < 1000; ++i) {
    device.Follow(At(Vec3f(5, 5, -5)), TickAt(i).stamp_ns);
    const Vec3d now = device.ReadPosition(TickAt(i));
    ASSERT_TRUE(now.allFinite());
    const double speed = (now - before).norm() / 1e-3;
    fastest = std::max(fastest, speed);
    if (i == 300) {
      EXPECT_NEAR(speed, 0.6, 0.006) << "on its way";
    }
    before = now;
  }
  EXPECT_GT(fastest, 0.3);
  EXPECT_LT(fastest, 0.9);
}

TEST(OperatedDevice, AConstantForceMovesItByForceOverStiffness) {
  const HandModel hand;
  OperatedDevice device(hand, BenchTrocar(), RestingAttachPoint(BenchTrocar()));
  const Vec3d rest = device.ReadPosition(TickAt(1));
  const OperatorTool intention = At(Tip(rest).cast<float>());
  (void)Operate(&device, 2, 100, intention);
  const Vec3d force(0.3, 0, 0);
  device.WriteForce(force);
  Vec3d now;
  for (std::uint64_t i = 100; i < 3000; ++i) {
    if (i % 20 == 0) device.Follow(intention, TickAt(i).stamp_ns);
    now = device.ReadPosition(TickAt(i));
  }
  EXPECT_LT((now - rest - force / hand.stiffness_N_m).norm(), 2e-6);
}

TEST(OperatedDevice, LetsGoWhenTheOperatorIsSilent) {
  OperatedDevice device({}, BenchTrocar(), RestingAttachPoint(BenchTrocar()));
  const Vec3d rest = Tip(device.ReadPosition(TickAt(1)));
  const Vec3f wanted = rest.cast<float>() + Vec3f(0.01f, 0, 0);
  const Vec3d reached = Operate(&device, 2, 1000, At(wanted));
  constexpr std::uint64_t kSilence_ms = kOperatorSilence_ns / 1'000'000;
  // Held for as long as a late sample may come …
  Vec3d tip;
  for (std::uint64_t i = 1000; i < 980 + kSilence_ms; ++i) tip = Tip(device.ReadPosition(TickAt(i)));
  EXPECT_LT((tip - reached).norm(), 1e-4);
  // … and then pushed by a spring of 200 N/m at the attach point, as tissue pushes it, until no force is left.
  const Vec3d held = device.ReadPosition(TickAt(980 + kSilence_ms));
  const Vec3d free = held + Vec3d(0.005, 0, 0);
  double force_N = 1;
  for (std::uint64_t i = 981 + kSilence_ms; i < 1381 + kSilence_ms; ++i) {
    const Vec3d force = 200 * (free - device.ReadPosition(TickAt(i)));
    force_N = force.norm();
    device.WriteForce(force);
  }
  EXPECT_LT(force_N, 0.1) << "400 ms later";
}

TEST(OperatedDevice, TheNodeFollowsTheOperatorAndNamesTheSampleInItsManifest) {
  const SceneView scene = BenchScene(0.3);
  NodeBus bus;
  DeviceArray devices;
  devices[0] = std::make_unique<OperatedDevice>(HandModel(), BenchTrocar(), RestingAttachPoint(BenchTrocar()));
  HapticsNode node(scene, std::move(devices), bus.ports(), 1);
  const Vec3f wanted = Tip(RestingAttachPoint(BenchTrocar())).cast<float>() + Vec3f(0.01f, 0, 0);
  OperatorInput input;
  input.source = OperatorSource::kProgram;
  input.claim_ns = TickAt(100).stamp_ns;
  input.tools[0] = At(wanted);
  ToolState tool;
  TickManifest manifest;
  std::uint64_t named = 0;
  for (std::uint64_t i = 100; i < 1100; ++i) {
    if (i % 20 == 0) {
      input.stamp = {input.stamp.sequence + 1, 7, TickAt(i).stamp_ns};
      bus.operator_out->Write(input);
    }
    node.BusStep();
    node.ServoStep(TickAt(i));
    node.BusStep();
    (void)bus.tool_in->TakeLatest(&tool);
    while (bus.manifest_in->TakeNext(&manifest)) {
      ASSERT_EQ(manifest.consumed.at(1).topic, TopicId::kOperatorInput);
      named = std::max(named, manifest.consumed[1].sequence);
    }
  }
  EXPECT_EQ(named, input.stamp.sequence);
  EXPECT_LT((tool.tools[0].p_WT - wanted).norm(), 1e-5);
  // Another source with an older claim moves nothing.
  OperatorInput other = input;
  other.stamp = {1, 8, TickAt(1100).stamp_ns};
  other.claim_ns -= 1;
  other.tools[0] = At(wanted + Vec3f(0, 0.02f, 0));
  bus.operator_out->Write(other);
  for (std::uint64_t i = 1100; i < 1200; ++i) {
    node.BusStep();
    node.ServoStep(TickAt(i));
  }
  node.BusStep();
  (void)bus.tool_in->TakeLatest(&tool);
  EXPECT_LT((tool.tools[0].p_WT - wanted).norm(), 1e-5);
}

}  // namespace
}  // namespace fulcrum::haptics
