#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <limits>
#include <set>
#include <string>

#include "services/base/core/error.h"
#include "services/nodes/app/health_report.h"
#include "services/nodes/app/node_app.h"
#include "services/nodes/app/node_confinement.h"
#include "services/nodes/app/physics_rate.h"

namespace fulcrum::app {
namespace {

constexpr std::int64_t kMs = 1'000'000;

ParsedOptions Parse(const std::vector<const char*>& words) {
  std::vector<const char*> argv{"physics_node"};
  argv.insert(argv.end(), words.begin(), words.end());
  return ParseNodeOptions(static_cast<int>(argv.size()), argv.data(), NodeId::kPhysics, "Tissue.");
}

void ExpectRefused(const std::vector<const char*>& words, const std::string& expected) {
  try {
    (void)Parse(words);
    FAIL() << "accepted, expected: " << expected;
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find(expected), std::string::npos) << error.what();
  }
}

TEST(NodeOptionsTest, ReadsTheCommonOptionsAndLeavesTheRest) {
  ParsedOptions parsed =
      Parse({"--scene", "a.fulcrum", "--session", "out/x", "--domain", "12", "--cart", "c.yaml", "--window"});
  EXPECT_TRUE(parsed.answer.empty());
  EXPECT_EQ(parsed.options.scene, "a.fulcrum");
  EXPECT_EQ(parsed.options.session, "out/x");
  EXPECT_EQ(parsed.options.domain, 12);
  EXPECT_EQ(parsed.options.cart, "c.yaml");
  EXPECT_EQ(parsed.options.extra, std::vector<std::string>{"--window"});
  EXPECT_TRUE(parsed.options.TakeFlag("--window"));
  EXPECT_FALSE(parsed.options.TakeFlag("--window"));
  EXPECT_TRUE(parsed.options.extra.empty());
}

TEST(NodeOptionsTest, TakesValuesOfOptionsOfTheNode) {
  NodeOptions options;
  options.extra = {"--quality", "low", "--window", "--other=1"};
  EXPECT_EQ(options.TakeValue("--quality", "auto"), "low");
  EXPECT_EQ(options.TakeValue("--quality", "auto"), "auto");
  EXPECT_EQ(options.TakeValue("--other", ""), "1");
  EXPECT_EQ(options.extra, std::vector<std::string>{"--window"});
  options.extra = {"--quality"};
  EXPECT_THROW(static_cast<void>(options.TakeValue("--quality", "auto")), InputError);
}

TEST(NodeOptionsTest, RefusesWhatCannotWork) {
  ExpectRefused({"--session", "x"}, "--scene is missing");
  ExpectRefused({"--scene", "x"}, "--session is missing");
  ExpectRefused({"--scene", "x", "--session", "y", "--domain", "0"}, "1 to 100");
  ExpectRefused({"--scene", "x", "--session", "y", "--domain", "101"}, "1 to 100");
  ExpectRefused({"--scene", "x", "--session", "y", "--domain", "seven"}, "domain");
}

TEST(NodeOptionsTest, HelpAndVersionNeedNothingElse) {
  EXPECT_NE(Parse({"--help"}).answer.find("--session"), std::string::npos);
  EXPECT_EQ(Parse({"--version"}).answer.find("physics_node "), 0u);
}

TEST(PhysicsRateTest, IsThatOfTheScenesSteps) {
  SceneView scene;
  config::CartConfig cart;
  EXPECT_NO_THROW(CheckPhysicsRate(scene, cart));
  scene.physics.dt_s = 0.02f;
  try {
    CheckPhysicsRate(scene, cart);
    FAIL() << "the tissue would run at twice its speed";
  } catch (const InputError& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("physics.dt_ms is 20,"), std::string::npos) << text;
    EXPECT_NE(text.find("physics_node at 100 Hz"), std::string::npos) << text;
    EXPECT_NE(text.find("physics.dt_ms to 10 "), std::string::npos) << text;
    EXPECT_NE(text.find("nodes.physics_node.rate_Hz to 50 "), std::string::npos) << text;
  }
  double& rate_Hz = cart.nodes[static_cast<std::size_t>(NodeId::kPhysics)].rate_Hz;
  rate_Hz = 50;
  EXPECT_NO_THROW(CheckPhysicsRate(scene, cart));
  scene.physics.dt_s = 0.003f;
  rate_Hz = 333.3;
  EXPECT_NO_THROW(CheckPhysicsRate(scene, cart)) << "a rate in four digits";
  rate_Hz = 330;
  EXPECT_THROW(CheckPhysicsRate(scene, cart), InputError);
}

