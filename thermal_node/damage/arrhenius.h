// Thermal damage as Arrhenius integrals: dOmega/dt = A exp(-Ea / (R T)).
#pragma once

#include <array>

#include "thermal_node/heat/tile.h"

namespace fulcrum::thermal {

struct ArrheniusPair {
  double a_per_s;
  double ea_J_mol;
};
/// Cell death: Omega = 1 after 510 s at 43 C, 3.5 s at 60 C (lab values).
inline constexpr ArrheniusPair kCellDeath{7.39e39, 2.577e5};
/// Collagen denaturation, which blanches and shrinks.
inline constexpr ArrheniusPair kCollagen{1.606e45, 3.06e5};

inline constexpr float kDamageStart = 6.0f;       ///< Below this nothing happens within a session [K].
inline constexpr float kOmegaMax = 100.0f;        ///< Keeps the integral finite; 1 - exp(-100) is 1.
inline constexpr float kCharStart_C = 180.0f;     ///< Dry tissue begins to char; assumed.
inline constexpr float kCharRate_per_Ks = 0.05f;  ///< Charring per kelvin above that: 0.2 s at 280 C; assumed.

/// Rate over temperature, tabulated: linear between 0.25 K nodes is within 0.1 %.
class DamageRate {
 public:
  DamageRate(const ArrheniusPair& pair, float body_C);
  /// Rate at body temperature + theta [1/s].
  [[nodiscard]] float At(float theta) const {
    const float x = theta * kPerKelvin;
    if (!(x > 0.0f)) return table_[0];
    const int k = x < static_cast<float>(kNodes - 1) ? static_cast<int>(x) : kNodes - 2;
    const float f = x - static_cast<float>(k);
    return table_[k] + (f < 1.0f ? f : 1.0f) * (table_[k + 1] - table_[k]);
  }

 private:
  static constexpr float kPerKelvin = 4.0f;
  static constexpr int kNodes = 4 * 160 + 1;  ///< Up to 160 K above body: there a cell is dead within a frame.
  std::array<float, kNodes> table_{};
};

class DamageModel {
 public:
  explicit DamageModel(float body_C);
  /// Integrates both integrals and charring over dt at the tile's present temperature. False when a cell's damage was
  /// no number: it is left as it was.
  bool Update(Tile* tile, float dt_s) const;
  [[nodiscard]] const DamageRate& cell_death() const { return cell_death_; }
  [[nodiscard]] const DamageRate& collagen() const { return collagen_; }

 private:
  DamageRate cell_death_, collagen_;
  float theta_char_;
};

}  // namespace fulcrum::thermal
