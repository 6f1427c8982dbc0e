// A gamepad at the window: from SDL's virtual joystick to OperatorInput.
#include <gtest/gtest.h>

#include <chrono>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>

#include "render_node/input/window_input.h"
#include "services/base/runtime/cyclic_thread.h"
#include "tests/support/virtual_pad.h"
#include "tests/support/virtual_screen.h"
#include "tests/support/xclient.h"

namespace fulcrum::render {
namespace {

constexpr auto kPatience = std::chrono::seconds(20);

/// What the window has sent.
class Received {
 public:
  void Add(const OperatorInput& input) {
    const std::lock_guard lock(mutex_);
    newest_ = input;
    changed_.notify_all();
  }
  /// Waits until the newest sample fulfils the condition.
  bool Await(const std::function<bool(const OperatorInput&)>& condition) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, kPatience, [&] { return condition(newest_); });
  }
  OperatorInput newest() {
    const std::lock_guard lock(mutex_);
    return newest_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  OperatorInput newest_;
};

class WindowPad : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!screen_.installed()) GTEST_SKIP() << "Xvfb is not installed; apt install xvfb";
    window_ = std::make_unique<testing::BareWindow>(screen_.display());
    input_ = std::make_unique<WindowInput>(screen_.display(), window_->id(),
                                           [this](const OperatorInput& input) { received_.Add(input); });
    HandsView view;
    view.present[0] = view.present[1] = true;
    view.tip[1] = Vec3f(0.02f, 0.1f, 0);
    input_->SetView(view);
  }
  /// Waits until the window knows of a gamepad, or of none: a button that is down when it is found counts as held.
  [[nodiscard]] bool AwaitPad(bool there) const {
    const auto end = std::chrono::steady_clock::now() + kPatience;
    while (input_->state().gamepad != there && std::chrono::steady_clock::now() < end) {
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    return input_->state().gamepad == there;
  }

  testing::StartedPads pads_;
  testing::VirtualScreen screen_;
  std::unique_ptr<testing::BareWindow> window_;
  Received received_;
  std::unique_ptr<WindowInput> input_;
};

TEST_F(WindowPad, OperatesFromThePlugToThePlug) {
  testing::VirtualPad pad;
  ASSERT_TRUE(AwaitPad(true));
  pad.Button(SDL_CONTROLLER_BUTTON_START, true);
  ASSERT_TRUE(received_.Await([](const OperatorInput& input) { return input.claim_ns != 0; }))
      << "Start takes the tools";
  pad.Axis(SDL_CONTROLLER_AXIS_LEFTX, 1);
  ASSERT_TRUE(received_.Await([](const OperatorInput& input) { return input.tools[1].p_WT.x() > 0.025f; }));
  pad.Axis(SDL_CONTROLLER_AXIS_TRIGGERRIGHT, 1);
  pad.Button(SDL_CONTROLLER_BUTTON_A, true);
  ASSERT_TRUE(received_.Await(
      [](const OperatorInput& input) { return input.pedals == kPedalCut && input.tools[1].jaw_angle_rad == 0; }));
  const std::int64_t unplugged_ns = runtime::MonotonicNs();
  pad.Unplug();
  ASSERT_TRUE(received_.Await([](const OperatorInput& input) { return input.claim_ns == 0; }))
      << "the controls are free";
  const OperatorInput last = received_.newest();
  EXPECT_EQ(last.pedals, kPedalNone);
  EXPECT_FALSE(last.tools[1].moves);
  RecordProperty("unplug_to_release_us", static_cast<int>((last.stamp.stamp_ns - unplugged_ns) / 1000));
  // The next one starts anew: its trigger is no pedal until the controls are taken again.
  ASSERT_TRUE(AwaitPad(false));
  testing::VirtualPad other;
  ASSERT_TRUE(AwaitPad(true));
  other.Axis(SDL_CONTROLLER_AXIS_TRIGGERLEFT, 1);
  other.Button(SDL_CONTROLLER_BUTTON_START, true);
  ASSERT_TRUE(received_.Await([](const OperatorInput& input) { return input.claim_ns != 0; }));
  EXPECT_EQ(received_.newest().pedals, kPedalNone);
  other.Button(SDL_CONTROLLER_BUTTON_BACK, true);
  EXPECT_TRUE(received_.Await([](const OperatorInput& input) { return input.claim_ns == 0; })) << "Back releases";
}

TEST_F(WindowPad, AnotherSourceThatClaimsLaterHasTheControls) {
  const std::int64_t before_ns = runtime::MonotonicNs();
  input_->Take();
  ASSERT_TRUE(received_.Await([](const OperatorInput& input) { return input.claim_ns != 0; }));
  input_->Yield(before_ns);
  const std::int64_t now_ns = runtime::MonotonicNs();
  ASSERT_TRUE(received_.Await([&](const OperatorInput& input) { return input.stamp.stamp_ns > now_ns; }));
  EXPECT_TRUE(input_->state().active) << "that claim was earlier";
  input_->Yield(runtime::MonotonicNs());
  EXPECT_TRUE(received_.Await([](const OperatorInput& input) { return input.claim_ns == 0; }));
  EXPECT_FALSE(received_.newest().tools[1].moves);
}

}  // namespace
}  // namespace fulcrum::render
