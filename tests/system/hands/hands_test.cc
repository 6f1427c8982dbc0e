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

#include "services/base/core/operator_script.h"
#include "services/base/runtime/cyclic_thread.h"
#include "services/scene/compiler/scene_yaml.h"
#include "services/scene/format/scene_file.h"
#include "tests/support/cart.h"
#include "tests/support/mouse_operator.h"
#include "tests/support/operated_session.h"
#include "tests/support/virtual_screen.h"
#include "tests/support/xclient.h"

namespace fulcrum {
namespace {

namespace fs = std::filesystem;
using testing::Eyes;
using testing::WaitFor;
using Seconds = std::chrono::duration<double>;

constexpr int kDomain = 69, kBrowserDomain = 68;
constexpr double kPatience_s = 60;

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
    return eyes.Ready();
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

  testing::MouseOperator hand(view.render, &client, &eyes);
  client.Click("Return");
  std::this_thread::sleep_for(Seconds(0.3));
  // The grasper opens over the place of the script's grasp, comes down and closes.
  client.Click("1");
  const double grasp_s = 0.8;
  EXPECT_TRUE(hand.Go(0, place(0, 0.0), 0.15f)) << eyes.tools.tools[0].p_WT.transpose();
  EXPECT_TRUE(hand.Go(0, place(0, grasp_s), 0.05f)) << eyes.tools.tools[0].p_WT.transpose();
  client.Click("k");
  EXPECT_TRUE(WaitFor(10, [&] {
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
  EXPECT_TRUE(WaitFor(10, [&] {
    eyes.Look();
    return eyes.handles.pedals == kPedalCut;
  })) << "the pedal is not down";
  (void)hand.Go(1, place(1, 4.8), 0.006f, 2e-3f);
  client.Press("f", false);
  EXPECT_TRUE(WaitFor(10, [&] {
    eyes.Look();
    return eyes.handles.pedals == kPedalNone;
  }));
  EXPECT_TRUE(WaitFor(10,
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
  ASSERT_EQ(cart.FaultAtEnd(kPatience_s), "");
  testing::Program replay("replayer", {cart.session() / "recording.mcap", "--into", "physics", "thermal", "haptics"});
  EXPECT_EQ(replay.End(0), 0) << replay.Said();
  EXPECT_EQ(replay.Said().find("differs"), std::string::npos) << replay.Said();
}

void ExpectAll(const testing::DissectionByMouse& done) {
  EXPECT_EQ(done.fault, "");
  EXPECT_GT(done.grasped, 0);
  EXPECT_GT(done.lifted_mm, 10);
  EXPECT_GT(done.pull_N, 0.3);
  EXPECT_GE(done.cut_mm, 20);
  EXPECT_EQ(done.released, 0);
  EXPECT_LT(done.released_N, 0.1);
  std::printf("hands.mouse_task: %.0f particles, %.1f mm, %.2f N, cut %.1f mm, released %.0f, %.3f N\n", done.grasped,
              done.lifted_mm, done.pull_N, done.cut_mm, done.released, done.released_N);
}

void DissectIn(testing::OperatedSession* session) {
  const std::string fault = session->Begin();
  if (!session->missing().empty()) GTEST_SKIP() << session->missing();
  ASSERT_EQ(fault, "");
  ExpectAll(testing::DissectByMouse(session->scene(), &session->hand(), &session->eyes()));
  EXPECT_TRUE(session->End()) << session->Said();
}

TEST(Hands, TheWindowsMouseGraspsTentsCuts20MmAndReleasesInBuiltIn) {
  // The test is about hands. At 30 Hz a software rasteriser beside four nodes on two slow cores draws fewer pictures
  // than a session needs in order to be well (a fifth). A window with hands draws at the cart's rate.
  const fs::path cart = fs::path(::testing::TempDir()) / ("ten_pictures." + std::to_string(::getpid()) + ".yaml");
  std::ofstream(cart) << "nodes: {render_node: {rate_Hz: 10}}\n";
  DissectIn(testing::WindowSession("built-in", kDomain, {"--cart", cart}).get());
}

TEST(Hands, ThePagesMouseGraspsTentsCuts20MmAndReleasesInBuiltIn) {
  DissectIn(testing::BrowserSession("built-in", kBrowserDomain, FULCRUM_CONSOLE_NPM).get());
}

}  // namespace
}  // namespace fulcrum
