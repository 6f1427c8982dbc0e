// The foot pedal: bytes in, pedal bits and the state of its link out.
#pragma once

#include <cstdint>
#include <span>

#include "handle_bridge/protocol/frame.h"
#include "handle_bridge/protocol/line_framer.h"
#include "handle_bridge/protocol/link_monitor.h"

namespace fulcrum::handle_bridge {

class PedalChannel {
 public:
  /// One tick of the open link, `dt_s` after the last one.
  void Tick(std::span<const char> bytes, double dt_s) noexcept;
  void Reconnected() noexcept;
  /// One tick without connection: all pedals are up.
  void Disconnected() noexcept { pedals_ = 0; }

  /// PedalBits; 0 if the last valid line is older than kPedalTimeout_s.
  [[nodiscard]] std::uint8_t pedals() const noexcept { return pedals_; }
  [[nodiscard]] LinkState state() const noexcept { return monitor_.state(); }
  /// Counts of the last tick.
  [[nodiscard]] const LinkCounts& tick_counts() const noexcept { return tick_counts_; }
  /// Counts since the start.
  [[nodiscard]] const LinkCounts& totals() const noexcept { return totals_; }

 private:
  void TakeLine(std::string_view line) noexcept;

  LineFramer framer_;
  SequenceCounter sequence_;
  LinkMonitor monitor_;
  LinkCounts tick_counts_;
  LinkCounts totals_;
  double age_s_ = 0;  ///< Age of the last valid line [s].
  std::uint8_t pedals_ = 0;
};

}  // namespace fulcrum::handle_bridge
