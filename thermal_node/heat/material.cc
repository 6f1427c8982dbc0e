#include "thermal_node/heat/material.h"

#include <cmath>
#include <string>

#include "services/base/core/error.h"
#include "services/base/core/sheet_heat.h"

namespace fulcrum::thermal {
namespace {

void Check(const char* name, float value, float low, float high) {
  if (std::isfinite(value) && value >= low && value <= high) return;
  throw InputError("thermal." + std::string(name) + " = " + std::to_string(value) + ": valid range is " +
                   std::to_string(low) + " to " + std::to_string(high));
}

void Validate(const ThermalParams& p) {
  // The lower bound of cell_m keeps the explicit step affordable: at 25 um a 10 ms frame takes about 20 substeps.
  Check("cell_m", p.cell_m, 2.5e-5f, 1e-3f);
  Check("thickness_m", p.thickness_m, kSheetThicknessMin_m, kSheetThicknessMax_m);
  Check("density_kg_m3", p.density_kg_m3, 500, 2000);
  Check("heat_capacity_J_kgK", p.heat_capacity_J_kgK, 1000, 5000);
  Check("conductivity_W_mK", p.conductivity_W_mK, kSheetConductivityMin_W_mK, kSheetConductivityMax_W_mK);
  Check("latent_heat_J_m3", p.latent_heat_J_m3, 1e8f, 2.3e9f);
  Check("body_temperature_C", p.body_temperature_C, 0, 60);
  Check("h_top_W_m2K", p.h_top_W_m2K, 0, 1e4f);
  Check("h_below_W_m2K", p.h_below_W_m2K, 0, 1e4f);
  Check("h_tented_W_m2K", p.h_tented_W_m2K, 0, 1e4f);
  Check("perfusion_per_s", p.perfusion_per_s, 0, 0.1f);
  Check("sigma_S_m", p.sigma_S_m, kSheetSigmaMin_S_m, kSheetSigmaMax_S_m);
  Check("sigma_per_K", p.sigma_per_K, 0, 0.05f);
  Check("sigma_fat_S_m", p.sigma_fat_S_m, 0, 5);
  Check("fat_depth_m", p.fat_depth_m, 1e-4f, 0.1f);
  Check("v_max_V", p.v_max_V, 1, 5000);
  Check("i_max_A", p.i_max_A, 0.01f, 20);
  Check("hook_radius_m", p.hook_radius_m, 1e-4f, 2e-3f);
  Check("shrink_max", p.shrink_max, 0, 0.5f);
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
