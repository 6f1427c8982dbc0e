#include "thermal_node/damage/arrhenius.h"

#include <algorithm>
#include <cmath>

namespace fulcrum::thermal {
namespace {

constexpr double kGas_J_molK = 8.314462618;
constexpr double kZero_C = 273.15;

}  // namespace

DamageRate::DamageRate(const ArrheniusPair& pair, float body_C) {
  for (int k = 0; k < kNodes; ++k) {
    const double kelvin = kZero_C + body_C + k / static_cast<double>(kPerKelvin);
    table_[k] = static_cast<float>(pair.a_per_s * std::exp(-pair.ea_J_mol / (kGas_J_molK * kelvin)));
  }
}

DamageModel::DamageModel(float body_C)
    : cell_death_(kCellDeath, body_C), collagen_(kCollagen, body_C), theta_char_(kCharStart_C - body_C) {}

bool DamageModel::Update(Tile* tile, float dt_s) const {
  if (tile->theta_max < kDamageStart) return true;
  TileState& s = tile->state;
  bool good = true;
  for (int j = 0; j < kTile; ++j) {
    const float* theta = &tile->theta[ThetaIndex(0, j)];
    float warmest = 0;
    for (int i = 0; i < kTile; ++i) warmest = warmest > theta[i] ? warmest : theta[i];
    if (warmest < kDamageStart) continue;
    for (int i = 0; i < kTile; ++i) {
      if (theta[i] < kDamageStart) continue;
      const int cell = j * kTile + i;
      if (!std::isfinite(s.omega_cell[cell] + s.omega_collagen[cell] + s.charred[cell])) {
        good = false;
        continue;
      }
      s.omega_cell[cell] = std::min(kOmegaMax, s.omega_cell[cell] + dt_s * cell_death_.At(theta[i]));
      s.omega_collagen[cell] = std::min(kOmegaMax, s.omega_collagen[cell] + dt_s * collagen_.At(theta[i]));
      if (theta[i] > theta_char_) {
        const float more = dt_s * kCharRate_per_Ks * (theta[i] - theta_char_);
        s.charred[cell] = std::min(1.0f, s.charred[cell] + more);
      }
    }
  }
  return good;
}

}  // namespace fulcrum::thermal
