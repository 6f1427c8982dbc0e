// Wall-clock limits of the servo on this machine. Not in the default run; see label "timing".
#include <gtest/gtest.h>

#include <chrono>
#include <string>
#include <thread>

#include "haptics_node/node/haptics_node.h"
#include "services/base/runtime/cyclic_thread.h"
#include "services/base/runtime/realtime.h"
#include "services/transport/bus/in_process.h"
#include "tests/unit/haptics/rig.h"

namespace fulcrum::haptics {
namespace {

TEST(ServoTiming, StepTakesAtMost25MicrosecondsAndCyclesStartInTime) {
  const SceneView scene = testing::BenchScene(0.3);
  bus::InProcessTopic<ContactModel> models;
  bus::InProcessTopic<OperatorInput> operators;
  bus::InProcessTopic<ToolState> tools;
  bus::InProcessTopic<TickManifest> manifests;
  const auto model_in = models.MakeInput();
  const auto operator_in = operators.MakeInput();
  const auto tool_out = tools.MakeOutput();
  const auto manifest_out = manifests.MakeOutput();
  HapticsNode node(scene, {true, true}, {*model_in, *operator_in, *tool_out, *manifest_out}, runtime::MonotonicNs());
  std::string refused;
  runtime::CyclicThread servo({.name = "servo", .period_ns = 1'000'000}, [&](const Tick& tick) {
    if (tick.index == 0) refused = runtime::SetFifoPriority(80);
    node.ServoStep(tick);
  });
  runtime::CyclicThread bus({.name = "bus", .period_ns = 1'000'000}, [&](const Tick&) { node.BusStep(); });
  bus.Start();
  servo.Start();
  std::this_thread::sleep_for(std::chrono::seconds(3));
  servo.Stop();
  if (!refused.empty()) GTEST_SKIP() << refused;
  const runtime::CyclicStats stats = servo.stats();
  EXPECT_LT(stats.step.Quantile(0.99), 25'000);
  EXPECT_LT(stats.wake.Quantile(0.99), 200'000);
  EXPECT_LT(stats.overruns, stats.ticks / 100);
}

}  // namespace
}  // namespace fulcrum::haptics
