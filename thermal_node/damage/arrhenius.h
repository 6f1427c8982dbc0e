// Thermal damage as Arrhenius integrals: dOmega/dt = A exp(-Ea / (R T)).
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>

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

/// Excess temperature below which damage within a session is negligible [K].
inline constexpr float kDamageStart = 6.0f;
inline constexpr float kOmegaMax = 100.0f;        ///< Keeps the integral finite; 1 - exp(-100) is 1.
inline constexpr float kCharStart_C = 180.0f;     ///< Dry tissue begins to char; assumed.
inline constexpr float kCharRate_per_Ks = 0.05f;  ///< Charring per kelvin above that: 0.2 s at 280 C; assumed.

/// Rate of one pair as dOmega/dt = exp2(a - b / T). Evaluated element-wise, so loops over cells are vectorised and give
/// the same bits on every CPU.
class DamageRate {
 public:
  DamageRate(const ArrheniusPair& pair, float body_C);
  /// Rate at body temperature + theta [1/s]; below body temperature that at body temperature. Finite for any theta.
  [[nodiscard]] float At(float theta) const { return OfInverse(InverseKelvin(std::max(theta, 0.0f))); }

  /// First half of At(), shared by the rates of several pairs in loops over cells; theta >= 0.
  [[nodiscard, gnu::always_inline]] float InverseKelvin(float theta) const { return 1.0f / (body_K_ + theta); }
  /// Second half of At(): exp2 by the nearest integer and a series of the rest, relative error 3e-6; a - b / T lies
  /// within (-64, 155).
  [[nodiscard, gnu::always_inline]] float OfInverse(float inverse_K) const {
    const float x = a_ - b_ * inverse_K;
    const std::int32_t n = static_cast<std::int32_t>(x + 64.5f) - 64;
    const float f = x - static_cast<float>(n);
    const float series =
        1.0f + f * (0.69314718f + f * (0.24022651f + f * (0.05550411f + f * (0.00961813f + f * 0.00133336f))));
    return series * std::bit_cast<float>((std::min(n, 126) + 127) << 23);
  }

 private:
  float a_, b_, body_K_;
};

class DamageModel {
 public:
  explicit DamageModel(float body_C);
  /// Integrates both integrals and charring over dt at the tile's present temperature. Returns false if the damage of a
  /// cell was not finite; that cell is left unchanged.
  bool Update(Tile* tile, float dt_s) const;
  [[nodiscard]] const DamageRate& cell_death() const { return cell_death_; }

 private:
  DamageRate cell_death_, collagen_;
  float theta_char_;
};

}  // namespace fulcrum::thermal
