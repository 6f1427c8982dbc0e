#include "handle_bridge/node/button_hands.h"

#include <algorithm>

namespace fulcrum::handle_bridge {
namespace {

constexpr float kOpen_rad = 0.7f;                  // Without the button.
constexpr float kRate_rad_s = kOpen_rad / 0.15f;   // As fast as a hand closes a handle.
constexpr std::int64_t kSilence_ns = 100'000'000;  // Older than this, a ToolState says nothing of the buttons.

bool HasTouch(const config::CartConfig& cart) {
  return std::any_of(cart.devices.begin(), cart.devices.end(),
                     [](const config::DeviceConfig& device) { return device.kind == config::DeviceKind::kTouch; });
}

/// Button of a handle; 0: none closes its jaw.
int ButtonOf(const config::CartConfig& cart, std::size_t tool) {
  const config::HandleConfig& handle = cart.handles[tool];
  const bool stands_in =
      handle.kind == config::LinkKind::kSerial && cart.devices[tool].kind == config::DeviceKind::kTouch;
  return handle.kind == config::LinkKind::kButtons || stands_in ? handle.button : 0;
}

bool PedalsByButton(const config::CartConfig& cart) {
  return cart.pedal.kind == config::LinkKind::kButtons ||
         (cart.pedal.kind == config::LinkKind::kSerial && HasTouch(cart));
}

}  // namespace

bool NeedsButtons(const config::CartConfig& cart) {
  bool needs = PedalsByButton(cart);
  for (std::size_t tool = 0; tool < kMaxTools; ++tool) needs = needs || ButtonOf(cart, tool) > 0;
  return needs;
}

ButtonHands::ButtonHands(const config::CartConfig& cart, bus::Input<ToolState>* tools)
    : tools_(tools), pedals_by_button_(PedalsByButton(cart)), cut_(cart.pedal.cut), coag_(cart.pedal.coag) {
  for (std::size_t tool = 0; tool < kMaxTools; ++tool) buttons_[tool] = ButtonOf(cart, tool);
}

void ButtonHands::Read(std::int64_t now_ns) {
  if (tools_ == nullptr) return;
  (void)tools_->TakeLatest(&state_);
  fresh_ = state_.stamp.sequence != 0 && now_ns - state_.stamp.stamp_ns <= kSilence_ns;
}

bool ButtonHands::Pressed(const config::ToolButton& button) const {
  const auto tool = static_cast<std::size_t>(button.tool);
  return fresh_ && button.button > 0 && (state_.tools[tool].buttons >> (button.button - 1) & 1) != 0;
}

HandleSample ButtonHands::Jaw(std::size_t tool, const HandleSample& line, bool by_button, double dt_s) {
  OneJaw& jaw = jaws_[tool];
  if (!by_button && !jaw.moves && !jaw.by_button) {
    jaw.angle_rad = line.jaw_angle_rad;
    jaw.known = line.present;
    return line;
  }
  if (!jaw.known) jaw.angle_rad = kOpen_rad;
  jaw.known = true;
  jaw.moves = jaw.moves || by_button != jaw.by_button;
  jaw.by_button = by_button;
  float wanted = line.jaw_angle_rad;
  // Nothing is known of the button: the jaw keeps its angle, and what it holds.
  if (by_button)
    wanted = !fresh_ ? jaw.angle_rad : Pressed({static_cast<int>(tool), buttons_[tool]}) ? 0.0f : kOpen_rad;
  const float most = kRate_rad_s * static_cast<float>(dt_s);
  const float by = std::clamp(wanted - jaw.angle_rad, -most, most);
  jaw.angle_rad += by;
  jaw.moves = jaw.moves && jaw.angle_rad != wanted;
  HandleSample sample;
  sample.present = true;
  sample.jaw_angle_rad = jaw.angle_rad;
  sample.jaw_rate_rad_s = dt_s > 0 ? by / static_cast<float>(dt_s) : 0.0f;
  sample.quality = by_button && !fresh_ ? 0.0f : 1.0f;
  return sample;
}

std::uint8_t ButtonHands::Pedals() const {
  return static_cast<std::uint8_t>((Pressed(cut_) ? kPedalCut : 0) | (Pressed(coag_) ? kPedalCoag : 0));
}

}  // namespace fulcrum::handle_bridge
