// The tissue beneath the sheet in layers: fat, then the wall of the rectum.
#pragma once

#include <array>

#include "thermal_node/heat/material.h"

namespace fulcrum::thermal {

inline constexpr int kLayers = 32;  ///< Cells in depth.
/// Ratio of the edges of the volume's and the sheet's cells: two cells lie under three.
inline constexpr float kPitch = 1.5f;

/// One tissue of the volume. Values of the lab; latent heats are assumed.
struct Tissue {
  float density_kg_m3, heat_capacity_J_kgK, conductivity_W_mK, latent_J_m3;
};
inline constexpr Tissue kFat{911.0f, 2348.0f, 0.21f, 4.0e8f};
inline constexpr Tissue kRectumWall{1088.0f, 3655.0f, 0.55f, 1.6e9f};

/// Constants of the volume. Layer k lies between the depths k and k + 1 times pitch_m below the sheet.
struct VolumeMaterial {
  float pitch_m = 1.5e-4f;   ///< Edge of a cell, in material coordinates and in depth.
  float theta_boil = 63.0f;  ///< [K]
  int fat_layers = kLayers;
  std::array<float, kLayers> rc{};      ///< Volumetric heat capacity [J/m^3K].
  std::array<float, kLayers> k{};       ///< Thermal conductivity [W/mK].
  std::array<float, kLayers> latent{};  ///< Latent heat over rc: kelvins that boiling takes [K].
  /// Conductance per area between layer k - 1 and layer k [W/m^2K]; [0]: from the upper face to the middle of layer 0;
  /// [kLayers]: 0, nothing leaves below.
  std::array<float, kLayers + 1> face{};
  float perfusion = 0;      ///< Sink per kelvin [W/m^3K].
  float source_per_V2 = 0;  ///< Heat of the leak current in fat over the square of the potential above [W/(m^3 V^2)].

  [[nodiscard]] float depth_m() const { return pitch_m * kLayers; }
};

[[nodiscard]] VolumeMaterial MakeVolumeMaterial(const ThermalParams& params);

}  // namespace fulcrum::thermal
