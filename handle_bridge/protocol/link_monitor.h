// State of a serial link, derived from the lines that arrive within half a second.
#pragma once

#include <array>
#include <cstdint>

namespace fulcrum::handle_bridge {

enum class LinkState : std::uint8_t {
  kOk,
  kNoData,        ///< Open, but silent.
  kGarbage,       ///< Bytes arrive, but less than half of the lines are valid, at any common speed.
  kWrongBaud,     ///< Lines are valid, but at another speed than the cart's.
  kWrongStep,     ///< Lines are well formed, but their voltages are not multiples of the cart's adc_step_V.
  kWiring,        ///< Valid codes that lie outside the calibration or jump.
  kSwapped,       ///< Valid frames of the other handle or the pedal.
  kLost,          ///< Hung up: unplugged or powered off.
  kReconnecting,  ///< The port has not been found yet.
};

/// Short code for logs and searches, such as "wrong-baud"; "ok" for kOk.
const char* Code(LinkState state);
/// Fault and remedy, in one line for people; empty for kOk.
const char* Explain(LinkState state);

/// Counts of one tick.
struct LinkCounts {
  std::uint32_t bytes = 0;
  std::uint32_t good = 0;       ///< Lines used.
  std::uint32_t malformed = 0;  ///< Lines that do not follow the protocol.
  std::uint32_t off_grid = 0;
  std::uint32_t implausible = 0;  ///< Codes outside the calibration or jumping.
  std::uint32_t other = 0;        ///< Valid frames of another sender.
  std::uint32_t lost = 0;         ///< Gaps in the sequence: frames that were lost or malformed.
  [[nodiscard]] std::uint32_t lines() const { return formed() + malformed; }
  /// Lines that can only come from a sender at this speed.
  [[nodiscard]] std::uint32_t formed() const { return good + off_grid + implausible + other; }
  LinkCounts& operator+=(const LinkCounts& more);
};

/// Sliding window of 0.5 s in ten slots.
class LinkMonitor {
 public:
  static constexpr double kWindow_s = 0.5;
  /// Time without bytes that counts as silence. The kernel worker that delivers a terminal's bytes was up to 70 ms late
  /// on a machine with fourfold load.
  static constexpr double kSilence_s = 0.2;

  /// Silence that one tick can add, however late it is.
  static constexpr double kMostPerTick_s = 0.05;

  /// Adds one tick's counts; `dt_s` is the time since the last call.
  void Add(const LinkCounts& counts, double dt_s);
  void Reset() { *this = LinkMonitor(); }

  /// Share of the window's lines that are good, 0 … 1; 0 while silent.
  [[nodiscard]] float quality() const;
  /// kOk, kNoData, kGarbage, kWrongStep or kSwapped. kOk during the first half second, unless silent.
  [[nodiscard]] LinkState state() const;

 private:
  static constexpr int kSlots = 10;
  std::array<LinkCounts, kSlots> slots_{};
  int slot_ = 0;
  double slot_age_s_ = 0;
  double seen_s_ = 0;
  double silent_s_ = 0;
  [[nodiscard]] LinkCounts Sum() const;
};

}  // namespace fulcrum::handle_bridge
