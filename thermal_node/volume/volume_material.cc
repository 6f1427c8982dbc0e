#include "thermal_node/volume/volume_material.h"

#include <algorithm>
#include <cmath>

namespace fulcrum::thermal {

VolumeMaterial MakeVolumeMaterial(const ThermalParams& p) {
  VolumeMaterial m;
  m.pitch_m = kPitch * p.cell_m;
  m.theta_boil = kBoiling_C - p.body_temperature_C;
  m.fat_layers = std::clamp(static_cast<int>(std::lround(p.fat_depth_m / m.pitch_m)), 1, kLayers);
  for (int k = 0; k < kLayers; ++k) {
    const Tissue& tissue = k < m.fat_layers ? kFat : kRectumWall;
    m.rc[k] = tissue.density_kg_m3 * tissue.heat_capacity_J_kgK;
    m.k[k] = tissue.conductivity_W_mK;
    m.latent[k] = tissue.latent_J_m3 / m.rc[k];
  }
  m.face[0] = 2.0f * m.k[0] / m.pitch_m;
  for (int k = 1; k < kLayers; ++k) m.face[k] = 2.0f * m.k[k - 1] * m.k[k] / ((m.k[k - 1] + m.k[k]) * m.pitch_m);
  m.perfusion = p.perfusion_per_s * kBloodHeatCapacity_J_m3K;
  // The whole voltage drops across the fat. If the fat ends within the volume, its depth is rounded to whole layers;
  // the source is scaled so that its heat is still that of the leak.
  const bool ends_inside = p.fat_depth_m < m.depth_m();
  const float heated_m = ends_inside ? static_cast<float>(m.fat_layers) * m.pitch_m : p.fat_depth_m;
  m.source_per_V2 = p.sigma_fat_S_m / (p.fat_depth_m * heated_m);
  return m;
}

}  // namespace fulcrum::thermal
