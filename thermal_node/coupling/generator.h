// The electrosurgical generator and its modes.
#pragma once

#include <algorithm>
#include <cmath>

#include "services/base/core/messages.h"
#include "services/base/core/scene_view.h"

namespace fulcrum::thermal {

/// Waveform of a mode and its rule for removing tissue.
///
/// All modes regulate the mean power to the set power. Their waveforms differ: cut is continuous, blend and coag are
/// interrupted. The generator's limits of voltage and current hold while the current is on; the rms over the whole
/// period is sqrt(duty) times as large. A cell is removed when its water is spent *and* it is hotter than `remove_C`:
/// in cut at once (the steam bursts it), in blend after some superheating of dry tissue (a wider coagulated border), in
/// coag only when the char itself goes; coag therefore dries, browns and chars. An abdomen is filled with carbon
/// dioxide, in which char does not burn but reacts to carbon monoxide (Boudouard), above some 700 °C. Duty cycles and
/// the temperature of blend are assumed.
struct ModeRule {
  float duty;      ///< Duty cycle: fraction of the time in which the current is on.
  float remove_C;  ///< Dry tissue is removed above this temperature.
  float arc_m;     ///< Range of sparks from the metal without a film [m]; their frequency falls to 0 there.
};

inline ModeRule RuleOf(CauteryMode mode) {
  switch (mode) {
    case CauteryMode::kCut:
      return {1.0f, 100.0f, 0.0f};
    case CauteryMode::kBlend:
      return {0.64f, 130.0f, 0.0f};
    case CauteryMode::kCoag:
      return {0.25f, 700.0f, 4.0e-4f};
    case CauteryMode::kOff:
      break;
  }
  return {0.0f, 1e9f, 0.0f};
}

/// Setting of the generator for one step.
struct Drive {
  float power_W = 0;
  float v_max_V = 0;        ///< [V rms]
  float i_max_A = 0;        ///< [A rms]
  float remove_theta = 0;   ///< [K]
  float duty = 1;           ///< Duty cycle: fraction of the time in which the current is on.
  bool discharges = false;  ///< The waveform sustains discharges across a film of steam.
  float arc_m = 0;
};

inline Drive MakeDrive(const ThermalParams& params, CauteryMode mode, float power_W) {
  const ModeRule rule = RuleOf(mode);
  const float rms = std::sqrt(rule.duty);
  return {.power_W = power_W,
          .v_max_V = rms * params.v_max_V,
          .i_max_A = rms * params.i_max_A,
          .remove_theta = rule.remove_C - params.body_temperature_C,
          .duty = rule.duty,
          .discharges = mode == CauteryMode::kCut || mode == CauteryMode::kBlend,
          .arc_m = rule.arc_m};
}

/// Electrode voltage at which a conductance takes the set power, within the limits of voltage and current [V rms].
inline float RegulatedVoltage(const Drive& drive, float conductance_S) {
  if (!(conductance_S > 0.0f)) return 0.0f;
  return std::min({drive.v_max_V, std::sqrt(drive.power_W / conductance_S), drive.i_max_A / conductance_S});
}

}  // namespace fulcrum::thermal
