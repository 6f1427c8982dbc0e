// A session that is operated with the mouse and the keyboard of its window alone: a program moves the pointer and
// presses keys on a real X server, and reads the tools' poses to see where they are, as a person sees them.
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <thread>

#include "render_node/geometry/laparoscope.h"
#include "services/base/core/operator_script.h"
#include "services/base/runtime/cyclic_thread.h"
#include "services/scene/compiler/scene_yaml.h"
#include "services/scene/format/scene_file.h"
#include "services/transport/bus/dds/participant.h"
#include "tests/support/cart.h"
#include "tests/support/session_bus.h"
#include "tests/support/virtual_screen.h"
#include "tests/support/xclient.h"

namespace fulcrum {
namespace {

namespace fs = std::filesystem;
using testing::WaitFor;
using Seconds = std::chrono::duration<double>;

constexpr int kDomain = 73;
constexpr double kPatience_s = 60;

/// Reads the tools and the pedals of the session.
class Eyes {
 public:
  explicit Eyes(int domain) : participant_(testing::ReaderOf(domain, "watch")) {}
  void Look() {
    (void)tools_->TakeLatest(&tools);
    (void)handles_->TakeLatest(&handles);
    (void)topology_->TakeLatest(&topology);
  }
  ToolState tools;
  HandleState handles;
  TopologyState topology;

 private:
  bus::DdsParticipant participant_;
  std::unique_ptr<bus::Input<ToolState>> tools_ = participant_.MakeInput<ToolState>();
  std::unique_ptr<bus::Input<HandleState>> handles_ = participant_.MakeInput<HandleState>();
  std::unique_ptr<bus::Input<TopologyState>> topology_ = participant_.MakeInput<TopologyState>();
};

class Operator {
 public:
  Operator(const RenderParams& camera, testing::XClient* client, Eyes* eyes) : client_(client), eyes_(eyes) {
    const Eigen::Matrix4f view = render::MakeLaparoscope(camera).view;
    right_ = view.row(0).head<3>().transpose();
    up_ = view.row(1).head<3>().transpose();
    forward_ = -view.row(2).head<3>().transpose();
    eye_ = camera.scope_tip_W;
    pixel_ = 2 * std::tan(0.5f * 0.0174533f * camera.fov_deg) / static_cast<float>(camera.height);
  }

  /// Moves the tip of a tool to `target` at `speed_m_s`, straight, by the pointer, with Control along the view. False:
  /// it did not arrive.
  bool Go(std::size_t tool, const Vec3f& target, float speed_m_s, float near_m = 1.5e-3f) {
    constexpr float kPeriod_s = 0.02f;
    const auto limit = std::chrono::steady_clock::now() + std::chrono::seconds(12);
    for (auto next = std::chrono::steady_clock::now(); next < limit; next += std::chrono::milliseconds(20)) {
      std::this_thread::sleep_until(next);
      eyes_->Look();
      const Vec3f tip = eyes_->tools.tools[tool].p_WT, left = target - tip;
      if (left.norm() < near_m) return true;
      // The tool follows the pointer with a lag of some periods: near the target it goes slower.
      const Vec3f step = left * std::min(0.15f, speed_m_s * kPeriod_s / left.norm());
      const float metres = pixel_ * forward_.dot(tip - eye_);
      Send(step.dot(right_) / metres, -step.dot(up_) / metres, step.dot(forward_) / metres);
    }
    return false;
  }

 private:
  /// Whole pixels; the rest is kept for the next time.
  void Send(float x, float y, float deep) {
    rest_ += Vec3f(x, y, deep);
    const Eigen::Vector3i whole = rest_.array().round().matrix().cast<int>();
    rest_ -= whole.cast<float>();
    if (whole.x() != 0 || whole.y() != 0) client_->Move(whole.x(), whole.y());
    if (whole.z() != 0) {
      client_->Press("Control_L", true);
      client_->Move(0, -whole.z());
      client_->Press("Control_L", false);
    }
  }

