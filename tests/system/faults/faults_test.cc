// The force on the hand while the cart goes wrong. Real processes over DDS: the servo, physics and the handles; the
// test starts the session, kills and stops physics while the tool pulls at the tissue it holds, and speaks as a second,
// broken physics.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <set>
#include <string>
#include <thread>

#include "services/bus/dds/participant.h"
#include "services/bus/input_account.h"
#include "services/core/operator_script.h"
#include "services/runtime/cyclic_thread.h"
#include "services/scene/build.h"
#include "services/scene/scene_file.h"
#include "services/scene/scene_settings.h"
#include "tests/system/faults/force_judge.h"

namespace fulcrum {
namespace {

using std::chrono::duration;
using std::chrono::milliseconds;
using std::chrono::steady_clock;

constexpr int kDomain = 97;
constexpr double kPatience_s = 20;  // Starting and rejoining on a busy machine.
constexpr double kFelt_N = 0.15;    // The pull is felt.
constexpr double kGone_N = 0.1;

class Process {
 public:
  Process(const char* name, const std::filesystem::path& folder) : pid_(::fork()) {
    if (pid_ != 0) return;
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    const std::string program = std::string(FULCRUM_BIN_DIR) + "/" + name;
    ::execl(program.c_str(), name, "--scene", (folder / "scene").c_str(), "--session", folder.c_str(), "--domain",
            std::to_string(kDomain).c_str(), nullptr);
    ::_exit(127);
  }
  ~Process() { Kill(); }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  void Signal(int signal) const { ::kill(pid_, signal); }
  void Kill() {
    if (pid_ <= 0) return;
    ::kill(pid_, SIGKILL);
    ::waitpid(pid_, nullptr, 0);
    pid_ = -1;
  }

 private:
  pid_t pid_;
};

/// The small scene with a grasper that takes the membrane and then pulls up and down for good.
scene::SceneSettings PullingScene() {
  scene::SceneSettings settings = scene::Small();
  constexpr double kOpen = 0.87;
  settings.script.clear();
  const auto key = [&](int tool, double time_s, const Vec2f& sheet, double height_m, double jaw_rad) {
    settings.script.push_back({.time_s = time_s,
                               .tool = tool,
                               .world_m = {},
                               .sheet = sheet,
                               .height_m = height_m,
                               .offset_m = Vec3f::Zero(),
                               .jaw_rad = jaw_rad,
                               .pedals = kPedalNone,
                               .power_W = 0});
  };
  const Vec2f place(0.33f, 0.5f);
  key(0, 0.0, place, 0.010, kOpen);
  key(0, 0.6, place, 0.010, kOpen);  // Physics may join late and must find the jaws open.
  key(0, 1.0, place, -0.002, kOpen);
  key(0, 1.2, place, -0.002, kOpen);
  key(0, 1.5, place, -0.002, 0);
  for (int i = 0; i < 110; ++i) key(0, 2.1 + 0.5 * i, place, i % 2 == 0 ? 0.011 : 0.009, 0);
  key(1, 0.0, Vec2f(0.58f, 0.42f), 0.020, 0);
  settings.script_duration_s = 60;
  return settings;
}

class Faults : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("faults_test." + std::to_string(::getpid()));
    std::filesystem::create_directories(folder_);
    scene::WriteSceneFile(scene::BuildProcedural(PullingScene()), "name: small\n", folder_ / "scene");
    scene_ = std::make_unique<scene::SceneFile>(folder_ / "scene");
    const ToolDescription& tool = scene_->view().tools[0];
    judge_ = std::make_unique<testing::ForceJudge>(haptics::Trocar{tool.p_WP.cast<double>(), tool.shaft_length_m});
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  void StartSession() {
    SceneManifest manifest;
    manifest.scene_name = scene_->view().name;
    manifest.session_id = "test";
    manifest.scene_hash = scene_->view().hash;
    const std::int64_t now = runtime::MonotonicNs();
    manifest.stamp = bus::Stamper(now).Next(now);
    manifest.session_start_ns = session_start_ns_ = now;
    manifests_->Write(manifest);
  }
  /// Judges what comes until `done` or for `limit_s`; whether it was done.
  bool Watch(double limit_s, const std::function<bool()>& done) {
    const auto start = steady_clock::now();
    while (duration<double>(steady_clock::now() - start).count() < limit_s) {
      while (tools_->TakeNext(&tool_)) judge_->Add(tool_);
      if (healths_->TakeNext(&heard_) && heard_.node == NodeId::kHaptics) health_ = heard_;
      if (done()) return true;
      MoveJaws();
      std::this_thread::sleep_for(milliseconds(2));
    }
    return false;
  }
  void MoveJaws() {
    if (session_start_ns_ == 0) return;
    const std::int64_t now = runtime::MonotonicNs();
    HandleState handles;
    handles.stamp = handle_stamper_.Next(now);
    for (std::uint32_t i = 0; i < kMaxTools; ++i) {
      const ScriptPoint point =
          EvaluateScript(scene_->view().script, i, 1e-9 * static_cast<double>(now - session_start_ns_));
      handles.handles[i] = {true, point.jaw_rad, 0, 1, 0};
    }
    handles_->Write(handles);
  }
  void WatchFor(double seconds) {
    (void)Watch(seconds, [] { return false; });
  }
  bool WatchUntilThePullIsFelt() {
    return Watch(kPatience_s, [&] { return judge_->state() == ServoState::kNormal && judge_->force_N() > kFelt_N; });
  }
  /// Both are up and wait for a session: the script begins for both at once.
  bool WatchUntilBothWait() {
    std::set<NodeId> waiting;
    return Watch(kPatience_s, [&] {
      if (heard_.state == HealthState::kWaiting) waiting.insert(heard_.node);
      return waiting.size() == 2;
    });
  }
  double Metric(const std::string& name) const {
    const auto it = std::find_if(health_.metrics.begin(), health_.metrics.end(),
                                 [&](const fulcrum::Metric& m) { return m.name == name; });
    return it == health_.metrics.end() ? -1 : it->value;
  }
  void SpeakAsABrokenPhysics(double seconds);

