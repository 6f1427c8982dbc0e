// Turns CauteryContact samples into the tip's path per frame.
#pragma once

#include "services/core/messages.h"
#include "thermal_node/coupling/source_window.h"

namespace fulcrum::thermal {

/// Without news for this long the generator is off: physics may be gone while the pedal was down.
inline constexpr double kContactTimeout_s = 0.1;
inline constexpr float kTipSpeedMax_m_s = 0.3f;  ///< Farther between two samples is a jump, not a cut.
inline constexpr float kContactRadiusMin_m = 1e-4f, kContactRadiusMax_m = 2e-3f;
inline constexpr float kHalfContactMax_m = 2e-3f;  ///< A longer line of contact does not fit into the source's window.
inline constexpr float kPowerMax_W = 400.0f;

/// What the solver needs of one frame.
struct TipInput {
  bool active = false;  ///< Touching, energised, with power.
  TipPath path;
  CauteryMode mode = CauteryMode::kOff;
  float power_W = 0;
};

class TipTracker {
 public:
  TipTracker(const Sheet& sheet, float default_radius_m) : sheet_(sheet), default_radius_m_(default_radius_m) {}

  /// Newest sample, or nullptr when none came. The path runs from where the last frame ended to the newest tip, so that
  /// it has no gaps whatever the phase of the two clocks.
  [[nodiscard]] TipInput Advance(const CauteryContact* sample, double dt_s);
  /// False: out of range or off the sheet; such a sample must not reach Advance.
  [[nodiscard]] bool Accepts(const CauteryContact& sample) const;

 private:
  const Sheet& sheet_;
  float default_radius_m_;
  CauteryContact last_;
  bool on_path_ = false;
  Vec2f at_ = Vec2f::Zero();
  double age_s_ = 0;
};

}  // namespace fulcrum::thermal
