// The handle's lines: a 10-bit code of the jaw potentiometer, 400 lines a second, as `d.dddd` volts (the paper's line)
// or in a frame (frame.h). Which of the two is told from each line by itself.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "handle_bridge/protocol/frame.h"

namespace fulcrum::handle_bridge {

inline constexpr double kLineRate_Hz = 400.0;
inline constexpr int kMaxCode = 1023;  ///< 10-bit converter.

/// Exactly `d.dddd` as ten-thousandths of a volt; nothing else is accepted.
[[nodiscard]] std::optional<int> ParseVoltage(std::string_view line) noexcept;

enum class LineVerdict {
  kGood,
  kMalformed,  ///< Neither `d.dddd` nor a whole frame.
  kOffGrid,    ///< Well formed, but no multiple of the converter's step: a damaged digit, or another step.
  kOutside,    ///< A true code, but beyond the calibrated ones: wiring.
  kJump,       ///< Too far from the last good code to be a jaw.
  kOther,      ///< A whole frame, but of the other handle or the pedal: plugs are swapped.
};

struct JawLineSettings {
  char sender = kLeftHandle;  ///< Whose frames are taken.
  double adc_step_V = 5.0 / 1024;
  int min_code = 485;  ///< Calibrated codes, closed interval.
  int max_code = 521;
};

struct JawReading {
  LineVerdict verdict = LineVerdict::kMalformed;
  int code = 0;            ///< Set unless malformed, off grid or another's.
  std::uint32_t lost = 0;  ///< Frames missing just before this one.
};

/// Strict gate from lines to codes. A reading is used only if its verdict is kGood.
///
/// The grid test is what makes an unframed protocol safe: the codes are 4.88 mV apart and the line has a resolution
/// of 0.0001 V, so 48 of 49 damaged values are not multiples of the step. No change of a single bit or digit that moves
/// the value by a count or more lands on the grid.
class JawLineGate {
 public:
  explicit JawLineGate(const JawLineSettings& settings) : settings_(settings) {}

  /// @param line without CR LF.
  JawReading Check(std::string_view line) noexcept;

  /// A sample period passed without a usable line: the jaw may have moved further.
  void Miss() noexcept;

  /// After a silence: any code may be next.
  void Reset() noexcept;
  /// After a new connection: also any sequence number.
  void Reconnected() noexcept;

  /// Tolerances, public for the tests.
  static constexpr double kGridTolerance = 0.0125;  ///< Counts; rounding to 0.0001 V is 0.0103 counts.
  static constexpr int kMaxJump = 4;  ///< Counts a period: 2700 deg/s, twice what fingers do, over 0.5 counts of noise.
  static constexpr int kOutsideMargin = 3;  ///< Counts beyond calibration that noise and play reach.
  static constexpr int kAgreeing = 3;       ///< Jumped codes that agree with each other are the truth.

 private:
  [[nodiscard]] JawReading CheckCode(int code) noexcept;

  JawLineSettings settings_;
  SequenceCounter sequence_;
  int last_code_ = -1;
  int allowed_jump_ = kMaxJump;
  int candidate_ = -1;
  int agreeing_ = 0;
};

/// Watches the codes for a broken wire or a bad contact: outside the calibrated codes, or jumping, in at least 4 of the
/// last 8 readings. A code that does not change is no fault: a jaw is held still for many seconds.
class WiringMonitor {
 public:
  void Add(LineVerdict verdict) noexcept {
    history_ = static_cast<std::uint8_t>(history_ << 1 |
                                         (verdict == LineVerdict::kOutside || verdict == LineVerdict::kJump ? 1 : 0));
  }
  [[nodiscard]] bool faulty() const noexcept { return __builtin_popcount(history_) >= 4; }
  void Reset() noexcept { history_ = 0; }

 private:
  std::uint8_t history_ = 0;
};

}  // namespace fulcrum::handle_bridge
