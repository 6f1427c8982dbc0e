#include "render_node/input/pad_inputs.h"

#include <algorithm>
#include <exception>

#include "services/base/runtime/realtime.h"

namespace fulcrum::render {
namespace {

/// A period of the servo; gamepads report each 1 to 8 ms.
constexpr int kPoll_ms = 1;
/// Time after which the strength of the rumble is given again [ns]: well within Gamepads::kRumble_ms.
constexpr std::int64_t kRepeat_ns = 100'000'000;

}  // namespace

PadInputs::PadInputs(const InputSettings& settings)
    : settings_(settings), gamepad_hands_(settings.gamepad), mouse_hands_(settings.space_mouse) {
  try {
    gamepads_ = std::make_unique<Gamepads>();
  } catch (const std::exception& error) {
    runtime::Log(runtime::LogLevel::kWarning, error.what());
  }
}

PadHands::Outcome PadInputs::Update(std::int64_t now_ns, MouseHands* hands) {
  if (gamepads_) gamepads_->Update();
  mice_.Update();
  const PadHands::Outcome pad =
      gamepad_hands_.Update(has_gamepad() ? &gamepads_->pads().front().state : nullptr, now_ns, hands);
  const PadHands::Outcome mouse = mouse_hands_.Update(mice_.first(), now_ns, hands);
  return {pad.changed || mouse.changed, pad.take || mouse.take, pad.release || mouse.release};
}

void PadInputs::Rumble(float force_N, std::int64_t now_ns) {
  const float strength = PadRumble(settings_.gamepad, force_N);
  if (!has_gamepad() || (strength == 0 && rumble_ == 0) || now_ns - rumbled_ns_ < kRepeat_ns) return;
  rumble_ = strength;
  rumbled_ns_ = now_ns;
  gamepads_->Rumble(strength);
}

int PadInputs::Wait_ms(bool active, int longest) const {
  const PadState* const mouse = mice_.first();
  const bool tilted =
      mouse != nullptr && std::any_of(mouse->axes.begin(), mouse->axes.end(), [](float axis) { return axis != 0; });
  return active && (has_gamepad() || tilted) ? kPoll_ms : longest;
}

}  // namespace fulcrum::render
