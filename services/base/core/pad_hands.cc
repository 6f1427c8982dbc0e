#include "services/base/core/pad_hands.h"

#include <algorithm>
#include <cmath>

namespace fulcrum {
namespace {

/// Longest time that one update moves the tip for [s]: a process that stood still must not jump.
constexpr float kLongestStep_s = 0.05f;

constexpr std::array<const char*, kPadAxes> kAxisNames{"left_x", "left_y", "right_x", "right_y", "x",
                                                       "y",      "z",      "turn_x",  "turn_y",  "turn_z"};
constexpr std::array<const char*, kPadButtons> kButtonNames{"a",
                                                            "b",
                                                            "x",
                                                            "y",
                                                            "back",
                                                            "start",
                                                            "left_stick",
                                                            "right_stick",
                                                            "left_shoulder",
                                                            "right_shoulder",
                                                            "up",
                                                            "down",
                                                            "left",
                                                            "right",
                                                            "left_trigger",
                                                            "right_trigger",
                                                            "first",
                                                            "second"};
constexpr std::array<const char*, kPadActions> kActionNames{
    "jaw", "jaw_lock", "left_tool", "right_tool", "third_tool", "fourth_tool", "coag",
    "cut", "fine",     "steady",    "clutch",     "take",       "release"};

/// Nothing: it is about the controls.
std::optional<HandsKey> KeyOf(PadAction action) {
  switch (action) {
    case PadAction::kJaw:
      return HandsKey::kJaw;
    case PadAction::kJawLock:
      return HandsKey::kJawLock;
    case PadAction::kTool0:
      return HandsKey::kTool0;
    case PadAction::kTool1:
      return HandsKey::kTool1;
    case PadAction::kTool2:
      return HandsKey::kTool2;
    case PadAction::kTool3:
      return HandsKey::kTool3;
    case PadAction::kCoag:
      return HandsKey::kCoag;
    case PadAction::kCut:
      return HandsKey::kCut;
    case PadAction::kFine:
      return HandsKey::kFine;
    case PadAction::kSteady:
      return HandsKey::kSteady;
    case PadAction::kClutch:
      return HandsKey::kClutch;
    case PadAction::kTake:
    case PadAction::kRelease:
      break;
  }
  return std::nullopt;
}

/// Share of the full speed for a deflection of 0 to 1.
float Curve(float deflection, float dead_zone) {
  const float beyond = std::clamp((deflection - dead_zone) / (1.0f - dead_zone), 0.0f, 1.0f);
  return beyond * beyond * beyond;
}

}  // namespace

const char* PadAxisName(PadAxis axis) { return kAxisNames[static_cast<std::size_t>(axis)]; }
const char* PadButtonName(PadButton button) { return kButtonNames[static_cast<std::size_t>(button)]; }
const char* PadActionName(PadAction action) { return kActionNames[static_cast<std::size_t>(action)]; }

PadSettings PadSettings::OfSpaceMouse() {
  PadSettings settings;
  settings.motion = {PadDirection{PadAxis::kX}, PadDirection{PadAxis::kY}, PadDirection{PadAxis::kZ}};
  settings.turn = PadDirection{PadAxis::kTurnZ};
  settings.buttons.fill(std::nullopt);
  settings.buttons[static_cast<std::size_t>(PadAction::kJaw)] = PadButton::kFirst;
  settings.buttons[static_cast<std::size_t>(PadAction::kCut)] = PadButton::kSecond;
  return settings;
}

Vec3f PadVelocity(const PadSettings& settings, const Vec3f& deflection) {
  Vec3f velocity = Vec3f::Zero();
  const float in_picture = deflection.head<2>().norm();
  if (in_picture > settings.dead_zone) {
    velocity.head<2>() = Curve(in_picture, settings.dead_zone) / in_picture * deflection.head<2>();
  }
  velocity.z() = std::copysign(Curve(std::abs(deflection.z()), settings.dead_zone), deflection.z());
  return settings.speed_m_s * velocity;
}

float PadTurn(const PadSettings& settings, float deflection) {
  return settings.turn_rad_s * std::copysign(Curve(std::abs(deflection), settings.dead_zone), deflection);
}

float PadRumble(const PadSettings& settings, float force_N) {
  return std::clamp((force_N - settings.rumble_from_N) / (settings.rumble_full_N - settings.rumble_from_N), 0.0f, 1.0f);
}

PadHands::Outcome PadHands::Update(const PadState* state, std::int64_t now_ns, MouseHands* hands) {
  Outcome outcome;
  if (!hands->active()) {
    effective_ = 0;
    operates_ = false;
  }
  const std::int64_t device = state != nullptr ? state->device : 0;
  if (device != device_) {
    // What the device held is not known any more, so nothing of it may stay.
    outcome.release = operates_;
    device_ = device;
    down_ = state != nullptr ? state->buttons : 0;
    moved_ns_ = now_ns;
    return outcome;
  }
  if (state == nullptr) return outcome;
  PressChanged(*state, hands, &outcome);
  const float passed_s = std::min(1e-9f * static_cast<float>(now_ns - moved_ns_), kLongestStep_s);
  moved_ns_ = now_ns;
  Vec3f deflection = Vec3f::Zero();
  for (std::size_t i = 0; i < settings_.motion.size(); ++i) {
    const auto& way = settings_.motion[i];
    if (way) deflection[static_cast<Eigen::Index>(i)] = way->sign * state->axes[static_cast<std::size_t>(way->axis)];
  }
  const Vec3f by = passed_s * PadVelocity(settings_, deflection);
  const auto& turn = settings_.turn;
  const float turned =
      turn ? passed_s * PadTurn(settings_, turn->sign * state->axes[static_cast<std::size_t>(turn->axis)]) : 0.0f;
  if (hands->active() && (!by.isZero() || turned != 0)) {
    hands->Push(by);
    hands->Roll(turned);
    outcome.changed = true;
  }
  operates_ = operates_ || outcome.changed || outcome.take;
  return outcome;
}

void PadHands::PressChanged(const PadState& state, MouseHands* hands, Outcome* outcome) {
  const std::uint32_t turned = state.buttons ^ down_;
  down_ = state.buttons;
  for (std::size_t i = 0; i < kPadActions; ++i) {
    const auto& button = settings_.buttons[i];
    if (!button || (turned >> static_cast<unsigned>(*button) & 1u) == 0) continue;
    const auto action = static_cast<PadAction>(i);
    const bool down = state.pressed(*button);
    if (action == PadAction::kTake) {
      outcome->take = outcome->take || (down && !hands->active());
    } else if (action == PadAction::kRelease) {
      outcome->release = outcome->release || (down && hands->active());
    } else if (hands->active()) {
      // A button that was down when the controls were taken has no effect, and none when it is let go.
      const std::uint32_t bit = 1u << i;
      if (!down && (effective_ & bit) == 0) continue;
      effective_ = down ? effective_ | bit : effective_ & ~bit;
      hands->Press(*KeyOf(action), down);
      outcome->changed = true;
    }
  }
}

}  // namespace fulcrum
