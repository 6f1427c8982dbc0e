// Material of the sheet, derived once from the scene's ThermalParams.
#pragma once

#include <algorithm>
#include <cmath>

#include "services/base/core/scene_view.h"

namespace fulcrum::thermal {

inline constexpr float kWaterHeat_J_kg = 2.257e6f;  ///< Latent heat of boiling water.
inline constexpr float kWaterHeatCapacity_J_kgK = 4180.0f;
inline constexpr float kBloodHeatCapacity_J_m3K = 4.0e6f;  ///< 1060 kg/m^3 * 3770 J/kgK.
inline constexpr float kDryConductivity_W_mK = 0.15f;      ///< Desiccated protein; assumed.
/// Electrical conductivity of dry tissue relative to wet tissue; assumed.
inline constexpr float kDrySigmaFraction = 0.01f;
inline constexpr float kBoiling_C = 100.0f;

/// The leak of a point is as if the potential beneath had the wave number kSpreading / r, r the distance from the
/// middle of the metal, at least its radius. The conductance of discs of 0.5 and 1 mm is then within 3.5 % of that in
/// three dimensions for conductivities of fat from 0.02 to 0.1 S/m (bench_truth truth.potential); chosen for that.
inline constexpr float kSpreading = 0.72f;

/// x coth(x): of a harmonic potential of wave number x / H the current into fat of depth H over a conductor, relative
/// to that of an even potential. By its square, x^2 + (x / sinh x)^2, within 1 %.
[[nodiscard]] inline float LeakRatio(float x) {
  const float per_sinh = 1.0f / (1.0f + x * x / 6.0f);
  return std::sqrt(x * x + per_sinh * per_sinh);
}

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
  float leak_S_m2 = 0;           ///< Leak conductance to the tissue beneath where the potential is even: sigma_fat / H.
  float fat_depth_m = 0;         ///< H.
  float spreading = kSpreading;  ///< 0: leak_S_m2 everywhere.
  bool spanned = false;          ///< Spanned freely: air on both sides, no tissue beneath.

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
