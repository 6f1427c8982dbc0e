// Model of the handle's microcontroller: potentiometer, 10-bit converter and line format, from an angle to bytes; and
// the damage that a bad cable does to the bytes.
#pragma once

#include <array>
#include <cstdint>
#include <random>
#include <string>
#include <string_view>

namespace fulcrum::handle_bridge {

struct JawFirmwareSettings {
  double closed_V = 2.37;  ///< At 0 degrees (paper).
  double open_V = 2.54;    ///< At open_deg.
  double open_deg = 60.0;
  double bow = 0;                  ///< Nonlinearity: excess voltage at mid-range, relative to the span.
  double adc_step_V = 5.0 / 1024;  ///< The paper rounds it to 0.00488.
  double noise_V = 0.001;          ///< Standard deviation; the paper's +-0.002 V is taken as two standard deviations.
  double tremor_deg = 0;           ///< Amplitude of the hand's tremor, two tones of 8 to 12 Hz.
};

class JawFirmware {
 public:
  JawFirmware(const JawFirmwareSettings& settings, std::uint64_t seed);

  /// One sample: nearest code of the noisy voltage at this jaw angle.
  int Convert(double jaw_deg);
  /// Plain line `d.dddd` CR LF of a code.
  [[nodiscard]] std::array<char, 8> Format(int code) const;
  std::array<char, 8> Line(double jaw_deg) { return Format(Convert(jaw_deg)); }

 private:
  JawFirmwareSettings settings_;
  std::mt19937_64 random_;
  std::normal_distribution<double> noise_;
  std::array<double, 2> tone_step_{};   ///< Tremor [rad/sample].
  std::array<double, 2> tone_phase_{};  ///< [rad]
};

/// Damage by a bad cable.
struct ByteDamage {
  double drop_probability = 0;
  double flip_probability = 0;  ///< Probability that one bit of a byte is flipped.
  bool garbage = false;         ///< Every byte is replaced by a random one.
};

class DamagedLine {
 public:
  explicit DamagedLine(std::uint64_t seed) : random_(seed) {}
  /// Appends the bytes of `sent` that arrive, damaged, to `received`.
  void Pass(std::string_view sent, const ByteDamage& damage, std::string* received);

 private:
  std::mt19937_64 random_;
};

}  // namespace fulcrum::handle_bridge
