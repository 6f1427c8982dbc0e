// What a serial link is doing, judged by what arrives over half a second.
#pragma once

#include <array>
#include <cstdint>

namespace fulcrum::handle_bridge {

enum class LinkState : std::uint8_t {
  kOk,
  kNoData,        ///< Open, but silent.
  kGarbage,       ///< Bytes arrive, but less than half of the lines are valid, and no usual speed makes them so.
  kWrongBaud,     ///< Valid lines, at another speed than the cart's.
  kWrongStep,     ///< Lines are well formed but off the converter's grid: another adc_step_V.
  kWiring,        ///< True codes outside calibration or jumping.
  kSwapped,       ///< Whole frames, but of the other handle or the pedal.
  kLost,          ///< Hung up: unplugged or powered off.
  kReconnecting,  ///< Looking for the port.
};

/// A word for lists and searches, "wrong-baud"; "ok" for kOk.
const char* Code(LinkState state);
/// What is wrong and what to do, in one line for people. Empty for kOk.
const char* Explain(LinkState state);

/// Counts of one tick.
struct LinkCounts {
  std::uint32_t bytes = 0;
  std::uint32_t good = 0;       ///< Lines used.
  std::uint32_t malformed = 0;  ///< Lines that are none.
  std::uint32_t off_grid = 0;
  std::uint32_t implausible = 0;  ///< Outside or jumping.
  std::uint32_t other = 0;        ///< Of another sender.
  std::uint32_t lost = 0;         ///< Frames that the sequence misses: lost whole, or malformed.
  [[nodiscard]] std::uint32_t lines() const { return formed() + malformed; }
  /// Lines that only a sender at our speed can have sent.
  [[nodiscard]] std::uint32_t formed() const { return good + off_grid + implausible + other; }
  LinkCounts& operator+=(const LinkCounts& more);
};

/// Sliding window of 0.5 s in ten slots.
class LinkMonitor {
 public:
  static constexpr double kWindow_s = 0.5;
  /// The kernel's worker that delivers a terminal's bytes was seen 70 ms late on a machine loaded fourfold.
  static constexpr double kSilence_s = 0.2;

  /// Adds one tick's counts; `dt_s` is the time since the last call.
  void Add(const LinkCounts& counts, double dt_s);
  void Reset() { *this = LinkMonitor(); }

  /// Share of the window's lines that were used, 0 … 1; 0 while silent.
  [[nodiscard]] float quality() const;
  /// kOk, kNoData, kGarbage, kWrongStep or kSwapped. kOk until half a second has been seen, unless silent.
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
