#include "handle_bridge/simulation/jaw_firmware.h"

#include <algorithm>
#include <cmath>

namespace fulcrum::handle_bridge {

int JawFirmware::Convert(double jaw_deg) {
  const double per_deg = (settings_.open_V - settings_.closed_V) / settings_.open_deg;
  const double volts = settings_.closed_V + per_deg * jaw_deg + settings_.noise_V * noise_(random_);
  constexpr double kFullScale = 1023;
  return static_cast<int>(std::clamp(std::round(volts / settings_.adc_step_V), 0.0, kFullScale));
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
    received->push_back(flip ? static_cast<char>(byte ^ (1 << (random_() % 8))) : byte);
  }
}

}  // namespace fulcrum::handle_bridge
