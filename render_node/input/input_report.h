// What is plugged in, as text for a person and as JSON.
#pragma once

#include <string>
#include <vector>

#include "render_node/input/gamepads.h"
#include "render_node/input/space_mouse.h"
#include "services/base/core/pad_hands.h"

namespace fulcrum::render {

struct PluggedIn {
  std::vector<Gamepads::Pad> gamepads;
  std::vector<SpaceMice::Mouse> space_mice;
  std::vector<InputDevice> unknown;  ///< Joysticks whose layout SDL does not know.
  std::vector<InputDevice> locked;   ///< Joysticks that this user may not read.
};

/// A line for each device, and what to do where one cannot be used or none is there. @param live also axes and buttons,
/// and what they do by these settings.
[[nodiscard]] std::string InputsText(const PluggedIn& inputs, const InputSettings& settings, bool live);
/// One line. @param live also axes and buttons.
[[nodiscard]] std::string InputsJson(const PluggedIn& inputs, bool live);

}  // namespace fulcrum::render
