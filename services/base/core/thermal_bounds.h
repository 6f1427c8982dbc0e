// Valid values of section `thermal`: one table for the reader of scenes and for thermal_node.
#pragma once

#include "services/base/core/scene_view.h"

namespace fulcrum {

/// Valid values of a number of the section, in the unit of its key.
struct ThermalBound {
  const char* key;
  double low, high;
  double si;  ///< SI units in one of the key's.
  float ThermalParams::*value;
};

inline constexpr ThermalBound kThermalBounds[] = {
    // The lower bound keeps the explicit step affordable: at 25 um a 10 ms frame takes about 20 substeps.
    {"cell_um", 25, 1000, 1e-6, &ThermalParams::cell_m},
    {"thickness_mm", 0.01, 5, 1e-3, &ThermalParams::thickness_m},
    {"density_kg_m3", 500, 2000, 1, &ThermalParams::density_kg_m3},
    {"heat_capacity_J_kgK", 1000, 5000, 1, &ThermalParams::heat_capacity_J_kgK},
    {"conductivity_W_mK", 0.05, 2, 1, &ThermalParams::conductivity_W_mK},
    {"latent_heat_J_m3", 1e8, 2.3e9, 1, &ThermalParams::latent_heat_J_m3},
    {"body_temperature_C", 0, 60, 1, &ThermalParams::body_temperature_C},
    {"h_top_W_m2K", 0, 1e4, 1, &ThermalParams::h_top_W_m2K},
    {"h_below_W_m2K", 0, 1e4, 1, &ThermalParams::h_below_W_m2K},
    {"h_tented_W_m2K", 0, 1e4, 1, &ThermalParams::h_tented_W_m2K},
    {"perfusion_per_s", 0, 0.1, 1, &ThermalParams::perfusion_per_s},
    {"sigma_S_m", 0.001, 5, 1, &ThermalParams::sigma_S_m},
    {"sigma_per_K", 0, 0.05, 1, &ThermalParams::sigma_per_K},
    {"sigma_fat_S_m", 0, 5, 1, &ThermalParams::sigma_fat_S_m},
    {"fat_depth_mm", 0.1, 100, 1e-3, &ThermalParams::fat_depth_m},
    {"v_max_V", 1, 5000, 1, &ThermalParams::v_max_V},
    {"i_max_A", 0.01, 20, 1, &ThermalParams::i_max_A},
    {"hook_radius_mm", 0.1, 2, 1e-3, &ThermalParams::hook_radius_m},
    {"shrink_max", 0, 0.5, 1, &ThermalParams::shrink_max},
};

}  // namespace fulcrum
