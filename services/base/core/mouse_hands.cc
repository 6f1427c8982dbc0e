#include "services/base/core/mouse_hands.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "services/base/core/scope.h"

namespace fulcrum {
namespace {

constexpr float kOpenJaw_rad = 0.7f;  ///< Without a button.
/// Distance of a scope's tip from its pivot, about which a motion of the pointer turns the view [m].
constexpr float kScopeLever_m = 0.12f;
constexpr float kRollStep_rad = 5 * std::numbers::pi_v<float> / 180;
constexpr float kWheelStep_m = 1.0e-3f;  ///< Along the view.
constexpr float kFine = 0.25f;           ///< Factor of the motion while kFine is held.
/// Longest distance of the intended place from the tip [m]: tissue that holds the tool must not store a motion that is
/// released later.
constexpr float kLongestLead_m = 0.04f;
/// Time constant of the filter against tremor [s]: tremor of a hand is 8 to 12 Hz.
constexpr float kSteady_s = 0.06f;

}  // namespace

bool IsClosed(float jaw_rad, bool scope) {
  return scope ? jaw_rad > 0.5f * kZoomRing_rad : jaw_rad < 0.5f * kOpenJaw_rad;
}

void MouseHands::SetView(const HandsView& view) {
  for (std::size_t i = 0; i < view.present.size(); ++i) {
    if (!view.present[i] || view_.present[i]) continue;
    wanted_[i] = sent_[i] = view.tip[i];
    roll_[i] = view.roll_rad[i];
    locked_[i] = view.closed[i];
  }
  view_ = view;
  const auto first = std::find(view_.present.begin(), view_.present.end(), true);
  if (!view_.present[static_cast<std::size_t>(tool_)] && first != view_.present.end()) {
    tool_ = static_cast<int>(first - view_.present.begin());
  }
}

void MouseHands::Take(std::int64_t now_ns) {
  claim_ns_ = sent_ns_ = now_ns;
  wanted_ = sent_ = view_.tip;
  roll_ = view_.roll_rad;
  locked_ = view_.closed;
}

void MouseHands::Release() {
  claim_ns_ = 0;
  pedals_ = kPedalNone;
  jaw_down_ = clutch_ = depth_ = fine_ = false;
}

void MouseHands::MoveTip(const Vec3f& by) {
  if (!active() || clutch_) return;
  const auto tool = static_cast<std::size_t>(tool_);
  Vec3f& wanted = wanted_[tool];
  wanted += (fine_ ? kFine : 1.0f) * by;
  const Vec3f lead = wanted - view_.tip[tool];
  if (lead.norm() > kLongestLead_m) wanted = view_.tip[tool] + kLongestLead_m * lead.normalized();
}

void MouseHands::Move(float x, float y) {
  // The tip stays under the pointer: a pixel is as large as it is at the depth of the tip.
  // The picture of a scope follows it.
  const auto tool = static_cast<std::size_t>(tool_);
  const float depth =
      view_.scope[tool] ? kScopeLever_m : std::max(0.01f, view_.forward.dot(view_.tip[tool] - view_.eye));
  const float metres = depth * view_.pixel;
  MoveTip(depth_ ? Vec3f(metres * y * view_.forward + metres * x * view_.right)
                 : Vec3f(metres * (x * view_.right + y * view_.up)));
}

void MouseHands::Turn(int steps) { MoveTip(kWheelStep_m * static_cast<float>(steps) * view_.forward); }

void MouseHands::Roll(float by_rad) {
  constexpr float kTurn = 2 * std::numbers::pi_v<float>;
  if (!active() || clutch_) return;
  float& roll = roll_[static_cast<std::size_t>(tool_)];
  roll = std::clamp(roll + (fine_ ? kFine : 1.0f) * by_rad, -kTurn, kTurn);
}

void MouseHands::Choose(int tool) {
  if (tool == tool_ || !view_.present[static_cast<std::size_t>(tool)]) return;
  // The tool that is left keeps what it holds, and the jaw of the new one waits for the next press.
  if (jaw_down_) locked_[static_cast<std::size_t>(tool_)] = true;
  jaw_down_ = false;
  tool_ = tool;
}

void MouseHands::Push(const Vec3f& by) { MoveTip(by.x() * view_.right + by.y() * view_.up + by.z() * view_.forward); }

void MouseHands::Press(HandsKey key, bool down) {
  if (!active()) return;
  const auto pedal = [&](std::uint8_t bit) {
    pedals_ = static_cast<std::uint8_t>(down ? pedals_ | bit : pedals_ & ~bit);
  };
  switch (key) {
    case HandsKey::kTool0:
    case HandsKey::kTool1:
    case HandsKey::kTool2:
    case HandsKey::kTool3:
      if (down) Choose(static_cast<int>(key) - static_cast<int>(HandsKey::kTool0));
      return;
    case HandsKey::kRollLeft:
    case HandsKey::kRollRight:
      if (down) Roll(key == HandsKey::kRollLeft ? -kRollStep_rad : kRollStep_rad);
      return;
    case HandsKey::kJaw:
      jaw_down_ = down;
      return;
    case HandsKey::kJawLock:
      if (down) locked_[static_cast<std::size_t>(tool_)] = !locked_[static_cast<std::size_t>(tool_)];
      return;
    case HandsKey::kCut:
      pedal(kPedalCut);
      return;
    case HandsKey::kCoag:
      pedal(kPedalCoag);
      return;
    case HandsKey::kClutch:
      clutch_ = down;
      return;
    case HandsKey::kDepth:
      depth_ = down;
      return;
    case HandsKey::kFine:
      fine_ = down;
      return;
    case HandsKey::kSteady:
      if (down) steady_ = !steady_;
      return;
  }
}

OperatorInput MouseHands::At(std::int64_t now_ns) {
  OperatorInput input;
  input.source = source_;
  input.claim_ns = claim_ns_;
  input.stamp.stamp_ns = now_ns;
  if (!active()) return input;
  input.pedals = pedals_;
  const float passed_s = 1e-9f * static_cast<float>(now_ns - sent_ns_);
  sent_ns_ = now_ns;
  const float share = steady_ ? 1.0f - std::exp(-passed_s / kSteady_s) : 1.0f;
  for (std::size_t i = 0; i < input.tools.size(); ++i) {
    sent_[i] += share * (wanted_[i] - sent_[i]);
    const bool closed = locked_[i] || (jaw_down_ && static_cast<std::size_t>(tool_) == i);
    // The jaw of a scope is its zoom ring.
    const float jaw = view_.scope[i] ? (closed ? kZoomRing_rad : 0.0f) : closed ? 0.0f : kOpenJaw_rad;
    input.tools[i] = {sent_[i], jaw, roll_[i], view_.present[i]};
  }
  return input;
}

}  // namespace fulcrum