  testing::XClient* client_;
  Eyes* eyes_;
  Vec3f right_, up_, forward_, eye_;
  float pixel_;
  Vec3f rest_ = Vec3f::Zero();
};

TEST(Hands, AreRefusedBeforeAnyNodeStarts) {
  ::unsetenv("DISPLAY");
  testing::Program no_display("fulcrum", {"up", "small", "--hands", "mouse"});
  EXPECT_EQ(no_display.End(0), 2);
  EXPECT_NE(no_display.Said().find("DISPLAY is not set"), std::string::npos) << no_display.Said();
  testing::Program no_input("fulcrum", {"up", "small", "--hands", "claw"});
  EXPECT_EQ(no_input.End(0), 2);
  EXPECT_NE(no_input.Said().find("valid: mouse"), std::string::npos) << no_input.Said();
}

TEST(Hands, AMouseAndAKeyboardGraspPullCutAndReleaseAndTheSessionReplays) {
  const testing::VirtualScreen screen;
  if (!screen.installed()) GTEST_SKIP() << "Xvfb is not installed; apt install xvfb";
  ASSERT_FALSE(screen.display().empty());
  ::setenv("DISPLAY", screen.display().c_str(), 1);
  testing::Cart cart("small", kDomain, {"--hands", "mouse", "--record", "--set", "render.hud=1"});
  ASSERT_TRUE(WaitFor(kPatience_s, [&] { return fs::exists(cart.session() / "scene.fulcrum"); })) << cart.Said();
  testing::XClient client(screen.display());
  ASSERT_TRUE(WaitFor(kPatience_s, [&] { return client.FindWindow("Fulcrum"); })) << cart.Said();
  Eyes eyes(kDomain);
  const auto running = [&] {
    eyes.Look();
    return eyes.tools.tools[1].kind == ToolKind::kHook && eyes.handles.handles[0].present;
  };
  ASSERT_TRUE(WaitFor(kPatience_s, running)) << cart.Said();
  const scene::SceneFile scene(fs::canonical(cart.session() / "scene.fulcrum"));
  const SceneView& view = scene.view();
  // The places of the scripted operator, who does the same.
  const auto place = [&](std::uint32_t tool, double time_s) { return EvaluateScript(view.script, tool, time_s).p_W; };

  // Before the controls are taken, the tools rest although the pointer moves.
  const Vec3f rest = eyes.tools.tools[1].p_WT;
  client.Move(50, 50);
  std::this_thread::sleep_for(Seconds(0.5));
  eyes.Look();
  EXPECT_LT((eyes.tools.tools[1].p_WT - rest).norm(), 1e-5f);

  Operator hand(view.render, &client, &eyes);
  client.Click("Return");
  std::this_thread::sleep_for(Seconds(0.3));
  // The grasper opens over the place of the script's grasp, comes down and closes.
  client.Click("1");
  const double grasp_s = 0.8;
  EXPECT_TRUE(hand.Go(0, place(0, 0.0), 0.15f)) << eyes.tools.tools[0].p_WT.transpose();
  EXPECT_TRUE(hand.Go(0, place(0, grasp_s), 0.05f)) << eyes.tools.tools[0].p_WT.transpose();
  client.Click("k");
  EXPECT_TRUE(WaitFor(2, [&] {
    eyes.Look();
    return eyes.handles.handles[0].jaw_angle_rad < 0.1f;
  })) << "the jaw does not close";
  // It pulls the membrane up; the tissue pulls back.
  EXPECT_TRUE(hand.Go(0, place(0, grasp_s) + Vec3f(0, 0, 0.008f), 0.03f, 3e-3f));
  EXPECT_GT(eyes.tools.tools[0].f_W.norm(), 0.05f);

  // The hook cuts, with the key of the pedal down.
  client.Click("2");
  const Vec3f begin = place(1, 2.3);
  EXPECT_TRUE(hand.Go(1, begin + Vec3f(0, 0, 0.02f), 0.15f));
  EXPECT_TRUE(hand.Go(1, begin, 0.05f, 3e-3f));
  client.Press("f", true);
  EXPECT_TRUE(WaitFor(2, [&] {
    eyes.Look();
    return eyes.handles.pedals == kPedalCut;
  })) << "the pedal is not down";
  (void)hand.Go(1, place(1, 4.8), 0.006f, 2e-3f);
  client.Press("f", false);
  EXPECT_TRUE(WaitFor(2, [&] {
    eyes.Look();
    return eyes.handles.pedals == kPedalNone;
  }));
  EXPECT_TRUE(WaitFor(2,
                      [&] {
                        eyes.Look();
                        return eyes.topology.cut_length_m > 4e-3f;
                      }))
      << "cut " << eyes.topology.cut_length_m;

  // Released controls lift pedals, and the tissue's force fades.
  client.Press("f", true);
  client.Click("Escape");
  const auto released = std::chrono::steady_clock::now();
  EXPECT_TRUE(WaitFor(3,
                      [&] {
                        eyes.Look();
                        return eyes.handles.pedals == kPedalNone && eyes.tools.tools[0].f_W.norm() < 0.1f;
                      }))
      << eyes.tools.tools[0].f_W.norm() << " N";
  std::printf("hands.release_to_safe_ms %.0f ms\n", 1e3 * Seconds(std::chrono::steady_clock::now() - released).count());

  cart.Signal(SIGINT);
  ASSERT_EQ(cart.WaitForEnd(kPatience_s), 0) << cart.Said();
  testing::Program replay("replayer", {cart.session() / "recording.mcap", "--into", "physics", "thermal", "haptics"});
  EXPECT_EQ(replay.End(0), 0) << replay.Said();
  EXPECT_EQ(replay.Said().find("differs"), std::string::npos) << replay.Said();
}

}  // namespace
}  // namespace fulcrum
