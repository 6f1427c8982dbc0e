// The handle's lines: a 10-bit code of the jaw potentiometer, 400 lines a second, as `d.dddd` volts (the paper's line)
// or in a frame (frame.h). Each line is recognised as one of the two by its first character.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "handle_bridge/protocol/frame.h"

namespace fulcrum::handle_bridge {

inline constexpr double kLineRate_Hz = 400.0;
inline constexpr int kMaxCode = 1023;  ///< 10-bit converter.

/// Parses exactly `d.dddd`; returns ten-thousandths of a volt, or no value for any other text.
[[nodiscard]] std::optional<int> ParseVoltage(std::string_view line) noexcept;

enum class LineVerdict {
  kGood,
  kMalformed,  ///< Neither `d.dddd` nor a valid frame.
  kOffGrid,    ///< Well formed, but not a multiple of the converter's step: a damaged digit, or another step.
  kOutside,    ///< Valid code beyond the calibrated range: a fault of the wiring.
  kJump,       ///< Too far from the last good code for the motion of a jaw.
  kOther,      ///< Valid frame of the other handle or the pedal: the plugs are swapped.
};

struct JawLineSettings {
  char sender = kLeftHandle;  ///< Sender whose frames are accepted.
  double adc_step_V = 5.0 / 1024;
  int min_code = 485;  ///< Calibrated codes, closed interval.
  int max_code = 521;
};

struct JawReading {
  LineVerdict verdict = LineVerdict::kMalformed;
  int code = 0;            ///< Set unless malformed, off grid or of another sender.
  std::uint32_t lost = 0;  ///< Frames missing just before this one.
};

/// Strict check that converts lines into codes. A reading is used only if its verdict is kGood.
///
/// The grid test makes the unframed protocol safe: the codes are 4.88 mV apart and the line has a resolution of 0.0001
/// V, so 48 of 49 damaged values are not multiples of the step. No change of a single bit or digit that moves the value
/// by a count or more lands on the grid.
class JawLineGate {
 public:
  explicit JawLineGate(const JawLineSettings& settings) : settings_(settings) {}

  /// @param line without CR LF.
  JawReading Check(std::string_view line) noexcept;

  /// Registers a sample period without a usable line: the jaw may have moved further, so the allowed jump grows.
  void Miss() noexcept;

  /// Call after a silence: any code is accepted next.
  void Reset() noexcept;
  /// Call after a reconnection: any code and any sequence number are accepted next.
  void Reconnected() noexcept;

  /// Tolerances, public for the tests.
  static constexpr double kGridTolerance = 0.0125;  ///< [counts]; rounding to 0.0001 V is 0.0103 counts.
  /// [counts per period]: 2700 deg/s, twice the speed of fingers, above 0.5 counts of noise.
  static constexpr int kMaxJump = 4;
  static constexpr int kOutsideMargin = 3;  ///< Counts beyond the calibration that noise and mechanical play can reach.
  static constexpr int kAgreeing = 3;       ///< Number of consecutive jumped codes that must agree to be accepted.

 private:
  [[nodiscard]] JawReading CheckCode(int code) noexcept;

  JawLineSettings settings_;
  SequenceCounter sequence_;
  int last_code_ = -1;
  int allowed_jump_ = kMaxJump;
  int candidate_ = -1;
  int agreeing_ = 0;
};

/// Detects a broken wire or a bad contact: at least 4 of the last 8 codes outside the calibration or jumping. A
/// constant code is not a fault, because a jaw may be held still for many seconds.
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
