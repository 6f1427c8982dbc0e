// The force on the hand under faults of the cart: the built-in scene under the supervisor with all its nodes except
// render_node, jaws through a pty. While the tool pulls at held tissue, physics is stopped, killed and restarted by the
// supervisor, and the test publishes as a second, broken physics. Every ToolState of the servo's 1 kHz is checked.
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <memory>
#include <sstream>
#include <string>
#include <thread>

#include "services/base/runtime/cyclic_thread.h"
#include "services/scene/compiler/scene_yaml.h"
#include "services/transport/bus/dds/participant.h"
#include "services/transport/bus/input_account.h"
#include "tests/support/cart.h"
#include "tests/support/force_judge.h"
#include "tests/support/session_bus.h"

namespace fulcrum {
namespace {

using std::chrono::duration;
using std::chrono::milliseconds;
using std::chrono::steady_clock;
using testing::Cart;

constexpr int kDomain = 97;
constexpr double kPatience_s = 20;  // Starting and rejoining on a busy machine.
constexpr double kFelt_N = 0.15;    // Least force of the pull.
constexpr double kGone_N = 0.1;

/// The built-in scene without render_node, with a grasper that takes the membrane, then pulls up and down to the end.
std::string PullingScene() {
  std::string scene = testing::ReadFile(FULCRUM_SOURCE_DIR "/deploy/scenes/built-in.yaml");
  scene.resize(scene.find("\nscript:"));
  std::ostringstream script;
  const auto key = [&](double time_s, double height_mm, double jaw_deg) {
    script << "    - {time_s: " << time_s << ", sheet: [0.36, 0.5], height_mm: " << height_mm
           << ", jaw_deg: " << jaw_deg << "}\n";
  };
  script << "\nnodes: [handle_bridge, haptics_node, physics_node, thermal_node]\n"
         << "script:\n  duration_s: 60\n  tool0:\n";
  key(0.0, 10, 50);
  key(0.4, -2.5, 50);
  key(0.6, -2.5, 50);
  key(0.9, -2.5, 0);
  for (int i = 0; i < 110; ++i) key(1.5 + 0.5 * i, i % 2 == 0 ? 11 : 9, 0);
  script << "  tool1:\n    - {time_s: 0, sheet: [0.68, 0.4], height_mm: 45}\n";
  return scene + script.str();
}

class Faults : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("faults_test." + std::to_string(::getpid()));
    std::filesystem::create_directories(folder_);
    const std::filesystem::path file = folder_ / "pull.yaml";  // The scene cache uses this name.
    std::ofstream(file) << PullingScene();
    const ToolDescription tool = scene::ReadSceneYaml(file, {}).settings.tools[0];
    judge_ = std::make_unique<testing::ForceJudge>(haptics::Trocar{tool.p_WP.cast<double>(), tool.shaft_length_m});
    // The test acts as a broken node of this session: it writes one topic and reads others, for which no identity of a
    // keyed bus has the rights.
    cart_ = std::make_unique<Cart>(file, kDomain, std::vector<std::string>{"--open-bus"});
    participant_ = std::make_unique<bus::DdsParticipant>(testing::ReaderOf(kDomain));
    models_ = participant_->MakeOutput<ContactModel>();
    tools_ = participant_->MakeInput<ToolState>();
    healths_ = participant_->MakeInput<Health>();
  }
  void TearDown() override {
    cart_.reset();
    std::filesystem::remove_all(folder_);
  }

  /// Checks samples until `done` or for `limit_s`; returns whether `done` was reached.
  bool Watch(double limit_s, const std::function<bool()>& done) {
    const auto start = steady_clock::now();
    while (duration<double>(steady_clock::now() - start).count() < limit_s) {
      while (tools_->TakeNext(&tool_)) judge_->Add(tool_);
      if (healths_->TakeNext(&heard_) && heard_.node == NodeId::kHaptics) health_ = heard_;
      if (done()) return true;
      std::this_thread::sleep_for(milliseconds(2));
    }
    return false;
  }
  void WatchFor(double seconds) {
    (void)Watch(seconds, [] { return false; });
  }
  bool WatchUntilThePullIsFelt() {
    return Watch(kPatience_s, [&] { return judge_->state() == ServoState::kNormal && judge_->force_N() > kFelt_N; });
  }
  [[nodiscard]] pid_t Physics() const {
    const auto nodes = cart_->nodes();
    const auto physics = nodes.find("physics_node");
    return physics == nodes.end() ? -1 : physics->second;
  }
  /// kill -9; the supervisor restarts physics, and its models reach the servo again.
  void KillPhysics() {
    const pid_t victim = Physics();
    ASSERT_GT(victim, 0);
    ::kill(victim, SIGKILL);
    ASSERT_TRUE(Watch(kPatience_s, [&] { return Physics() > 0 && Physics() != victim; })) << cart_->Said();
    ASSERT_TRUE(Watch(kPatience_s, [&] { return judge_->state() == ServoState::kRise; })) << cart_->Said();
    ASSERT_TRUE(WatchUntilThePullIsFelt()) << "after the restart of physics\n" << cart_->Said();
  }
  double Metric(const std::string& name) const {
    const auto it = std::find_if(health_.metrics.begin(), health_.metrics.end(),
                                 [&](const fulcrum::Metric& m) { return m.name == name; });
    return it == health_.metrics.end() ? -1 : it->value;
  }
  void SpeakAsABrokenPhysics(double seconds);

