// The handle_bridge executable on the real bus: joins a session, survives kill -9, resumes at the script's current
// position.
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "services/base/core/operator_script.h"
#include "services/base/runtime/cyclic_thread.h"
#include "services/scene/builder/build.h"
#include "services/scene/builder/scene_settings.h"
#include "services/scene/format/scene_file.h"
#include "services/transport/bus/dds/participant.h"
#include "services/transport/bus/input_account.h"
#include "tests/support/program.h"

namespace fulcrum {
namespace {

using testing::Program;

constexpr int kDomain = 47;

Program Bridge(const std::vector<std::string>& words, const std::string& input = "") {
  return Program("handle_bridge", words, input);
}

class HandleProcess : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("handle_process_test." + std::to_string(::getpid()));
    std::filesystem::create_directories(folder_);
    ::setenv("XDG_STATE_HOME", (folder_ / "state").c_str(), 1);
    data_ = scene::BuildProcedural(scene::Small());
    scene::WriteSceneFile(data_, "name: small\n", folder_ / "scene");
    scene_ = std::make_unique<scene::SceneFile>(folder_ / "scene");
    manifest_.scene_name = scene_->view().name;
    manifest_.session_id = "test";
    manifest_.scene_hash = scene_->view().hash;
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::vector<std::string> NodeWords(const std::string& cart = "") const {
    std::vector<std::string> words = {"--scene", folder_ / "scene", "--session",
                                      folder_,   "--domain",        std::to_string(kDomain)};
    if (!cart.empty()) {
      words.insert(words.end(), {"--cart", cart});
    }
    return words;
  }
  std::string WriteCart(const std::string& text, const std::string& name = "cart.yaml") const {
    std::ofstream(folder_ / name) << text;
    return folder_ / name;
  }
  /// Waits for a Health of the bridge.
  bool WaitForHealth(const std::function<bool(const Health&)>& condition) {
    for (int i = 0; i < 4000; ++i) {
      while (healths_->TakeNext(&health_)) {
        if (health_.node == NodeId::kHandleBridge && condition(health_)) {
          return true;
        }
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return false;
  }
  bool WaitForError(const std::string& error) {
    return WaitForHealth([&](const Health& h) { return h.last_error.rfind(error, 0) == 0; });
  }
  static double MetricOf(const Health& health, const std::string& name) {
    for (const Metric& metric : health.metrics) {
      if (metric.name == name) {
        return metric.value;
      }
    }
    return -1;
  }

  /// Waits until the bridge waits for a session: what it takes to start is then no part of the session's time.
  bool WaitForWaiting() {
    return WaitForHealth([](const Health& h) { return h.state == HealthState::kWaiting; });
  }
  /// Starts a session `ago_s` in the past.
  void StartSession(double ago_s) {
    const std::int64_t now = runtime::MonotonicNs();
    manifest_.stamp = stamper_.Next(now);
    manifest_.session_start_ns = now - static_cast<std::int64_t>(1e9 * ago_s);
    manifests_->Write(manifest_);
  }
  double TruthAt(std::int64_t stamp_ns, std::uint32_t tool) const {
    return EvaluateScript(scene_->view().script, tool,
                          1e-9 * static_cast<double>(stamp_ns - manifest_.session_start_ns))
        .jaw_rad;
  }
  bool WaitFor(const std::function<bool(const HandleState&)>& condition) {
    for (int i = 0; i < 10000; ++i) {
      if (states_->TakeLatest(&state_) && condition(state_)) {
        return true;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    return false;
  }

  std::filesystem::path folder_;
  scene::SceneData data_;
  std::unique_ptr<scene::SceneFile> scene_;
  bus::DdsParticipant participant_{{.domain = kDomain, .node_name = "test", .shared_memory = {}}};
  std::unique_ptr<bus::OutputOf<SceneManifest>::type> manifests_ = participant_.MakeOutput<SceneManifest>();
  std::unique_ptr<bus::Input<HandleState>> states_ = participant_.MakeInput<HandleState>();
  std::unique_ptr<bus::Input<Health>> healths_ = participant_.MakeInput<Health>();
  bus::Stamper stamper_{runtime::MonotonicNs()};
  SceneManifest manifest_;
  HandleState state_;
  Health health_;
};

TEST_F(HandleProcess, JoinsASessionIsKilledAndGoesOnWithTheScript) {
  Program first = Bridge(NodeWords());
  StartSession(3.0);
  const auto present = [](const HandleState& s) { return s.handles[0].present && s.handles[1].present; };
  ASSERT_TRUE(WaitFor(present));
  const std::uint64_t epoch = state_.stamp.epoch;
  EXPECT_EQ(first.End(SIGKILL), -SIGKILL);

  Program second = Bridge(NodeWords());
  ASSERT_TRUE(WaitFor([&](const HandleState& s) { return s.stamp.epoch > epoch && present(s); }));
  // From the first sample on the angle is that of the script now, not that of its beginning.
  for (int i = 0; i < 100; ++i) {
    for (std::uint32_t tool = 0; tool < kMaxTools; ++tool) {
      EXPECT_NEAR(state_.handles[tool].jaw_angle_rad, TruthAt(state_.stamp.stamp_ns, tool), 0.1);
    }
    ASSERT_TRUE(WaitFor([](const HandleState&) { return true; }));
  }
  // It steps at its rate: periods that a busy machine takes from it are counted as skipped, once the next one runs.
  ASSERT_TRUE(WaitForHealth([](const Health& h) { return h.state == HealthState::kRunning; })) << health_.last_error;
  const Health before = health_;
  double rate_Hz = 0;
  EXPECT_TRUE(WaitForHealth([&](const Health& h) {
    const double elapsed_s = 1e-9 * static_cast<double>(h.stamp.stamp_ns - before.stamp.stamp_ns);
    rate_Hz = static_cast<double>(h.ticks + h.overruns - before.ticks - before.overruns) / elapsed_s;
    return elapsed_s > 1 && std::abs(rate_Hz - 400) < 20;
  })) << rate_Hz
      << " Hz";
  EXPECT_EQ(health_.last_error, "");
  EXPECT_EQ(second.End(SIGTERM), 0);
}

TEST_F(HandleProcess, BadCartEndsWithTheUsageCode) {
  Program bridge = Bridge(NodeWords("/nonexistent.yaml"));
  EXPECT_EQ(bridge.End(0), 2);
  EXPECT_NE(bridge.Said().find("/nonexistent.yaml"), std::string::npos) << bridge.Said();
}

TEST_F(HandleProcess, CalibrationInTheHandIsStoredAndUsedUnlessRefused) {
  // The refused calibrations run beside the valid one, because they take long.
  ::setenv("XDG_STATE_HOME", (folder_ / "refused").c_str(), 1);
  const std::string silent = WriteCart("handles: {tool1: {simulated: {silent_s: [0, 99]}}}", "silent.yaml");
  const std::string noisy = WriteCart("handles: {tool0: {simulated: {noise_mV: 10}}}", "noisy.yaml");
  const std::string absent = WriteCart("handles: {tool0: {kind: none}}", "absent.yaml");
  // The other handles and the pedal of this cart are simulated.
  const std::string unplugged = WriteCart("handles: {tool0: {kind: serial, port: /nonexistent}}", "unplugged.yaml");
  const std::string buttons = WriteCart("handles: {tool0: {kind: buttons}}", "buttons.yaml");
  const std::string operated = WriteCart("handles: {tool0: {kind: operator}}", "operated.yaml");
  struct Case {
    Program process;
    int exit_code;
    const char* said;
  };
  // One line for each point, and one more for the second try of a refused one.
  std::array<Case, 11> cases = {{
      {Bridge({"calibrate", "--cart", silent, "--tool", "1"}, "\n"), 1, "refused: no-data: no bytes"},
      {Bridge({"calibrate", "--cart", noisy}, "\n"), 1, "refused: too noisy"},
      {Bridge({"calibrate", "--angles", "10,12"}, "\n\n"), 1, "refused: too few counts apart"},
      {Bridge({"calibrate", "--cart", absent}), 2, "the cart has no handle there"},
      {Bridge({"calibrate", "--cart", unplugged}, "\n"), 1, "refused: no-port: "},
      {Bridge({"calibrate", "--cart", buttons}), 2, "no jaw to measure; valid kinds: serial, simulated"},
      {Bridge({"calibrate", "--cart", operated}), 2, "no jaw to measure; valid kinds: serial, simulated"},
      {Bridge({"calibrate", "--angles", "0,30,60,30"}), 2, "'30' is given twice"},
      {Bridge({"calibrate", "--tool", "5"}), 2, "--tool 5: valid: 0 to 3"},
      {Bridge({"calibrate", "--angles", "10"}), 2, "valid: 2 to 9"},
      {Bridge({"calibrate", "--help"}), 0, "For each angle, set the jaw to it"},
  }};
  ::setenv("XDG_STATE_HOME", (folder_ / "state").c_str(), 1);
  // A potentiometer with an offset of 10 mV, 9 % too long and bent by 3 %: 2 deg wrong at 50 deg with the cart's line.
  const std::string cart = WriteCart(
      "handles: {tool0: {simulated: {protocol: framed, closed_V: 2.36, open_V: 2.545, bow_percent: 3, "
      "tremor_deg: 0.25}}}");
  // More lines than points: on a busy machine a point may have to be repeated.
  Program good = Bridge({"calibrate", "--cart", cart}, "\n\n\n\n\n\n\n\n");
  EXPECT_EQ(good.End(0), 0);
  EXPECT_NE(good.Said().find("stored for simulated-tool0"), std::string::npos) << good.Said();
  for (Case& c : cases) {
    EXPECT_EQ(c.process.End(0), c.exit_code) << c.process.Said();
    EXPECT_NE(c.process.Said().find(c.said), std::string::npos) << c.process.Said();
  }
  EXPECT_FALSE(std::filesystem::exists(folder_ / "refused"));

  Program node = Bridge(NodeWords(cart));
  ASSERT_TRUE(WaitForWaiting()) << node.Said();
  StartSession(5.5);  // The jaw is open: at 0 deg clamping to the calibrated range hides the error.
  ASSERT_TRUE(WaitForHealth([](const Health& h) {
    return MetricOf(h, "calibration0_points") == 5 && MetricOf(h, "quality0") > 0.9;
  })) << health_.last_error;
  EXPECT_EQ(MetricOf(health_, "calibration1_points"), 0);
  double squares = 0;
  constexpr int kSamples = 200;
  for (int i = 0; i < kSamples; ++i) {
    ASSERT_TRUE(WaitFor([](const HandleState&) { return true; }));
    ASSERT_GT(TruthAt(state_.stamp.stamp_ns, 0), 0.6);
    squares += std::pow(state_.handles[0].jaw_angle_rad - TruthAt(state_.stamp.stamp_ns, 0), 2);
  }
  EXPECT_LT(std::sqrt(squares / kSamples), 0.02);
}

TEST_F(HandleProcess, FaultsOfTheCartAreNamedAndMendedOnTheRunningNode) {
  const std::string cart = WriteCart(
      "handles:\n"
      "  tool0: {simulated: {protocol: framed, unplugged_s: [0.5, 2]}}\n"
      "  tool1: {simulated: {broken_wire_s: [2.5, 4]}}\n"
      "pedal: {simulated: {protocol: framed, garbage_s: [4.5, 6]}}\n");
  Program node = Bridge(NodeWords(cart));
  ASSERT_TRUE(WaitForWaiting()) << node.Said();
  StartSession(0.0);
  EXPECT_TRUE(WaitForError("handle 0: no-port")) << health_.last_error;
  EXPECT_TRUE(WaitForError("handle 1: wire")) << health_.last_error;
  EXPECT_TRUE(WaitForError("pedal: garbage")) << health_.last_error;
  EXPECT_TRUE(WaitForHealth([](const Health& h) {
    return h.last_error.empty() && MetricOf(h, "quality0") > 0.9 && MetricOf(h, "quality1") > 0.9;
  })) << health_.last_error;
  EXPECT_EQ(MetricOf(health_, "reconnects"), 1);
}

}  // namespace
}  // namespace fulcrum
