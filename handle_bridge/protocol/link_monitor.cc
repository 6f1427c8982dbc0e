#include "handle_bridge/protocol/link_monitor.h"

#include <algorithm>

namespace fulcrum::handle_bridge {

const char* Explain(LinkState state) {
  switch (state) {
    case LinkState::kOk:
      return "";
    case LinkState::kNoData:
      return "no data: check that the handle is powered and its transmit wire connected";
    case LinkState::kGarbage:
      return "less than half of the lines are valid: check the baud rate (115200 8N1)";
    case LinkState::kWrongStep:
      return "voltages are not multiples of adc_step_V: set the step of this handle's converter";
    case LinkState::kWiring:
      return "codes outside the calibration or jumping: check the potentiometer's wires";
    case LinkState::kLost:
      return "hung up: unplugged or powered off";
    case LinkState::kReconnecting:
      return "port not found: plug the adapter in; it is looked for four times a second";
  }
  return "";
}

LinkCounts& LinkCounts::operator+=(const LinkCounts& other) {
  bytes += other.bytes;
  good += other.good;
  malformed += other.malformed;
  off_grid += other.off_grid;
  implausible += other.implausible;
  return *this;
}

void LinkMonitor::Add(const LinkCounts& counts, double dt_s) {
  slots_[static_cast<std::size_t>(slot_)] += counts;
  seen_s_ = std::min(seen_s_ + dt_s, kWindow_s);
  silent_s_ = counts.bytes > 0 ? 0.0 : std::min(silent_s_ + dt_s, kWindow_s);
  slot_age_s_ += dt_s;
  // After a stall of the whole window every slot is stale; going round once more changes nothing.
  for (int turn = 0; slot_age_s_ >= kWindow_s / kSlots && turn < kSlots; ++turn) {
    slot_age_s_ -= kWindow_s / kSlots;
    slot_ = (slot_ + 1) % kSlots;
    slots_[static_cast<std::size_t>(slot_)] = {};
  }
  slot_age_s_ = std::min(slot_age_s_, kWindow_s / kSlots);
}

LinkCounts LinkMonitor::Sum() const {
  LinkCounts sum;
  for (const LinkCounts& slot : slots_) {
    sum += slot;
  }
  return sum;
}

float LinkMonitor::quality() const {
  const LinkCounts sum = Sum();
  if (silent_s_ >= kSilence_s || sum.lines() == 0) {
    return 0.0f;
  }
  return static_cast<float>(sum.good) / static_cast<float>(sum.lines());
}

LinkState LinkMonitor::state() const {
  if (silent_s_ >= kSilence_s) {
    return LinkState::kNoData;
  }
  // A tick's rounding must not keep the window from ever being full.
  constexpr double kFull = 0.99 * kWindow_s;
  if (seen_s_ < kFull) {
    return LinkState::kOk;
  }
  const LinkCounts sum = Sum();
  const std::uint32_t formed = sum.good + sum.implausible;
  if (2 * formed >= sum.lines() && sum.lines() > 0) {
    return LinkState::kOk;
  }
  return sum.off_grid > sum.malformed ? LinkState::kWrongStep : LinkState::kGarbage;
}

}  // namespace fulcrum::handle_bridge
