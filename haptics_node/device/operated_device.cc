#include "haptics_node/device/operated_device.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "services/base/core/operator_choice.h"

namespace fulcrum::haptics {
namespace {

/// Fastest motion of the intended attach point [m/s]: faster than a surgeon's hand in a dissection, and slow enough
/// that an operator who takes the controls with another place in mind does not strike the tissue.
constexpr double kFastest_m_s = 0.6;
constexpr double kFastestTurn_rad_s = 6;
constexpr float kPi = std::numbers::pi_v<float>;

}  // namespace

OperatedDevice::OperatedDevice(const HandModel& hand, const Trocar& trocar, const Vec3d& start)
    : hand_(hand), trocar_(trocar) {
  hand_.Place(start);
}

void OperatedDevice::Follow(const OperatorTool& intention, std::int64_t stamp_ns) noexcept {
  // Another hand may count its turns anew: the tool is turned alike, and must not turn there once more.
  const bool begins =
      intention.moves && (!intention_.moves || std::abs(intention.roll_rad - intention_.roll_rad) > kPi);
  if (begins) roll_ += 2 * kPi * std::round((intention.roll_rad - roll_) / (2 * kPi));
  intention_ = intention;
  intention_ns_ = stamp_ns;
}

Vec3d OperatedDevice::ReadPosition(const Tick& tick) noexcept {
  const double elapsed_s = stamp_ns_ == 0 ? 0 : 1e-9 * static_cast<double>(tick.stamp_ns - stamp_ns_);
  stamp_ns_ = tick.stamp_ns;
  if (elapsed_s <= 0) return hand_.position();
  const bool operated = intention_.moves && tick.stamp_ns - intention_ns_ <= kOperatorSilence_ns;
  if (!operated) {
    hand_.LetGo(force_, elapsed_s);
    return hand_.position();
  }
  const Vec3d way = AttachPointForTip(trocar_, intention_.p_WT.cast<double>()) - hand_.target();
  const double longest = kFastest_m_s * elapsed_s;
  hand_.Advance(hand_.target() + way * std::min(1.0, longest / std::max(way.norm(), longest)), force_, elapsed_s);
  const auto widest = static_cast<float>(kFastestTurn_rad_s * elapsed_s);
  roll_ += std::clamp(intention_.roll_rad - roll_, -widest, widest);
  return hand_.position();
}

}  // namespace fulcrum::haptics
