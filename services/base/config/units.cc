#include "services/base/config/units.h"

#include <array>
#include <numbers>

namespace fulcrum::config {
namespace {

constexpr std::array kUnits = {
    Unit{"m", "m", "length", 1.0},
    Unit{"cm", "cm", "length", 1e-2},
    Unit{"mm", "mm", "length", 1e-3},
    Unit{"um", "um", "length", 1e-6},
    Unit{"s", "s", "time", 1.0},
    Unit{"ms", "ms", "time", 1e-3},
    Unit{"us", "us", "time", 1e-6},
    Unit{"min", "min", "time", 60.0},
    Unit{"kg", "kg", "mass", 1.0},
    Unit{"g", "g", "mass", 1e-3},
    Unit{"N", "N", "force", 1.0},
    Unit{"mN", "mN", "force", 1e-3},
    Unit{"W", "W", "power", 1.0},
    Unit{"mW", "mW", "power", 1e-3},
    Unit{"V", "V", "voltage", 1.0},
    Unit{"mV", "mV", "voltage", 1e-3},
    Unit{"A", "A", "current", 1.0},
    Unit{"mA", "mA", "current", 1e-3},
    Unit{"Pa", "Pa", "pressure", 1.0},
    Unit{"kPa", "kPa", "pressure", 1e3},
    Unit{"MPa", "MPa", "pressure", 1e6},
    Unit{"Hz", "Hz", "frequency", 1.0},
    Unit{"kHz", "kHz", "frequency", 1e3},
    Unit{"rad", "rad", "angle", 1.0},
    Unit{"deg", "deg", "angle", std::numbers::pi / 180.0},
    Unit{"rad_s", "rad/s", "angular velocity", 1.0},
    Unit{"deg_s", "deg/s", "angular velocity", std::numbers::pi / 180.0},
    Unit{"C", "C", "temperature", 1.0},
    Unit{"K", "K", "temperature difference", 1.0},
    Unit{"percent", "%", "fraction", 1e-2},
    Unit{"m_s", "m/s", "velocity", 1.0},
    Unit{"mm_s", "mm/s", "velocity", 1e-3},
    Unit{"m_s2", "m/s2", "acceleration", 1.0},
    Unit{"per_s", "1/s", "rate", 1.0},
    Unit{"per_ms", "1/ms", "rate", 1e3},
    Unit{"per_K", "1/K", "per temperature", 1.0},
    Unit{"per_m", "1/m", "curvature", 1.0},
    Unit{"N_m", "N/m", "stiffness", 1.0},
    Unit{"N_mm", "N/mm", "stiffness", 1e3},
    Unit{"Nm", "Nm", "moment", 1.0},
    Unit{"uNm", "uNm", "moment", 1e-6},
    Unit{"N_per_m", "N/m", "stiffness", 1.0},
    Unit{"N_per_mm", "N/mm", "stiffness", 1e3},
    Unit{"N_per_ms", "N/ms", "force rate", 1e3},
    Unit{"N_per_s", "N/s", "force rate", 1.0},
    Unit{"Ns_m", "Ns/m", "damping", 1.0},
    Unit{"kg_m3", "kg/m3", "density", 1.0},
    Unit{"kg_m2", "kg/m2", "areal density", 1.0},
    Unit{"J_m3", "J/m3", "energy density", 1.0},
    Unit{"J_kgK", "J/kgK", "specific heat capacity", 1.0},
    Unit{"W_mK", "W/mK", "thermal conductivity", 1.0},
    Unit{"W_m2K", "W/m2K", "heat transfer", 1.0},
    Unit{"S_m", "S/m", "electrical conductivity", 1.0},
};

}  // namespace

const Unit* UnitOfKey(std::string_view key) {
  const Unit* best = nullptr;
  for (const Unit& unit : kUnits) {
    const std::size_t n = unit.key_suffix.size();
    if (key.size() > n + 1 && key.ends_with(unit.key_suffix) && key[key.size() - n - 1] == '_' &&
        (!best || n > best->key_suffix.size())) {
      best = &unit;
    }
  }
  return best;
}

const Unit* UnitOfSpelling(std::string_view text) {
  std::string plain;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const std::string_view rest = text.substr(i);
    if (rest.starts_with("µ") || rest.starts_with("μ")) {  // Micro sign and Greek mu look the same.
      plain += 'u';
      ++i;
    } else if (rest.starts_with("·") || rest.starts_with("°")) {
      ++i;
    } else if (rest.starts_with("²")) {
      plain += '2';
      ++i;
    } else if (rest.starts_with("³")) {
      plain += '3';
      ++i;
    } else if (std::string_view(" ()*^").find(text[i]) == std::string_view::npos) {
      plain += text[i];
    }
  }
  const std::string_view wanted = plain == "degC" ? std::string_view("C") : std::string_view(plain);
  for (const Unit& unit : kUnits) {
    if (wanted == unit.spelling || wanted == unit.key_suffix) {
      return &unit;
    }
  }
  return nullptr;
}

}  // namespace fulcrum::config
