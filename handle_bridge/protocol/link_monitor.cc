#include "handle_bridge/protocol/link_monitor.h"

#include <algorithm>

namespace fulcrum::handle_bridge {

const char* Code(LinkState state) {
  switch (state) {
    case LinkState::kOk:
      return "ok";
    case LinkState::kNoData:
      return "no-data";
    case LinkState::kGarbage:
      return "garbage";
    case LinkState::kWrongBaud:
      return "wrong-baud";
    case LinkState::kWrongStep:
      return "wrong-step";
    case LinkState::kWiring:
      return "wire";
    case LinkState::kSwapped:
      return "swapped";
    case LinkState::kLost:
      return "hung-up";
    case LinkState::kReconnecting:
      return "no-port";
  }
  return "";
}

const char* Explain(LinkState state) {
  switch (state) {
    case LinkState::kOk:
      return "";
    case LinkState::kNoData:
      return "no bytes: check that it is powered and its transmit wire connected";
    case LinkState::kGarbage:
      return "under half of the lines are valid, at no usual speed: check cable, ground and what is plugged in";
    case LinkState::kWrongBaud:
      return "its baud rate differs from the cart's; the one found is used: correct `baud` in the cart";
    case LinkState::kWrongStep:
      return "voltages are not multiples of adc_step_V: set the step of this handle's converter";
    case LinkState::kWiring:
      return "codes outside the calibration or jumping: check the potentiometer's wires, or calibrate";
    case LinkState::kSwapped:
      return "another unit is plugged in here: swap the plugs, or correct `hand` in the cart";
    case LinkState::kLost:
      return "unplugged or powered off: plug it in, it reconnects automatically";
    case LinkState::kReconnecting:
      return "port not found: plug the adapter in; the search repeats four times a second";
  }
  return "";
}

LinkCounts& LinkCounts::operator+=(const LinkCounts& more) {
  bytes += more.bytes;
  good += more.good;
  malformed += more.malformed;
  off_grid += more.off_grid;
  implausible += more.implausible;
  other += more.other;
  lost += more.lost;
  return *this;
}

void LinkMonitor::Add(const LinkCounts& counts, double dt_s) {
  slots_[static_cast<std::size_t>(slot_)] += counts;
  seen_s_ = std::min(seen_s_ + dt_s, kWindow_s);
  // A late tick has looked once. A real line's bytes wait for it in the kernel, but a simulated unit runs in the same
  // process: it was stopped as well, and sends after this tick.
  silent_s_ = counts.bytes > 0 ? 0.0 : std::min(silent_s_ + std::min(dt_s, kMostPerTick_s), kWindow_s);
  slot_age_s_ += dt_s;
  // After a stall longer than the window every slot is stale, so one round is enough.
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
  // Tolerance for rounding of the ticks, without which the window might never count as full.
  constexpr double kFull = 0.99 * kWindow_s;
  if (seen_s_ < kFull) {
    return LinkState::kOk;
  }
  const LinkCounts sum = Sum();
  if (sum.bytes == 0) {
    return LinkState::kOk;  // Of a window that a stall has emptied, until the silence has lasted.
  }
  if (2 * (sum.good + sum.implausible) >= sum.lines() && sum.lines() > 0) {
    return LinkState::kOk;
  }
  if (std::max(sum.other, sum.off_grid) <= sum.malformed) {
    return LinkState::kGarbage;
  }
  return sum.other > sum.off_grid ? LinkState::kSwapped : LinkState::kWrongStep;
}

}  // namespace fulcrum::handle_bridge
