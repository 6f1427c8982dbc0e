#include "render_node/input/input_report.h"

#include <gtest/gtest.h>

namespace fulcrum::render {
namespace {

PluggedIn OneOfEach() {
  PluggedIn inputs;
  Gamepads::Pad pad;
  pad.device = {"Pad \"One\"", "/dev/input/event7", 0x045e, 0x028e};
  pad.rumbles = true;
  pad.state.axes[static_cast<std::size_t>(PadAxis::kLeftX)] = 0.5f;
  pad.state.buttons = 1u << static_cast<unsigned>(PadButton::kA) | 1u << static_cast<unsigned>(PadButton::kUp);
  inputs.gamepads.push_back(pad);
  SpaceMice::Mouse mouse;
  mouse.device = {"SpaceNavigator", "/dev/hidraw1", 0x046d, 0xc626};
  mouse.problem = "Permission denied";
  inputs.space_mice.push_back(mouse);
  inputs.unknown.push_back({"Wheel", "/dev/input/event8", 1, 2});
  inputs.locked.push_back({"Pad Two", "/dev/input/event9", 3, 4});
  return inputs;
}

TEST(InputReport, NamesEachDeviceAndAFixForEachTrouble) {
  EXPECT_EQ(
      InputsText(OneOfEach(), InputSettings(), false),
      "gamepad     Pad \"One\" (045e:028e, /dev/input/event7), rumbles\n"
      "SpaceMouse  SpaceNavigator (046d:c626, /dev/hidraw1): cannot be read: Permission denied\n"
      "            fix: copy deploy/udev/60-fulcrum.rules to /etc/udev/rules.d (the package has it), and plug it in "
      "again\n"
      "joystick    Wheel (0001:0002, /dev/input/event8): of unknown layout, operates nothing\n"
      "            fix: name its axes and buttons in the variable SDL_GAMECONTROLLERCONFIG (package joystick has "
      "jstest)\n"
      "joystick    Pad Two (0003:0004, /dev/input/event9): no permission to read it\n"
      "            fix: sudo adduser $USER input, then log in again\n");
}

TEST(InputReport, LiveShowsAxesAndWhatPressedButtonsDo) {
  const std::string text = InputsText(OneOfEach(), InputSettings(), true);
  EXPECT_NE(text.find("left_x +0.50  left_y +0.00  right_x +0.00  right_y +0.00\n"), std::string::npos) << text;
  EXPECT_NE(text.find("pressed: a (jaw), up (third_tool)\n"), std::string::npos) << text;
}

TEST(InputReport, NothingIsOneClearLineAndWhatToDo) {
  const std::string text = InputsText({}, InputSettings(), true);
  EXPECT_EQ(text.rfind("No gamepad and no SpaceMouse is plugged in.\n", 0), 0u);
  EXPECT_NE(text.find("/dev/input"), std::string::npos);
}

TEST(InputReport, JsonIsOneObject) {
  EXPECT_EQ(InputsJson({}, true), R"({"gamepads": [], "space_mice": [], "unknown": [], "locked": []})");
  EXPECT_EQ(InputsJson(OneOfEach(), true),
            R"({"gamepads": [{"name": "Pad \"One\"", "id": "045e:028e", "path": "/dev/input/event7", "rumbles": true, )"
            R"("axes": {"left_x": 0.5000, "left_y": 0.0000, "right_x": 0.0000, "right_y": 0.0000}, )"
            R"("pressed": ["a", "up"]}], "space_mice": [{"name": "SpaceNavigator", "id": "046d:c626", )"
            R"("path": "/dev/hidraw1", "problem": "Permission denied"}], "unknown": [{"name": "Wheel", )"
            R"("id": "0001:0002", "path": "/dev/input/event8"}], "locked": [{"name": "Pad Two", "id": "0003:0004", )"
            R"("path": "/dev/input/event9"}]})");
}

}  // namespace
}  // namespace fulcrum::render
