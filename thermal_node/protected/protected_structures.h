// Ureter and nerves under the membrane: their temperature, their damage, warnings and injuries.
//
// Each sample point of a structure's polyline is one lumped temperature theta_p below the sheet:
//
//   d theta_p / dt = (exp(-depth / delta) * <theta> - theta_p) / tau,   tau = depth^2 / (2 alpha_fat)
//
// <theta> is the mean over the sheet within one depth of the point (heat spreads laterally on its path down), delta the
// attenuation length of a steady temperature by perfusion, tau the diffusion time through the fat. A short pass over a
// deep structure thus does not warm it, a long stay over a shallow one does.
//
// Where the tissue beneath is computed and reaches down to a structure, its temperature is that of the volume there.
#pragma once

#include <span>
#include <vector>

#include "services/base/core/scene_view.h"
#include "thermal_node/damage/arrhenius.h"
#include "thermal_node/heat/heat_field.h"
#include "thermal_node/volume/volume_field.h"

namespace fulcrum::thermal {

inline constexpr float kFatDiffusivity_m2_s = 9.8e-8f;  ///< k / (rho c) of fat: 0.21 / (911 * 2348).
inline constexpr float kAttenuationDepth_m = 5.4e-3f;   ///< sqrt(k_fat / perfusion sink), 0.002/s.
inline constexpr float kWarning_C = 45.0f;
inline constexpr float kWarningOmega = 0.1f;
inline constexpr float kInjuryOmega = 1.0f;
inline constexpr float kSampleSpacing_m = 1e-3f;

struct ProtectedSample {
  float theta = 0;  ///< [K]
  float omega = 0;
};

struct ProtectedAlarm {
  ProtectedKind kind;
  bool injury;
  Vec2f material;
  float theta, omega;
};

class ProtectedStructures {
 public:
  ProtectedStructures(const SheetScene& scene, const HeatField& field);

  /// Advances by dt (any length) and appends alarms: one warning and one injury per structure at most.
  /// @param volume tissue beneath the sheet, or nullptr.
  void Update(const HeatField& field, const VolumeField* volume, const DamageRate& cell_death, float dt_s,
              std::vector<ProtectedAlarm>* alarms);
  /// True while a point is still warm, so that updates must go on even if the sheet is cold.
  [[nodiscard]] bool warm() const { return warm_; }

  /// State for checkpoints.
  [[nodiscard]] std::span<ProtectedSample> samples() { return samples_; }
  [[nodiscard]] std::span<const ProtectedSample> samples() const { return samples_; }
  [[nodiscard]] std::span<std::uint8_t> alarm_state() { return alarm_state_; }
  [[nodiscard]] std::span<const std::uint8_t> alarm_state() const { return alarm_state_; }
  void set_warm(bool warm) { warm_ = warm; }

 private:
  /// Temperature of the lumped model after dt, from `before` [K].
  [[nodiscard]] float Lumped(const HeatField& field, const Vec2f& at, float depth_m, float before, float dt_s) const;
  [[nodiscard]] float MeanTheta(const HeatField& field, const Vec2f& at, float radius) const;

  struct Structure {
    ProtectedKind kind;
    float depth_m;
  };
  std::vector<Structure> structures_;
  struct Place {
    Vec2f material;
    Index structure;
  };
  std::vector<Place> places_;
  std::vector<ProtectedSample> samples_;   ///< At each place.
  std::vector<std::uint8_t> alarm_state_;  ///< Per structure: 1 warned, 2 injured.
  float body_C_;
  bool warm_ = false;
};

}  // namespace fulcrum::thermal
