// The node on in-process ports, and the real-time property of its servo: no allocation, no lock.
#include "haptics_node/node/haptics_node.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <functional>
#include <iterator>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "services/base/runtime/cyclic_thread.h"
#include "tests/unit/haptics/node_bus.h"
#include "tests/unit/haptics/rig.h"
#include "tests/unit/haptics/test_tissue.h"
#include "tests/unit/runtime/allocation_guard.h"

namespace fulcrum::haptics {
namespace {

using fulcrum::testing::AllocationGuard;
using testing::BenchScene;
using testing::LatePhysics;
using testing::TestTissue;
using testing::TickAt;

const std::array<ScriptKey, 3> kScript{{{0.0f, 0, Vec3f(0, 0, 0.01f), 0, 0, 0},
                                        {1.0f, 0, Vec3f(0, 0, -0.005f), 0, 0, 0},
                                        {2.0f, 0, Vec3f(0.02f, 0, -0.005f), 0, 0, 0}}};

class HapticsNodeTest : public ::testing::Test {
 protected:
  HapticsNodeTest() : scene(BenchScene(0.3)) {
    scene.script = kScript;
    node = Make(1000);
  }
  std::unique_ptr<HapticsNode> Make(std::int64_t epoch) {
    return std::make_unique<HapticsNode>(scene, std::array<bool, kMaxTools>{true, true}, bus.ports(), epoch);
  }
  /// One millisecond of all parts; only the servo's part is guarded.
  void Step() {
    const Tick tick = TickAt(millisecond++);
    ContactModel model;
    if (physics.Step(tissue, tick.stamp_ns - 1'000'000, &model)) bus.model_out->Write(model);
    node->BusStep();
    {
      const AllocationGuard guard;
      node->ServoStep(tick);
      violations += guard.violations();
    }
    node->BusStep();
    if (bus.tool_in->TakeLatest(&tool)) tissue.Step(tool.tools[0].p_WT.cast<double>(), tick.dt_s);
  }

