#include "handle_bridge/simulation/jaw_firmware.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "handle_bridge/protocol/jaw_line.h"

namespace fulcrum::handle_bridge {

JawFirmware::JawFirmware(const JawFirmwareSettings& settings, std::uint64_t seed) : settings_(settings), random_(seed) {
  constexpr double kTwoPi = 2 * std::numbers::pi;
  std::mt19937_64 tones(seed);  // A separate generator, so that the noise is the same with and without tremor.
  std::uniform_real_distribution<double> frequency_Hz(8, 12), phase(0, kTwoPi);
  for (std::size_t i = 0; i < tone_step_.size(); ++i) {
    tone_step_[i] = kTwoPi * frequency_Hz(tones) / kLineRate_Hz;
    tone_phase_[i] = phase(tones);
  }
}

int JawFirmware::Convert(double jaw_deg) {
  double angle_deg = jaw_deg;
  for (std::size_t i = 0; i < tone_step_.size(); ++i) {
    angle_deg += 0.5 * settings_.tremor_deg * std::sin(tone_phase_[i]);
    tone_phase_[i] += tone_step_[i];
  }
  const double x = angle_deg / settings_.open_deg;
  const double share = x + 4 * settings_.bow * x * (1 - x);
  const double volts =
      settings_.closed_V + (settings_.open_V - settings_.closed_V) * share + settings_.noise_V * noise_(random_);
  return static_cast<int>(std::clamp(std::round(volts / settings_.adc_step_V), 0.0, static_cast<double>(kMaxCode)));
}

std::array<char, 8> JawFirmware::Format(int code) const {
  constexpr double kUnitsPerVolt = 1e4;
  long units = std::lround(code * settings_.adc_step_V * kUnitsPerVolt);
  std::array<char, 8> line = {'0', '.', '0', '0', '0', '0', '\r', '\n'};
  for (const std::size_t place : {5, 4, 3, 2, 0}) {
    line[place] = static_cast<char>('0' + units % 10);
    units /= 10;
  }
  return line;
}

void DamagedLine::Pass(std::string_view sent, const ByteDamage& damage, std::string* received) {
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  for (const char byte : sent) {
    const double u = uniform(random_);
    if (u < damage.drop_probability) {
      continue;
    }
    const bool flip = u < damage.drop_probability + damage.flip_probability;
    received->push_back(damage.garbage ? static_cast<char>(random_())
                        : flip         ? static_cast<char>(byte ^ (1 << (random_() % 8)))
                                       : byte);
  }
}

}  // namespace fulcrum::handle_bridge