TEST(NodeConfinementTest, DrawsWithAGpuOfAnyNumber) {
  namespace fs = std::filesystem;
  const fs::path dev = fs::path(testing::TempDir()) / "app_test_dev";
  fs::create_directories(dev / "nvidia-caps");
  fs::create_directories(dev / "dri");
  for (const char* file : {"nvidia3", "nvidia12", "nvidiactl", "dxg", "null", "mem"}) std::ofstream(dev / file) << "";
  std::set<std::string> names;
  for (const fs::path& device : GraphicsDevices(dev)) names.insert(device.filename());
  fs::remove_all(dev);
  EXPECT_EQ(names, (std::set<std::string>{"dri", "dxg", "nvidia-caps", "nvidia12", "nvidia3", "nvidiactl"}));
  EXPECT_TRUE(GraphicsDevices(dev / "nothing").empty());
}

TEST(RateMeterTest, ShowsTheLastSecondOnly) {
  RateMeter meter;
  EXPECT_EQ(meter.Observe(0, 0), 0);
  std::uint64_t count = 0;
  double rate = 0;
  for (int i = 1; i <= 20; ++i) {
    count += 10;
    rate = meter.Observe(i * 100 * kMs, count);
  }
  EXPECT_NEAR(rate, 100, 1e-9);
  for (int i = 21; i <= 31; ++i) {
    rate = meter.Observe(i * 100 * kMs, count);
  }
  EXPECT_EQ(rate, 0);
}

TEST(HealthReportTest, GathersThreadInputsAndOutputs) {
  HealthReport report(NodeId::kThermal, 10 * kMs, 11, 22, 33);
  runtime::Histogram step;
  for (int i = 0; i < 100; ++i) {
    step.Add(2 * kMs);
  }
  runtime::CyclicStats thread;
  thread.ticks = 100;
  thread.overruns = 4;
  thread.step = step.snapshot();
  bus::InputStats fresh{.matched = true, .received = 50, .lost = 2, .rejected = 1, .newest_stamp_ns = 990 * kMs};
  bus::InputStats none;
  bus::OutputStats out{.written = 10, .failed = 3};
  const Health health =
      report.Make(1000 * kMs, HealthState::kRunning, thread,
                  {{TopicId::kCauteryContact, [&] { return fresh; }}, {TopicId::kTissueFrame, [&] { return none; }}},
                  {[&] { return out; }, [&] { return out; }});
  EXPECT_EQ(health.node, NodeId::kThermal);
  EXPECT_EQ(health.pid, 33);
  EXPECT_EQ(health.schema_hash, 11u);
  EXPECT_EQ(health.scene_hash, 22u);
  EXPECT_EQ(health.overruns, 4u);
  EXPECT_FLOAT_EQ(health.rate_asked_Hz, 100);
  EXPECT_NEAR(health.step.p50_us, 2000, 2000 / 16.0);
  EXPECT_EQ(health.write_failures, 6u);
  ASSERT_EQ(health.inputs.size(), 2u);
  EXPECT_FLOAT_EQ(health.inputs[0].age_ms, 10);
  EXPECT_EQ(health.inputs[0].lost, 2u);
  EXPECT_LT(health.inputs[1].age_ms, 0) << "no sample yet";
}

TEST(HealthReportTest, FitsToTheMessage) {
  Health health;
  health.inputs.resize(20);
  for (int i = 0; i < 30; ++i) {
    health.metrics.push_back({std::string(100, 'm'), std::numeric_limits<double>::quiet_NaN()});
  }
  health.last_error = std::string(1000, 'e');
  FitToMessage(&health);
  EXPECT_EQ(health.inputs.size(), 16u);
  EXPECT_EQ(health.metrics.size(), 28u);
  EXPECT_EQ(health.metrics[0].name.size(), 31u);
  EXPECT_EQ(health.metrics[0].value, 0);
  EXPECT_EQ(health.last_error.size(), 255u);
}

}  // namespace
}  // namespace fulcrum::app
