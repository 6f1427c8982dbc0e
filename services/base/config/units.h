// Units that configuration keys and quantities may carry.
//
// A key that stands for a physical quantity ends in its unit: `thickness_mm: 0.3`. The value may repeat a unit of the
// same dimension, `thickness_mm: "300 um"`; another dimension is refused.
#pragma once

#include <string>
#include <string_view>

namespace fulcrum::config {

struct Unit {
  std::string_view key_suffix;  ///< As at the end of a key: "W_m2K".
  std::string_view spelling;    ///< Usual spelling, without blanks, brackets and points: "W/m2K".
  std::string_view dimension;   ///< "length", "heat transfer": units of one dimension convert into each other.
  double si;                    ///< Factor: value in SI = value * si. Temperatures are in degrees Celsius throughout.
};

/// Unit named by the longest suffix `_unit` of a key; nullptr for a dimensionless key.
[[nodiscard]] const Unit* UnitOfKey(std::string_view key);

/// Unit written after a number: "mm", "W/(m2 K)", "µm", "°C" and the suffix forms. nullptr if it is unknown.
[[nodiscard]] const Unit* UnitOfSpelling(std::string_view text);

}  // namespace fulcrum::config