  std::filesystem::path folder_;
  std::unique_ptr<scene::SceneFile> scene_;
  std::unique_ptr<testing::ForceJudge> judge_;
  bus::DdsParticipant participant_{{.domain = kDomain, .node_name = "test", .shared_memory = {}}};
  std::unique_ptr<bus::OutputOf<SceneManifest>::type> manifests_ = participant_.MakeOutput<SceneManifest>();
  std::unique_ptr<bus::OutputOf<HandleState>::type> handles_ = participant_.MakeOutput<HandleState>();
  std::unique_ptr<bus::OutputOf<ContactModel>::type> models_ = participant_.MakeOutput<ContactModel>();
  std::unique_ptr<bus::Input<ToolState>> tools_ = participant_.MakeInput<ToolState>();
  std::unique_ptr<bus::Input<Health>> healths_ = participant_.MakeInput<Health>();
  bus::Stamper handle_stamper_{runtime::MonotonicNs()};
  std::int64_t session_start_ns_ = 0;
  ToolState tool_;
  Health heard_, health_;  ///< The newest of anybody; of haptics_node.
};

/// A spring that holds the tip where it is now, from a newer physics than the real one, which goes on speaking; its
/// messages come twice, out of order, broken, or with forces from nowhere.
void Faults::SpeakAsABrokenPhysics(double seconds) {
  bus::Stamper stamper(runtime::MonotonicNs());
  constexpr float kStiffness = 500;  // Of skin and of body.
  const Vec3f place = tool_.tools[0].p_WT - Vec3f(0, 0, 0.01f);
  ContactModel late;
  const int messages = static_cast<int>(100 * seconds);
  for (int i = 0; i < messages; ++i) {
    ContactModel model;
    model.stamp = stamper.Next(runtime::MonotonicNs());
    model.tool_sequence = tool_.stamp.sequence;
    model.tool_stamp_ns = tool_.stamp.stamp_ns;
    model.devices[0].count = 1;
    Contact& contact = model.devices[0].contacts[0];
    contact.kind = ContactKind::kGrasp;
    contact.id = 1000;
    contact.x_ref = tool_.tools[0].p_WT;
    contact.f_ref = 0.5f * kStiffness * (place - contact.x_ref);
    contact.u_c = -contact.f_ref / kStiffness;
    contact.k1 = contact.k_body = kStiffness;
    contact.b_body = 0.02f * kStiffness;
    if (i % 5 == 1) contact.f_ref.y() = std::numeric_limits<float>::quiet_NaN();
    if (i % 5 == 2) contact.k1 = 5e4f;
    if (i % 5 == 3 && i > messages / 2) contact.f_ref = Vec3f(i % 2 == 0 ? 15.0f : -15.0f, 0, 10);
    const bool swaps = i % 3 == 2;  // This one and the one before change places.
    if (i % 3 != 1) models_->Write(model);
    if (i % 4 == 0) models_->Write(model);
    WatchFor(0.003);
    if (swaps) models_->Write(late);
    late = model;
    WatchFor(0.006);
  }
}

TEST_F(Faults, TheHandIsNeverHurt) {
  const Process servo("haptics_node", folder_);
  auto physics = std::make_unique<Process>("physics_node", folder_);
  ASSERT_TRUE(WatchUntilBothWait());
  StartSession();
  ASSERT_TRUE(WatchUntilThePullIsFelt()) << "force " << judge_->force_N() << " N, state "
                                         << static_cast<int>(judge_->state()) << ", model "
                                         << tool_.tools[0].model_age_s << " s old; " << heard_.last_error;

  for (const int stall_ms : {50, 200, 1000}) {
    SCOPED_TRACE("stalled for " + std::to_string(stall_ms) + " ms");
    judge_->ResetRange();
    physics->Signal(SIGSTOP);
    WatchFor(1e-3 * stall_ms);
    physics->Signal(SIGCONT);
    if (stall_ms == 1000) {
      EXPECT_LE(judge_->least_N(), kGone_N);
    }
    ASSERT_TRUE(WatchUntilThePullIsFelt());
    EXPECT_EQ(judge_->verdict(), "");
  }

  physics->Kill();
  judge_->ResetRange();
  WatchFor(0.5);
  EXPECT_LE(judge_->force_N(), kGone_N);
  physics = std::make_unique<Process>("physics_node", folder_);
  ASSERT_TRUE(WatchUntilThePullIsFelt()) << "after the restart of physics";
  EXPECT_EQ(judge_->verdict(), "") << "physics was killed";

  judge_->ResetRange();
  SpeakAsABrokenPhysics(1.5);
  EXPECT_GT(judge_->most_N(), kFelt_N);
  WatchFor(0.6);
  EXPECT_LE(judge_->force_N(), kGone_N) << "the broken physics is gone, and the older one stays out";
  EXPECT_EQ(judge_->verdict(), "") << "a broken physics spoke";

  WatchFor(0.3);  // Health comes ten times a second.
  EXPECT_LE(Metric("peak_force_N"), 3.3);
  EXPECT_GT(Metric("models_dropped"), 10);
  EXPECT_EQ(Metric("forces_not_finite"), 0);
  const auto input = std::find_if(health_.inputs.begin(), health_.inputs.end(),
                                  [](const InputHealth& i) { return i.topic == TopicId::kContactModel; });
  ASSERT_NE(input, health_.inputs.end());
  EXPECT_GT(input->rejected, 0u);
  // The histograms of the servo's cycles are there.
  EXPECT_GT(health_.step.p50_us, 0);
  EXPECT_GE(health_.step.p99_us, health_.step.p50_us);
  EXPECT_GE(health_.step.max_us, 0.9f * health_.step.p99_us);  // Bins are 6 % wide.
  EXPECT_GT(health_.wake.p99_us, 0);
  EXPECT_GT(judge_->samples(), 3000u);
}

}  // namespace
}  // namespace fulcrum