  SceneView scene;
  testing::NodeBus bus;
  std::unique_ptr<HapticsNode> node;
  TestTissue tissue{{}};
  LatePhysics physics;
  ToolState tool;
  std::uint64_t millisecond = 0;
  std::int64_t violations = 0;
};

TEST_F(HapticsNodeTest, ServoNeitherAllocatesNorLocks) {
  if (!AllocationGuard::active()) GTEST_SKIP() << "a sanitizer replaces malloc in this build";
  for (int i = 0; i < 4000; ++i) Step();
  EXPECT_EQ(violations, 0);
  EXPECT_GT(tool.tools[0].f_W.z(), 0.1f);  // Models did arrive and cause forces.
}

TEST_F(HapticsNodeTest, ToolsArePublishedInOrderAndPassTheBusGate) {
  std::uint64_t last = 0;
  for (int i = 1; i <= 100; ++i) {
    Step();
    EXPECT_LE(tool.stamp.sequence, last + 2);
    last = tool.stamp.sequence;
    EXPECT_EQ(tool.stamp.epoch, 1000u);
    EXPECT_GE(tool.stamp.stamp_ns, TickAt(millisecond - 1).stamp_ns - 10'000'000);
  }
  EXPECT_GT(last, 25u);
  EXPECT_EQ(bus.tool_in->stats().rejected, 0u);
}

TEST_F(HapticsNodeTest, ManifestsGiveTheTimeOfEachTick) {
  std::vector<std::int64_t> times;
  TickManifest manifest;
  for (int i = 0; i < 1000; ++i) {
    Step();
    while (bus.manifest_in->TakeNext(&manifest)) {
      ASSERT_FALSE(manifest.tick_times_ns.empty());
      EXPECT_EQ(manifest.tick_times_ns.back(), manifest.stamp.stamp_ns);
      times.insert(times.end(), manifest.tick_times_ns.begin(), manifest.tick_times_ns.end());
    }
  }
  ASSERT_GT(times.size(), 1000u - kTicksPerManifest);
  for (std::size_t i = 0; i < times.size(); ++i) EXPECT_EQ(times[i], TickAt(i).stamp_ns);
}

TEST_F(HapticsNodeTest, ManifestsTellTickHashAndModelAtAHundredHertz) {
  TickManifest manifest;
  std::vector<TickManifest> seen;
  for (int i = 0; i < 1000; ++i) {
    Step();
    while (bus.manifest_in->TakeNext(&manifest)) seen.push_back(manifest);
  }
  EXPECT_GE(seen.size(), 99u);
  EXPECT_LE(seen.size(), 105u);
  for (std::size_t i = 1; i < seen.size(); ++i) {
    EXPECT_EQ(seen[i].stamp.sequence, seen[i - 1].stamp.sequence + 1);
    EXPECT_GT(seen[i].tick, seen[i - 1].tick);
    EXPECT_LE(seen[i].tick, seen[i - 1].tick + kTicksPerManifest);
  }
  EXPECT_EQ(seen.back().node, NodeId::kHaptics);
  ASSERT_EQ(seen.back().consumed.size(), 2u);
  EXPECT_EQ(seen.back().consumed[1].sequence, 0u) << "no operator has sent anything";
  EXPECT_EQ(seen.back().consumed[0].topic, TopicId::kContactModel);
  EXPECT_GT(seen.back().consumed[0].sequence, 90u);
}

TEST_F(HapticsNodeTest, AfterARestartTheHandIsWhereTheScriptIsAndForceRisesSoftly) {
  for (int i = 0; i < 1500; ++i) Step();
  const ToolState before = tool;
  ASSERT_GT(before.tools[0].f_W.norm(), 0.1f);
  node = Make(2000);  // As after kill -9: only session time is left.
  millisecond += 300;
  Step();
  EXPECT_EQ(tool.stamp.epoch, 2000u);
  EXPECT_EQ(tool.stamp.sequence, 1u);
  EXPECT_LT((tool.tools[0].p_WT - before.tools[0].p_WT).norm(), 0.01f);
  float last = tool.tools[0].f_W.norm();
  EXPECT_EQ(last, 0.0f);
  for (int i = 0; i < 1000; ++i) {
    Step();
    const float force = tool.tools[0].f_W.norm();
    EXPECT_LE(force - last, 0.03f);
    last = force;
  }
  EXPECT_GT(last, 0.1f);
}

TEST_F(HapticsNodeTest, HealthTellsForcesAndThatPhysicsIsGone) {
  const auto metric = [&](const Health& health, const std::string& name) {
    const auto it =
        std::find_if(health.metrics.begin(), health.metrics.end(), [&](const Metric& m) { return m.name == name; });
    return it == health.metrics.end() ? -1.0 : it->value;
  };
  for (int i = 0; i < 1500; ++i) Step();
  Health health;
  health.state = HealthState::kRunning;
  node->FillHealth(&health);
  EXPECT_EQ(health.state, HealthState::kRunning);
  EXPECT_GT(metric(health, "peak_hand_force_N"), 0.1);
  EXPECT_GT(metric(health, "hand_force0_N"), 0.1);
  EXPECT_EQ(metric(health, "hand_force1_N"), -1.0) << "no device, no figure";
  EXPECT_NEAR(metric(health, "model_age_ms"), 15, 10);
  EXPECT_LE(health.metrics.size(), 16u);

  physics.stalled = true;
  for (int i = 0; i < 1000; ++i) Step();
  Health later;
  later.state = HealthState::kRunning;
  node->FillHealth(&later);
  EXPECT_EQ(later.state, HealthState::kDegraded);
  EXPECT_NE(later.last_error.find("contact model"), std::string::npos);
  EXPECT_EQ(metric(later, "hand_force0_N"), 0.0);
  EXPECT_GE(metric(later, "peak_hand_force_N"), metric(health, "peak_hand_force_N"));
}

TEST_F(HapticsNodeTest, HealthTellsHowOldThePoseBehindAForceIs) {
  for (int i = 0; i < 1000; ++i) Step();
  Health health;
  node->FillHealth(&health);
  std::vector<double> told_ms;
  for (const Metric& metric : health.metrics) {
    if (metric.name.starts_with("motion_to_force_")) told_ms.push_back(metric.value);
  }
  ASSERT_EQ(told_ms.size(), 3u);
  const double delay_ms = 1e-6 * static_cast<double>(physics.latency_ns);
  EXPECT_GE(told_ms.front(), delay_ms);
  EXPECT_LE(told_ms.back(), delay_ms + 3);
}

TEST_F(HapticsNodeTest, RestsWhileNothingMovesAndNothingIsNear) {
  const Vec3f place(0, 0, 0.02f);
  const std::array<ScriptKey, 3> late{
      {{0.0f, 0, place, 0, 0, 0}, {0.5f, 0, place, 0, 0, 0}, {1.0f, 0, {0, 0, 0.01f}, 0, 0, 0}}};
  scene.script = late;
  node = Make(1000);
  std::vector<std::uint64_t> rested;
  for (std::uint64_t ms = 0; ms < 700; ++ms) {
    if (ms == 400 || ms == 410) {
      ContactModel model;
      model.stamp = {ms, 1, TickAt(ms - 1).stamp_ns};
      model.tool_stamp_ns = TickAt(ms - 1).stamp_ns;
      model.physics_dt_s = 0.01f;
      model.devices[0].count = ms == 400 ? 1 : 0;
      bus.model_out->Write(model);
    }
    node->BusStep();
    node->ServoStep(TickAt(ms));
    node->BusStep();
    if (node->rests()) rested.push_back(ms);
  }
  ASSERT_FALSE(rested.empty());
  EXPECT_GE(rested.front(), 100u);
  EXPECT_LT(rested.back(), 502u) << "it moves";
  EXPECT_EQ(std::count_if(rested.begin(), rested.end(), [](std::uint64_t ms) { return ms >= 400 && ms < 410; }), 0);
  EXPECT_GT(rested.size(), 350u);
}

TEST_F(HapticsNodeTest, TheServoOfASimulatedHandRestsUntilItMoves) {
  const Vec3f place(0, 0, 0.02f);
  const std::array<ScriptKey, 3> late{
      {{0.0f, 0, place, 0, 0, 0}, {0.5f, 0, place, 0, 0, 0}, {1.0f, 0, {0, 0, 0.01f}, 0, 0, 0}}};
  scene.script = late;
  const auto published = bus.tools.MakeInput(1024);
  const auto run = [&](bool omits) {
    node = Make(1000);
    std::uint64_t steps = 0;
    for (std::uint64_t ms = 0; ms < 600; ++ms, ++steps) {
      node->BusStep();
      node->ServoStep(TickAt(ms));
      node->BusStep();
      const std::int64_t rest_ns = node->ServoRestsUntil() - TickAt(ms).stamp_ns;
      EXPECT_LE(rest_ns, ToolThinner::kLongRest_ns);
      if (omits && rest_ns > 1'000'000) ms += static_cast<std::uint64_t>((rest_ns - 1) / 1'000'000);
    }
    EXPECT_EQ(omits, steps < 250) << steps;
    ToolState state;
    std::vector<ToolState> states;
    while (published->TakeNext(&state)) states.push_back(state);
    return states;
  };
  const std::vector<ToolState> all = run(false), few = run(true);
  const auto moved = [&](const std::vector<ToolState>& states) {
    return std::ranges::find_if(states, [&](const ToolState& s) { return s.tools[0].p_WT != place; });
  };
  ASSERT_NE(moved(all), all.end());
  ASSERT_NE(moved(few), few.end());
  EXPECT_EQ(moved(few)->stamp.stamp_ns, moved(all)->stamp.stamp_ns) << "the first motion is as early";
  EXPECT_EQ(moved(few)->tools[0].p_WT, moved(all)->tools[0].p_WT);
  EXPECT_EQ(std::prev(moved(few))->stamp.stamp_ns, std::prev(moved(all))->stamp.stamp_ns);
  EXPECT_EQ(few.back().tools[0].p_WT, all.back().tools[0].p_WT);
}

TEST_F(HapticsNodeTest, AContactWakesTheServoAndATouchNeverLetsItRest) {
  const std::array<ScriptKey, 1> still{{{0.0f, 0, {0, 0, 0.02f}, 0, 0, 0}}};
  scene.script = still;
  node = Make(1000);
  std::uint64_t ms = 0;
  for (; ms < 200; ++ms) {
    node->ServoStep(TickAt(ms));
    node->BusStep();
  }
  EXPECT_GT(node->ServoRestsUntil(), TickAt(ms - 1).stamp_ns);
  ContactModel model;
  model.stamp = {1, 1, TickAt(ms - 1).stamp_ns};
  model.tool_stamp_ns = TickAt(ms - 1).stamp_ns;
  model.physics_dt_s = 0.01f;
  bus.model_out->Write(model);
  node->BusStep();
  EXPECT_FALSE(node->servo_bell()->WaitUntil(0)) << "no contact, nothing to feel";
  model.stamp.sequence = 2;
  model.devices[0].count = 1;
  bus.model_out->Write(model);
  node->BusStep();
  EXPECT_TRUE(node->servo_bell()->WaitUntil(0));
  EXPECT_EQ(node->ServoRestsUntil(), TickAt(ms - 1).stamp_ns);
}

/// Time that the bus thread rests [ms], while the servo takes the ticks from `begin` on.
double RestOf(HapticsNode* node, const std::function<void()>& meanwhile) {
  const std::int64_t begin = runtime::MonotonicNs();
  std::jthread other(meanwhile);
  node->Rest();
  return 1e-6 * static_cast<double>(runtime::MonotonicNs() - begin);
}

TEST_F(HapticsNodeTest, ARestEndsWhenAToolMovesOrAMessageArrivesOrASampleIsDue) {
  const Vec3f place(0, 0, 0.02f);
  const std::array<ScriptKey, 3> late{
      {{0.0f, 0, place, 0, 0, 0}, {0.5f, 0, place, 0, 0, 0}, {1.0f, 0, {0, 0, 0.01f}, 0, 0, 0}}};
  scene.script = late;
  const auto published = bus.tools.MakeInput(1024);
  node = Make(1000);
  // Stamps of the future: the next sample is due in half a minute, so nothing but an event ends a rest sooner.
  const std::int64_t later_ns = runtime::MonotonicNs() + 30'000'000'000;
  const auto tick_at = [later_ns](std::uint64_t ms) {
    Tick tick = TickAt(ms);
    tick.stamp_ns += later_ns;
    return tick;
  };
  std::uint64_t ms = 0;
  for (; ms < 400 || !node->rests(); ++ms) {
    ASSERT_LT(ms, 450u);
    node->BusStep();
    node->ServoStep(tick_at(ms));
  }
  const double by_message = RestOf(node.get(), [&] {
    for (const std::uint64_t end = ms + 9; ms < end; ++ms) node->ServoStep(tick_at(ms));  // Nothing moves.
    std::this_thread::sleep_for(std::chrono::milliseconds(30));
    bus.bell->Ring();
  });
  EXPECT_GE(by_message, 30) << "ticks without motion end no rest";
  node->BusStep();
  ToolState state;
  while (published->TakeNext(&state)) {
  }
  const double by_motion = RestOf(node.get(), [&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    for (; ms < 515; ++ms) node->ServoStep(tick_at(ms));
  });
  EXPECT_LT(by_motion, 5'000);
  node->BusStep();
  EXPECT_FALSE(node->rests());
  // A reader that interpolates between the last sample at rest and the first moved one does not begin too early.
  std::vector<ToolState> states;
  while (published->TakeNext(&state)) states.push_back(state);
  const auto moved = std::ranges::find_if(states, [&](const ToolState& s) { return s.tools[0].p_WT != place; });
  ASSERT_NE(moved, states.end());
  ASSERT_NE(moved, states.begin());
  EXPECT_GE(std::prev(moved)->stamp.stamp_ns, tick_at(499).stamp_ns - 1'000'000);
  EXPECT_LT(moved->stamp.stamp_ns, tick_at(510).stamp_ns);
}

TEST_F(HapticsNodeTest, ARestIsNoLongerThanUntilTheNextSample) {
  const std::array<ScriptKey, 1> still{{{0.0f, 0, {0, 0, 0.02f}, 0, 0, 0}}};
  scene.script = still;
  node = Make(1000);
  const std::int64_t now_ns = runtime::MonotonicNs();
  for (std::uint64_t ms = 0; ms < 400; ++ms) {
    Tick tick = TickAt(ms);
    tick.stamp_ns = now_ns + static_cast<std::int64_t>(ms) * 1'000'000;
    node->ServoStep(tick);
    node->BusStep();
  }
  ASSERT_TRUE(node->rests());
  (void)RestOf(node.get(), [] {});
  // Not before the newest tick; the next sample is at most 40 ms after it.
  EXPECT_GE(runtime::MonotonicNs(), now_ns + 399'000'000);
  EXPECT_LT(1e-6 * static_cast<double>(runtime::MonotonicNs() - now_ns), 5'000);
}

TEST_F(HapticsNodeTest, WhatDoesNotPassTheGateIsCounted) {
  for (int i = 0; i < 50; ++i) Step();
  physics.stalled = true;
  ContactModel model;
  model.stamp = {100000, 1, TickAt(millisecond).stamp_ns};
  model.tool_stamp_ns = TickAt(millisecond).stamp_ns - 1'000'000;
  model.devices[0].count = 1;
  model.devices[0].contacts[0] = tissue.Report();
  model.devices[0].contacts[0].k1 = 5e4f;  // Finite, so the bus accepts it; too stiff for the servo.
  bus.model_out->Write(model);
  Step();
  Step();
  Health health;
  node->FillHealth(&health);
  const auto dropped = std::find_if(health.metrics.begin(), health.metrics.end(),
                                    [](const Metric& m) { return m.name == "models_dropped"; });
  ASSERT_NE(dropped, health.metrics.end());
  EXPECT_EQ(dropped->value, 1.0);
}

}  // namespace
}  // namespace fulcrum::haptics
