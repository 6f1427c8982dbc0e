#include "thermal_node/damage/arrhenius.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "thermal_node/heat/wide.h"

namespace fulcrum::thermal {
namespace {

constexpr double kGas_J_molK = 8.314462618;
constexpr double kZero_C = 273.15;

struct TileRates {
  DamageRate cell_death, collagen;
  float theta_char;
};

/// Advances both integrals and charring of the cells of a row.
[[gnu::always_inline]] inline void DamageCells(const TileRates& rates, float dt_s, int count,
                                               const float* __restrict theta, float* __restrict cell,
                                               float* __restrict collagen, float* __restrict charred) {
  for (int i = 0; i < count; ++i) {
    const float dt = theta[i] < kDamageStart ? 0.0f : dt_s;
    const float inverse_K = rates.cell_death.InverseKelvin(theta[i] > kDamageStart ? theta[i] : kDamageStart);
    const float above = theta[i] - rates.theta_char;
    const float dead = cell[i] + dt * rates.cell_death.OfInverse(inverse_K);
    const float brown = collagen[i] + dt * rates.collagen.OfInverse(inverse_K);
    const float black = charred[i] + dt_s * kCharRate_per_Ks * std::max(above, 0.0f);
    cell[i] = std::min(dead, kOmegaMax);
    collagen[i] = std::min(brown, kOmegaMax);
    charred[i] = std::min(black, 1.0f);
  }
}

/// DamageModel::Update of the rows that have a warm cell.
FULCRUM_WIDE
bool DamageTile(Tile* tile, TileRates rates, float dt_s) {
  bool good = true;
  for (int j = 0; j < kTile; ++j) {
    const float* theta = &tile->theta[ThetaIndex(0, j)];
    float* cell = &tile->state.omega_cell[j * kTile];
    float* collagen = &tile->state.omega_collagen[j * kTile];
    float* charred = &tile->state.charred[j * kTile];
    std::uint32_t warm = 0, odd = 0;
    for (int i = 0; i < kTile; ++i) warm |= theta[i] >= kDamageStart ? 1u : 0u;
    if (warm == 0) continue;
    // 0 times a finite value is 0, 0 times NaN or infinity is NaN.
    for (int i = 0; i < kTile; ++i) odd |= 0.0f * (cell[i] + collagen[i] + charred[i]) == 0.0f ? 0u : 1u;
    if (odd == 0) {
      DamageCells(rates, dt_s, kTile, theta, cell, collagen, charred);
      continue;
    }
    for (int i = 0; i < kTile; ++i) {
      const bool number = std::isfinite(cell[i] + collagen[i] + charred[i]);
      if (number) DamageCells(rates, dt_s, 1, theta + i, cell + i, collagen + i, charred + i);
      good = good && (number || theta[i] < kDamageStart);
    }
  }
  return good;
}

}  // namespace

DamageRate::DamageRate(const ArrheniusPair& pair, float body_C)
    : a_(static_cast<float>(std::log2(pair.a_per_s))),
      b_(static_cast<float>(pair.ea_J_mol / (kGas_J_molK * std::log(2.0)))),
      body_K_(static_cast<float>(kZero_C) + body_C) {}

DamageModel::DamageModel(float body_C)
    : cell_death_(kCellDeath, body_C), collagen_(kCollagen, body_C), theta_char_(kCharStart_C - body_C) {}

bool DamageModel::Update(Tile* tile, float dt_s) const {
  if (tile->theta_max < kDamageStart) return true;
  return DamageTile(tile, {cell_death_, collagen_, theta_char_}, dt_s);
}

}  // namespace fulcrum::thermal
