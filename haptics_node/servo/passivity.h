// Time-domain passivity observer and controller (Hannaford and Ryu, 2002) with a small tank: the servo may not give the
// hand more energy than the model stores plus what the tank holds.
#pragma once

#include <algorithm>

#include "services/base/core/types.h"

namespace fulcrum::haptics {

inline constexpr double kTank_J = 2e-3;
inline constexpr double kMaxPassivityDamping_Ns_m = 3.0;

class PassivityController {
 public:
  /// Adds damping to `wanted` when energy has run out. All at the attach point.
  /// @param moved displacement since the last tick, over which `sent` acted [m].
  /// @param stored elastic energy of the model, as the hand feels it [J].
  /// @param external_W power that the tissue brings in (breathing, another tool).
  [[nodiscard]] Vec3d Step(const Vec3d& wanted, const Vec3d& sent, const Vec3d& moved, double stored, double external_W,
                           double dt) noexcept {
    // The floor: tissue that is moved by what physics did not declare must not leave a drag for good.
    energy_J_ = std::clamp(energy_J_ - sent.dot(moved) + external_W * dt, -kTank_J, stored + kTank_J);
    const double speed2 = moved.squaredNorm() / (dt * dt);
    if (energy_J_ >= 0.0 || speed2 <= 0.0) return wanted;
    const double damping = std::min(kMaxPassivityDamping_Ns_m, -energy_J_ / (dt * speed2));
    return wanted - damping / dt * moved;
  }
  /// While forces fade in or out the model's share changes without the hand's doing, at a rate that cannot build up an
  /// oscillation: such a change is not the hand's debt.
  void Refill(double stored) noexcept { energy_J_ = stored + kTank_J; }
  [[nodiscard]] double energy_J() const noexcept { return energy_J_; }

 private:
  double energy_J_ = kTank_J;
};

}  // namespace fulcrum::haptics