  std::filesystem::path folder_;
  std::unique_ptr<Cart> cart_;
  std::unique_ptr<testing::ForceJudge> judge_;
  std::unique_ptr<bus::DdsParticipant> participant_;
  std::unique_ptr<bus::OutputOf<ContactModel>::type> models_;
  std::unique_ptr<bus::Input<ToolState>> tools_;
  std::unique_ptr<bus::Input<Health>> healths_;
  ToolState tool_;
  Health heard_, health_;  ///< The newest of any node; the newest of haptics_node.
};

/// A spring that holds the tip where it is now, from a newer physics than the real one, which keeps publishing; its
/// messages arrive twice, out of order, invalid, or with arbitrary forces.
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
    const bool swaps = i % 3 == 2;  // This message and the previous one are swapped.
    if (i % 3 != 1) models_->Write(model);
    if (i % 4 == 0) models_->Write(model);
    WatchFor(0.003);
    if (swaps) models_->Write(late);
    late = model;
    WatchFor(0.006);
  }
}

TEST_F(Faults, TheHandIsNeverHurt) {
  ASSERT_TRUE(WatchUntilThePullIsFelt()) << "force " << judge_->force_N() << " N, state "
                                         << static_cast<int>(judge_->state()) << ", model "
                                         << tool_.tools[0].model_age_s << " s old\n"
                                         << cart_->Said();
  const pid_t first = Physics();
  ASSERT_GT(first, 0) << cart_->Said();

  for (const int stall_ms : {50, 200, 1000}) {
    SCOPED_TRACE("stalled for " + std::to_string(stall_ms) + " ms");
    judge_->ResetRange();
    ::kill(first, SIGSTOP);
    WatchFor(1e-3 * stall_ms);
    ::kill(first, SIGCONT);
    if (stall_ms == 1000) {
      EXPECT_LE(judge_->least_N(), kGone_N);
    }
    ASSERT_TRUE(WatchUntilThePullIsFelt());
    EXPECT_EQ(judge_->verdict(), "");
  }

  ASSERT_NO_FATAL_FAILURE(KillPhysics());
  EXPECT_EQ(judge_->verdict(), "") << "physics was killed";

  judge_->ResetRange();
  SpeakAsABrokenPhysics(1.5);
  EXPECT_GT(judge_->most_N(), kFelt_N);
  EXPECT_TRUE(Watch(kPatience_s, [&] { return judge_->force_N() <= kGone_N; }))
      << "the broken physics has ended, and the older one stays excluded";
  ASSERT_NO_FATAL_FAILURE(KillPhysics());
  EXPECT_EQ(judge_->verdict(), "") << "a broken physics published";

  const std::int64_t now_ns = runtime::MonotonicNs();
  ASSERT_TRUE(Watch(kPatience_s, [&] { return health_.stamp.stamp_ns > now_ns; })) << "no Health of the servo";
  EXPECT_LE(Metric("peak_hand_force_N"), 3.3);
  EXPECT_GT(Metric("models_dropped"), 10);
  EXPECT_EQ(Metric("forces_not_finite"), 0);
  const auto input = std::find_if(health_.inputs.begin(), health_.inputs.end(),
                                  [](const InputHealth& i) { return i.topic == TopicId::kContactModel; });
  ASSERT_NE(input, health_.inputs.end());
  EXPECT_GT(input->rejected, 0u);
  // The histograms of the servo's cycles are published.
  EXPECT_GT(health_.step.p50_us, 0);
  EXPECT_GE(health_.step.p99_us, health_.step.p50_us);
  EXPECT_GE(health_.step.max_us, 0.9f * health_.step.p99_us);  // Bins are 6 % wide.
  EXPECT_GT(health_.wake.p99_us, 0);
  EXPECT_GT(judge_->samples(), 1500u);

  cart_->Signal(SIGINT);
  // Physics was stopped for 1.25 s, which in a short session exceeds the allowed part of missed periods.
  EXPECT_EQ(cart_->FaultAtEnd(kPatience_s), "");
}

}  // namespace
}  // namespace fulcrum
