#include "render_node/input/input_report.h"

#include <array>
#include <cstdio>
#include <string_view>

#include "services/base/core/json_text.h"

namespace fulcrum::render {
namespace {

/// Axes and buttons that a kind of device has.
struct Layout {
  PadAxis first_axis, last_axis;
  PadButton first_button, last_button;
};
constexpr Layout kOfGamepad{PadAxis::kLeftX, PadAxis::kRightY, PadButton::kA, PadButton::kRightTrigger};
constexpr Layout kOfSpaceMouse{PadAxis::kX, PadAxis::kTurnZ, PadButton::kFirst, PadButton::kSecond};

template <class F>
void ForAxes(const Layout& layout, const F& use) {
  for (auto i = static_cast<std::size_t>(layout.first_axis); i <= static_cast<std::size_t>(layout.last_axis); ++i) {
    use(static_cast<PadAxis>(i), i);
  }
}
template <class F>
void ForPressed(const Layout& layout, const PadState& state, const F& use) {
  for (auto i = static_cast<std::size_t>(layout.first_button); i <= static_cast<std::size_t>(layout.last_button); ++i) {
    if (state.pressed(static_cast<PadButton>(i))) use(static_cast<PadButton>(i));
  }
}

std::string Printed(const char* format, double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), format, value);
  return text.data();
}

std::string Id(const InputDevice& device) {
  std::array<char, 16> text{};
  std::snprintf(text.data(), text.size(), "%04x:%04x", static_cast<unsigned>(device.vendor) & 0xffffu,
                static_cast<unsigned>(device.product) & 0xffffu);
  return text.data();
}

std::string Line(std::string_view kind, const InputDevice& device, std::string_view remark) {
  std::string line(kind);
  line.resize(12, ' ');
  line += device.name.empty() ? "without a name" : device.name;
  line += " (" + Id(device) + (device.path.empty() ? "" : ", " + device.path) + ")";
  return line.append(remark) + "\n";
}

std::string Fix(std::string_view text) { return std::string(12, ' ') + "fix: " + std::string(text) + "\n"; }

std::string LiveText(const Layout& layout, const PadState& state, const PadSettings& settings) {
  std::string axes(12, ' '), pressed;
  ForAxes(layout, [&](PadAxis axis, std::size_t i) {
    axes += std::string(PadAxisName(axis)) + Printed(" %+.2f  ", static_cast<double>(state.axes[i]));
  });
  ForPressed(layout, state, [&](PadButton button) {
    pressed += std::string(pressed.empty() ? "" : ", ") + PadButtonName(button);
    for (std::size_t i = 0; i < kPadActions; ++i) {
      if (settings.buttons[i] == button) pressed += std::string(" (") + PadActionName(static_cast<PadAction>(i)) + ")";
    }
  });
  axes.erase(axes.find_last_not_of(' ') + 1);
  return axes + "\n" + std::string(12, ' ') + "pressed: " + (pressed.empty() ? "nothing" : pressed) + "\n";
}

std::string DeviceJson(const InputDevice& device) {
  return "\"name\": " + JsonString(device.name) + ", \"id\": " + JsonString(Id(device)) +
         ", \"path\": " + JsonString(device.path);
}

std::string LiveJson(const Layout& layout, const PadState& state) {
  std::string axes, pressed;
  ForAxes(layout, [&](PadAxis axis, std::size_t i) {
    axes += (axes.empty() ? "" : ", ") + JsonString(PadAxisName(axis)) +
            Printed(": %.4f", static_cast<double>(state.axes[i]));
  });
  ForPressed(layout, state,
             [&](PadButton button) { pressed += (pressed.empty() ? "" : ", ") + JsonString(PadButtonName(button)); });
  return ", \"axes\": {" + axes + "}, \"pressed\": [" + pressed + "]";
}

template <class List, class F>
std::string JsonList(const char* name, const List& list, const F& text) {
  std::string items;
  for (const auto& item : list) items += (items.empty() ? "{" : ", {") + text(item) + "}";
  return JsonString(name) + ": [" + items + "]";
}

}  // namespace

std::string InputsText(const PluggedIn& inputs, const InputSettings& settings, bool live) {
  std::string text;
  for (const Gamepads::Pad& pad : inputs.gamepads) {
    text += Line("gamepad", pad.device, pad.rumbles ? ", rumbles" : "");
    if (live) text += LiveText(kOfGamepad, pad.state, settings.gamepad);
  }
  for (const SpaceMice::Mouse& mouse : inputs.space_mice) {
    text += Line("SpaceMouse", mouse.device, mouse.problem.empty() ? "" : ": cannot be read: " + mouse.problem);
    if (!mouse.problem.empty()) {
      text += Fix("copy deploy/udev/60-fulcrum.rules to /etc/udev/rules.d (the package has it), and plug it in again");
    } else if (live) {
      text += LiveText(kOfSpaceMouse, mouse.state, settings.space_mouse);
    }
  }
  for (const InputDevice& device : inputs.unknown) {
    text += Line("joystick", device, ": of unknown layout, operates nothing");
    text += Fix("name its axes and buttons in the variable SDL_GAMECONTROLLERCONFIG (package joystick has jstest)");
  }
  for (const InputDevice& device : inputs.locked) {
    text += Line("joystick", device, ": no permission to read it");
    text += Fix("sudo adduser $USER input, then log in again");
  }
  if (!text.empty()) return text;
  return "No gamepad and no SpaceMouse is plugged in.\n"
         "Plug one in, or pair it; no program or driver is needed beside the kernel. Does lsusb or bluetoothctl show "
         "it,\n"
         "but not this list? Then the kernel has no driver for it, or this is a container without /dev/input.\n";
}

std::string InputsJson(const PluggedIn& inputs, bool live) {
  const auto device = [](const InputDevice& item) { return DeviceJson(item); };
  return "{" +
         JsonList("gamepads", inputs.gamepads,
                  [live](const Gamepads::Pad& pad) {
                    return DeviceJson(pad.device) + ", \"rumbles\": " + (pad.rumbles ? "true" : "false") +
                           (live ? LiveJson(kOfGamepad, pad.state) : "");
                  }) +
         ", " +
         JsonList("space_mice", inputs.space_mice,
                  [live](const SpaceMice::Mouse& mouse) {
                    return DeviceJson(mouse.device) + ", \"problem\": " + JsonString(mouse.problem) +
                           (live && mouse.problem.empty() ? LiveJson(kOfSpaceMouse, mouse.state) : "");
                  }) +
         ", " + JsonList("unknown", inputs.unknown, device) + ", " + JsonList("locked", inputs.locked, device) + "}";
}

}  // namespace fulcrum::render
