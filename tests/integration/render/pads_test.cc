// Gamepads that SDL imitates, and SpaceMice whose files a test writes.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>

#include "render_node/input/gamepads.h"
#include "render_node/input/pad_inputs.h"
#include "render_node/input/space_mouse.h"
#include "tests/support/virtual_pad.h"

namespace fulcrum::render {
namespace {

namespace fs = std::filesystem;

float AxisOf(const PadState& state, PadAxis axis) { return state.axes[static_cast<std::size_t>(axis)]; }

TEST(Gamepads, ArePluggedInAndOut) {
  Gamepads gamepads;
  gamepads.Update();
  const std::size_t others = gamepads.pads().size();
  {
    testing::VirtualPad pad;
    gamepads.Update();
    ASSERT_EQ(gamepads.pads().size(), others + 1);
    EXPECT_FALSE(gamepads.pads().back().device.name.empty());
    const std::int64_t first = gamepads.pads().back().state.device;
    pad.Unplug();
    gamepads.Update();
    EXPECT_EQ(gamepads.pads().size(), others);
    testing::VirtualPad again;
    gamepads.Update();
    ASSERT_EQ(gamepads.pads().size(), others + 1);
    EXPECT_NE(gamepads.pads().back().state.device, first);
  }
  gamepads.Update();
  EXPECT_EQ(gamepads.pads().size(), others);
}

TEST(Gamepads, AxesPointRightAndUpAndTriggersAreButtons) {
  Gamepads gamepads;
  testing::VirtualPad pad;
  gamepads.Update();
  ASSERT_FALSE(gamepads.pads().empty());
  EXPECT_EQ(gamepads.pads().back().state.buttons, 0u);
  pad.Axis(SDL_CONTROLLER_AXIS_LEFTX, 0.5f);
  pad.Axis(SDL_CONTROLLER_AXIS_RIGHTY, -1);
  pad.Axis(SDL_CONTROLLER_AXIS_TRIGGERRIGHT, 1);
  pad.Button(SDL_CONTROLLER_BUTTON_START, true);
  gamepads.Update();
  const PadState state = gamepads.pads().back().state;
  EXPECT_NEAR(AxisOf(state, PadAxis::kLeftX), 0.5f, 1e-4f);
  EXPECT_NEAR(AxisOf(state, PadAxis::kRightY), 1, 1e-4f);
  EXPECT_TRUE(state.pressed(PadButton::kRightTrigger));
  EXPECT_TRUE(state.pressed(PadButton::kStart));
  EXPECT_FALSE(state.pressed(PadButton::kLeftTrigger));
}

TEST(Gamepads, ATriggerAtTheEdgeDoesNotFlicker) {
  Gamepads gamepads;
  testing::VirtualPad pad;
  const auto pressed_at = [&](float share) {
    pad.Axis(SDL_CONTROLLER_AXIS_TRIGGERLEFT, 2 * share - 1);
    gamepads.Update();
    return gamepads.pads().back().state.pressed(PadButton::kLeftTrigger);
  };
  EXPECT_FALSE(pressed_at(0.45f));
  EXPECT_TRUE(pressed_at(0.55f));
  EXPECT_TRUE(pressed_at(0.45f));
  EXPECT_FALSE(pressed_at(0.35f));
}

TEST(Gamepads, AJoystickWithoutKnownLayoutIsNamedAndOperatesNothing) {
  Gamepads gamepads;
  gamepads.Update();
  const std::size_t pads = gamepads.pads().size(), unknown = gamepads.unknown().size();
  testing::VirtualPad stick(false);
  gamepads.Update();
  EXPECT_EQ(gamepads.pads().size(), pads);
  EXPECT_EQ(gamepads.unknown().size(), unknown + 1);
}

TEST(Gamepads, LeaveTheSignalsAlone) {
  struct sigaction before {
  }, after{};
  ::sigaction(SIGTERM, nullptr, &before);
  Gamepads gamepads;
  ::sigaction(SIGTERM, nullptr, &after);
  EXPECT_EQ(before.sa_handler, after.sa_handler);
}

TEST(PadInputs, AForceAtTheTipIsFelt) {
  PadInputs inputs{InputSettings()};
  testing::VirtualPad pad;
  MouseHands hands(OperatorSource::kWindow);
  inputs.Update(1, &hands);
  constexpr std::int64_t kSecond = 1'000'000'000;
  inputs.Rumble(0.2f, kSecond);
  EXPECT_EQ(pad.rumble(), 0);
  inputs.Rumble(1.9f, 2 * kSecond);
  EXPECT_NEAR(pad.rumble(), 32768, 100);
  inputs.Rumble(0, 3 * kSecond);
  EXPECT_EQ(pad.rumble(), 0);
}

/// Folders in place of /sys/class/hidraw and /dev, with one SpaceMouse whose file is a pipe.
class SpaceMouseFile : public ::testing::Test {
 protected:
  SpaceMouseFile() {
    fs::create_directories(root_ / "dev");
    Add("hidraw0", "0003:0000046D:0000C31C", "Keyboard", std::string("\x05\x01\x09\x06", 4));
    Add("hidraw1", "0003:0000256F:0000C635", "SpaceMouse Compact", std::string("\x05\x01\x09\x08", 4));
    Add("hidraw2", "0003:0000256F:0000C635", "its keys", std::string("\x05\x01\x09\x06", 4));
    Plug();
  }
  ~SpaceMouseFile() override {
    Unplug();
    fs::remove_all(root_);
  }
  void Add(const std::string& node, const std::string& id, const std::string& name, const std::string& descriptor) {
    fs::create_directories(root_ / "sys" / node / "device");
    std::ofstream(root_ / "sys" / node / "device/uevent")
        << "DRIVER=hid\nHID_ID=" << id << "\nHID_NAME=" << name << "\n";
    std::ofstream(root_ / "sys" / node / "device/report_descriptor") << descriptor;
  }
  void Plug() {
    ASSERT_EQ(::mkfifo((root_ / "dev/hidraw1").c_str(), 0600), 0);
    writer_ = ::open((root_ / "dev/hidraw1").c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
    ASSERT_GE(writer_, 0);
  }
  void Unplug() {
    if (writer_ >= 0) ::close(writer_);
    writer_ = -1;
    fs::remove(root_ / "dev/hidraw1");
    fs::remove_all(root_ / "sys/hidraw1");
  }
  template <std::size_t n>
  void Send(const std::array<std::uint8_t, n>& report) const {
    ASSERT_EQ(::write(writer_, report.data(), n), static_cast<ssize_t>(n));
  }

  const fs::path root_ = fs::path(::testing::TempDir()) / ("pads_" + std::to_string(::getpid()));
  int writer_ = -1;
};

TEST_F(SpaceMouseFile, IsFoundReadAndLost) {
  SpaceMice mice(root_ / "sys", root_ / "dev");
  mice.Update();
  ASSERT_EQ(mice.mice().size(), 1u);
  EXPECT_EQ(mice.mice()[0].device.name, "SpaceMouse Compact");
  EXPECT_EQ(mice.mice()[0].device.vendor, 0x256f);
  ASSERT_NE(mice.first(), nullptr);
  EXPECT_GE(mice.descriptor(), 0);
  Send(std::array<std::uint8_t, 7>{1, 0xaf, 0x00, 0x51, 0xff, 0x5e, 0x01});  // 175, -175, 350
  mice.Update();
  EXPECT_NEAR(AxisOf(*mice.first(), PadAxis::kX), 0.5f, 1e-6f);
  EXPECT_NEAR(AxisOf(*mice.first(), PadAxis::kZ), 0.5f, 1e-6f) << "away from the operator";
  EXPECT_NEAR(AxisOf(*mice.first(), PadAxis::kY), -1, 1e-6f) << "down";
  Send(std::array<std::uint8_t, 3>{3, 2, 0});
  mice.Update();
  EXPECT_TRUE(mice.first()->pressed(PadButton::kSecond));
  EXPECT_FALSE(mice.first()->pressed(PadButton::kFirst));
  Unplug();
  mice.Update();
  EXPECT_EQ(mice.first(), nullptr);
  EXPECT_EQ(mice.descriptor(), -1);
}

TEST_F(SpaceMouseFile, WithoutPermissionIsNamedWithTheReason) {
  fs::remove(root_ / "dev/hidraw1");  // Root may open everything: a file that is not there stands for it.
  SpaceMice mice(root_ / "sys", root_ / "dev");
  mice.Update();
  ASSERT_EQ(mice.mice().size(), 1u);
  EXPECT_FALSE(mice.mice()[0].problem.empty());
  EXPECT_EQ(mice.first(), nullptr);
}

}  // namespace
}  // namespace fulcrum::render
