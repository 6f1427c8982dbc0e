// Material of the sheet, derived once from the scene's ThermalParams.
#pragma once

#include <algorithm>

#include "services/base/core/scene_view.h"

namespace fulcrum::thermal {

inline constexpr float kWaterHeat_J_kg = 2.257e6f;  ///< Latent heat of boiling water.
inline constexpr float kWaterHeatCapacity_J_kgK = 4180.0f;
inline constexpr float kBloodHeatCapacity_J_m3K = 4.0e6f;  ///< 1060 kg/m^3 * 3770 J/kgK.
inline constexpr float kDryConductivity_W_mK = 0.15f;      ///< Desiccated protein; assumed.
/// Electrical conductivity of dry tissue relative to wet tissue; assumed.
inline constexpr float kDrySigmaFraction = 0.01f;
inline constexpr float kBoiling_C = 100.0f;

/// Constants of one sheet. Temperatures are differences theta = T - T_body [K]. `water` is the fraction of the tissue
/// water that is left, 1 wet … 0 dry.
struct Material {
  float cell_m = 1e-4f;
  float thickness_m = 3e-4f;
  float body_C = 37.0f;
  float theta_boil = 63.0f;      ///< [K]
  float rc_wet = 0, rc_dry = 0;  ///< Volumetric heat capacity [J/m^3K].
  float k_wet = 0, k_dry = 0;    ///< Thermal conductivity [W/mK].
  float latent = 0;              ///< Latent heat of all water in a volume of tissue [J/m^3].
  float loss_resting = 0;        ///< Sink per kelvin of a sheet that lies on fat: faces and perfusion [W/m^3K].
  float loss_tented = 0;         ///< Sink per kelvin of a sheet that is lifted off the fat [W/m^3K].
  float sigma = 0;               ///< Electrical conductivity, wet at body temperature [S/m].
  float sigma_per_K = 0;         ///< Relative rise of the electrical conductivity per kelvin [1/K].
  float leak_S_m2 = 0;           ///< Leak conductance to the tissue beneath: sigma_fat / H, H depth of the fat.

  [[nodiscard]] float HeatCapacity(float water) const { return rc_dry + water * (rc_wet - rc_dry); }
  [[nodiscard]] float ThermalConductivity(float water) const { return k_dry + water * (k_wet - k_dry); }
  /// Electrical conductivity [S/m]: rises with temperature up to boiling and falls with the water to kDrySigmaFraction
  /// of its wet value.
  [[nodiscard]] float ElectricalConductivity(float theta, float water) const {
    return sigma * (1.0f + sigma_per_K * std::clamp(theta, 0.0f, theta_boil)) * std::max(kDrySigmaFraction, water);
  }
  /// Enthalpy above body temperature at which boiling begins [J/m^3].
  [[nodiscard]] float BoilingEnthalpy(float water) const { return HeatCapacity(water) * theta_boil; }
};

/// Throws InputError naming the parameter, its value and the valid range.
[[nodiscard]] Material MakeMaterial(const ThermalParams& params);

}  // namespace fulcrum::thermal
