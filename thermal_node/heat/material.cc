#include "thermal_node/heat/material.h"

#include <array>
#include <cmath>
#include <cstdio>

#include "services/base/core/error.h"
#include "services/base/core/thermal_bounds.h"

namespace fulcrum::thermal {
namespace {

/// A scene file may hold other values; the reader of descriptions refuses them.
void Validate(const ThermalParams& p) {
  for (const ThermalBound& bound : kThermalBounds) {
    const float value = p.*bound.value;
    const auto low = static_cast<float>(bound.low * bound.si), high = static_cast<float>(bound.high * bound.si);
    if (std::isfinite(value) && value >= low && value <= high) continue;
    std::array<char, 160> text{};
    std::snprintf(text.data(), text.size(), "thermal.%s is %g; valid: %g to %g", bound.key,
                  static_cast<double>(value) / bound.si, bound.low, bound.high);
    throw InputError(text.data());
  }
}

}  // namespace

Material MakeMaterial(const ThermalParams& p) {
  Validate(p);
  Material m;
  m.cell_m = p.cell_m;
  m.thickness_m = p.thickness_m;
  m.body_C = p.body_temperature_C;
  m.theta_boil = kBoiling_C - p.body_temperature_C;
  m.rc_wet = p.density_kg_m3 * p.heat_capacity_J_kgK;
  const float water_kg_m3 = p.latent_heat_J_m3 / kWaterHeat_J_kg;
  // Keeps the heat capacity of dry tissue positive if the water fraction is high for the density.
  m.rc_dry = std::max(m.rc_wet - water_kg_m3 * kWaterHeatCapacity_J_kgK, 0.15f * m.rc_wet);
  m.k_wet = p.conductivity_W_mK;
  m.k_dry = std::min(kDryConductivity_W_mK, p.conductivity_W_mK);
  m.latent = p.latent_heat_J_m3;
  const float perfusion = p.perfusion_per_s * kBloodHeatCapacity_J_m3K;
  m.loss_resting = (p.h_top_W_m2K + p.h_below_W_m2K) / p.thickness_m + perfusion;
  m.loss_tented = (p.h_top_W_m2K + p.h_tented_W_m2K) / p.thickness_m + perfusion;
  m.sigma = p.sigma_S_m;
  m.sigma_per_K = p.sigma_per_K;
  m.leak_S_m2 = p.sigma_fat_S_m / p.fat_depth_m;
  m.fat_depth_m = p.fat_depth_m;
  return m;
}

}  // namespace fulcrum::thermal
