// The handle_bridge executable on the real bus: joins a session, survives kill -9, goes on where the script is.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <thread>

#include "services/bus/dds/participant.h"
#include "services/bus/input_account.h"
#include "services/core/operator_script.h"
#include "services/runtime/cyclic_thread.h"
#include "services/scene/build.h"
#include "services/scene/scene_file.h"
#include "services/scene/scene_settings.h"

namespace fulcrum {
namespace {

constexpr int kDomain = 47;

class BridgeProcess {
 public:
  BridgeProcess(const std::filesystem::path& scene, const std::filesystem::path& session) : pid_(::fork()) {
    if (pid_ == 0) {
      ::execl(FULCRUM_BIN_DIR "/handle_bridge", "handle_bridge", "--scene", scene.c_str(), "--session", session.c_str(),
              "--domain", std::to_string(kDomain).c_str(), nullptr);
      ::_exit(127);
    }
  }
  ~BridgeProcess() { End(SIGKILL); }
  /// Exit status, or minus the signal.
  int End(int signal) {
    if (pid_ <= 0) {
      return 0;
    }
    ::kill(pid_, signal);
    int status = 0;
    ::waitpid(pid_, &status, 0);
    pid_ = -1;
    return WIFSIGNALED(status) ? -WTERMSIG(status) : WEXITSTATUS(status);
  }

 private:
  pid_t pid_;
};

class HandleProcess : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("handle_process_test." + std::to_string(::getpid()));
    std::filesystem::create_directories(folder_);
    data_ = scene::BuildProcedural(scene::Small());
    scene::WriteSceneFile(data_, "name: small\n", folder_ / "scene");
    scene_ = std::make_unique<scene::SceneFile>(folder_ / "scene");
    manifest_.scene_name = scene_->view().name;
    manifest_.session_id = "test";
    manifest_.scene_hash = scene_->view().hash;
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  /// Session time 0 is `ago_s` in the past.
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
};

TEST_F(HandleProcess, JoinsASessionIsKilledAndGoesOnWithTheScript) {
  BridgeProcess first(folder_ / "scene", folder_);
  StartSession(3.0);
  const auto present = [](const HandleState& s) { return s.handles[0].present && s.handles[1].present; };
  ASSERT_TRUE(WaitFor(present));
  const std::uint64_t epoch = state_.stamp.epoch;
  EXPECT_EQ(first.End(SIGKILL), -SIGKILL);

  BridgeProcess second(folder_ / "scene", folder_);
  ASSERT_TRUE(WaitFor([&](const HandleState& s) { return s.stamp.epoch > epoch && present(s); }));
  // From its first sample on the angle is the script's: no trace of the script's beginning.
  for (int i = 0; i < 100; ++i) {
    for (std::uint32_t tool = 0; tool < kMaxTools; ++tool) {
      EXPECT_NEAR(state_.handles[tool].jaw_angle_rad, TruthAt(state_.stamp.stamp_ns, tool), 0.1);
    }
    ASSERT_TRUE(WaitFor([](const HandleState&) { return true; }));
  }
  Health health;
  bool running = false;
  for (int i = 0; i < 2000 && !running; ++i) {
    running = healths_->TakeLatest(&health) && health.node == NodeId::kHandleBridge &&
              health.state == HealthState::kRunning && health.rate_achieved_Hz > 300;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  EXPECT_TRUE(running) << health.last_error;
  EXPECT_EQ(health.last_error, "");
  EXPECT_EQ(second.End(SIGTERM), 0);
}

TEST_F(HandleProcess, BadCartEndsWithTheUsageCode) {
  const pid_t pid = ::fork();
  if (pid == 0) {
    ::execl(FULCRUM_BIN_DIR "/handle_bridge", "handle_bridge", "--scene", (folder_ / "scene").c_str(), "--session",
            folder_.c_str(), "--domain", "47", "--cart", "/nonexistent.yaml", nullptr);
    ::_exit(127);
  }
  int status = 0;
  ::waitpid(pid, &status, 0);
  EXPECT_EQ(WEXITSTATUS(status), 2);
}

}  // namespace
}  // namespace fulcrum
