#include "services/base/config/cart_inputs.h"

#include <array>
#include <optional>
#include <string>
#include <vector>

namespace fulcrum::config {
namespace {

using Way = std::optional<PadDirection>;
using Button = std::optional<PadButton>;

/// Names of the axes `first` to `last`, each also with a minus, which inverts it.
StrictMap::Choices<Way> Ways(PadAxis first, PadAxis last) {
  static const std::vector<std::string> kInverted = [] {
    std::vector<std::string> names;
    for (std::size_t i = 0; i < kPadAxes; ++i) names.push_back(std::string("-") + PadAxisName(static_cast<PadAxis>(i)));
    return names;
  }();
  StrictMap::Choices<Way> ways{{"none", std::nullopt}};
  for (auto i = static_cast<std::size_t>(first); i <= static_cast<std::size_t>(last); ++i) {
    const auto axis = static_cast<PadAxis>(i);
    ways.emplace_back(PadAxisName(axis), PadDirection{axis, 1});
    ways.emplace_back(kInverted[i], PadDirection{axis, -1});
  }
  return ways;
}

StrictMap::Choices<Button> Buttons(PadButton first, PadButton last) {
  StrictMap::Choices<Button> buttons{{"none", std::nullopt}};
  for (auto i = static_cast<std::size_t>(first); i <= static_cast<std::size_t>(last); ++i) {
    const auto button = static_cast<PadButton>(i);
    buttons.emplace_back(PadButtonName(button), button);
  }
  return buttons;
}

void ReadPad(StrictMap map, const StrictMap::Choices<Way>& ways, const StrictMap::Choices<Button>& buttons,
             PadSettings* pad) {
  const auto number = [&map](const char* key, float value, const Range& range) {
    return static_cast<float>(map.NumberSi(key, static_cast<double>(value), range));
  };
  pad->speed_m_s = number("speed_mm_s", pad->speed_m_s, Range::Between(1, 500));
  pad->dead_zone = number("dead_zone_percent", pad->dead_zone, Range::Between(0, 90));
  StrictMap motion = map.MapOrDefaults("motion");
  constexpr std::array kMotions{"right", "up", "along"};
  for (std::size_t i = 0; i < kMotions.size(); ++i) {
    pad->motion[i] = motion.Choice(kMotions[i], pad->motion[i], ways);
  }
  pad->turn = motion.Choice("turn", pad->turn, ways);
  StrictMap actions = map.MapOrDefaults("buttons");
  for (std::size_t i = 0; i < kPadActions; ++i) {
    const char* name = PadActionName(static_cast<PadAction>(i));
    pad->buttons[i] = actions.Choice(name, pad->buttons[i], buttons);
  }
  for (std::size_t i = 0; i < kPadActions; ++i) {
    for (std::size_t other = 0; other < kPadActions; ++other) {
      const char* name = PadActionName(static_cast<PadAction>(i));
      // Told at the key that the file has.
      if (i == other || !pad->buttons[i] || pad->buttons[i] != pad->buttons[other] || !actions.Has(name)) continue;
      actions.Fail(name, std::string("button ") + PadButtonName(*pad->buttons[i]) + " also does " +
                             PadActionName(static_cast<PadAction>(other)) +
                             "; valid: a button for each, or none for one of them");
    }
  }
}

}  // namespace

void ReadInputs(StrictMap map, InputSettings* inputs) {
  PadSettings& pad = inputs->gamepad;
  StrictMap gamepad = map.MapOrDefaults("gamepad");
  const auto force = [&gamepad](const char* key, float value) {
    return static_cast<float>(gamepad.NumberSi(key, static_cast<double>(value), Range::Between(0, 100)));
  };
  pad.rumble_from_N = force("rumble_from_N", pad.rumble_from_N);
  pad.rumble_full_N = force("rumble_full_N", pad.rumble_full_N);
  if (!(pad.rumble_full_N > pad.rumble_from_N)) {
    gamepad.Fail(gamepad.Has("rumble_full_N") ? "rumble_full_N" : "rumble_from_N",
                 "rumble_full_N must be above rumble_from_N");
  }
  ReadPad(gamepad, Ways(PadAxis::kLeftX, PadAxis::kRightY), Buttons(PadButton::kA, PadButton::kRightTrigger), &pad);
  ReadPad(map.MapOrDefaults("space_mouse"), Ways(PadAxis::kX, PadAxis::kTurnZ),
          Buttons(PadButton::kFirst, PadButton::kSecond), &inputs->space_mouse);
}

}  // namespace fulcrum::config
