// Interface between metal and tissue: wet contact, a film of steam, discharges across it; and the heat of the metal.
//
// Wet tissue touches the metal, and the current crowds at the metal's rim. Once tissue beneath boils, steam lifts the
// metal off it. Where the mode's waveform sustains discharges (cut, blend) these carry the current across the film,
// over the whole footprint: their conductance is small beside that of the sheet, so the current is even there, and what
// the metal sweeps is vaporised. In coag the film collapses between the bursts, the tissue dries onto the metal and the
// current ends.
//
// Sources. The discharge of electrosurgery in air, a contracted glow that goes out at each zero of the voltage and
// strikes again above a threshold: "Electric discharge during electrosurgery", Sci. Rep. 5:9946 (2015). Some 200 V peak
// as the least voltage for arcs between electrode and tissue: user manual of the Erbe VIO. Conductance of the
// discharges and the shares of their heat are assumed; what follows from them: deploy/docs/measurements/thermal.
#pragma once

#include <algorithm>
#include <cmath>

namespace fulcrum::thermal {

/// Conductance of a film in full discharge [S/m^2], assumed; at 350 V rms the power is 49 W per square millimetre.
inline constexpr float kDischarge_S_m2 = 400.0f;
/// Range of discharges from the metal; their frequency falls to 0 there [m].
inline constexpr float kFilmReach_m = 2.0e-4f;
/// Least voltage across the film at which discharges burn [V rms while the current is on]: 200 V peak.
inline constexpr float kStrike_V = 141.0f;
/// Shares of a discharge's heat that enter the tissue and the metal; the rest leaves with the plume.
inline constexpr float kTissueShare = 0.75f, kMetalShare = 0.15f;
/// Time constants with which the film grows where the tissue beneath boils and collapses where it does not [s].
inline constexpr float kFilmGrows_s = 1.0e-3f, kFilmCollapses_s = 5.0e-3f;
/// Fraction of the footprint that must boil for a film under all of it, because steam spreads.
inline constexpr float kBoilingForFilm = 0.1f;

/// A hook of 1 mm steel wire, 10 mm of it bare: 0.03 J/K. It loses heat to its shaft and the air in 16 s.
inline constexpr float kHookHeatCapacity_J_K = 0.03f, kHookCools_s = 16.0f;
/// Heat transfer from metal to the tissue that it touches, and across the film [W/m^2K]; assumed.
inline constexpr float kHookContact_W_m2K = 2.0e4f, kHookFilm_W_m2K = 500.0f;

/// Share of the film below which the regulation of the discharges is reset: the film has practically collapsed.
inline constexpr float kCollapsedFilm = 0.05f;
/// Least share of the film in which discharges burn, so that the regulation can recover; assumed.
inline constexpr float kLeastBurning = 0.02f;
/// Largest factor by which the burning share changes after one solve; damps the regulation. Assumed.
inline constexpr float kBurningStep = 2.0f;
/// Largest plausible |theta| of the metal in a checkpoint [K].
inline constexpr float kHookThetaPlausible = 5000.0f;

/// State of the interface of one electrode.
struct Interface {
  float film = 0;        ///< Fraction of the footprint under which there is a film, 0 ... 1.
  float burning = 1;     ///< Fraction of the film in which discharges burn: as many as keep kStrike_V across it.
  float hook_theta = 0;  ///< Temperature of the metal above body temperature [K].

  /// Advances the film. @param boiling fraction of the footprint that boils. @param sustains the waveform sustains
  /// discharges.
  void Follow(float boiling, bool sustains, float dt_s) {
    const float target = sustains ? std::min(boiling / kBoilingForFilm, 1.0f) : 0.0f;
    film += (target - film) * (1.0f - std::exp(-dt_s / (target > film ? kFilmGrows_s : kFilmCollapses_s)));
    if (film < kCollapsedFilm) burning = 1.0f;
  }
  /// Adjusts the burning fraction after a solve. @param across_V voltage across the film while the current is on [V
  /// rms].
  void Regulate(float across_V) {
    const float ratio = across_V / kStrike_V;
    burning = std::clamp(burning * std::clamp(ratio * ratio, 1.0f / kBurningStep, kBurningStep), kLeastBurning, 1.0f);
  }
  /// True for a state that the solver can have written.
  [[nodiscard]] bool IsPlausible() const {
    return film >= 0.0f && film <= 1.0f && burning >= 0.0f && burning <= 1.0f &&
           std::abs(hook_theta) <= kHookThetaPlausible;
  }
  void Cool(float dt_s) { hook_theta *= std::exp(-dt_s / kHookCools_s); }
};

}  // namespace fulcrum::thermal
