// Time-domain passivity observer and controller (Hannaford and Ryu, 2002) with a small energy tank: the energy that the
// servo gives to the hand is bounded by the energy that the model stores plus the content of the tank.
#pragma once

#include <algorithm>

#include "services/base/core/types.h"

namespace fulcrum::haptics {

inline constexpr double kTank_J = 2e-3;                   ///< Capacity of the tank.
inline constexpr double kMaxPassivityDamping_Ns_m = 3.0;  ///< Limit of the added damping.

class PassivityController {
 public:
  /// Adds damping to the force `wanted` if the energy balance is negative. All quantities are at the attach point.
  /// @param moved displacement since the last tick, over which `sent` acted [m].
  /// @param stored elastic energy of the model, scaled like the force on the hand [J].
  /// @param external_W power that the tissue adds (breathing, another tool).
  [[nodiscard]] Vec3d Step(const Vec3d& wanted, const Vec3d& sent, const Vec3d& moved, double stored, double external_W,
                           double dt) noexcept {
    // The lower bound limits the effect of power that physics has not declared: without it the damping would persist.
    energy_J_ = std::clamp(energy_J_ - sent.dot(moved) + external_W * dt, -kTank_J, stored + kTank_J);
    const double speed2 = moved.squaredNorm() / (dt * dt);
    if (energy_J_ >= 0.0 || speed2 <= 0.0) return wanted;
    const double damping = std::min(kMaxPassivityDamping_Ns_m, -energy_J_ / (dt * speed2));
    return wanted - damping / dt * moved;
  }
  /// Resets the balance. Used while forces fade or rise: the stored energy then changes without work of the hand, too
  /// slowly to build up an oscillation, and must not count in the balance.
  void Refill(double stored) noexcept { energy_J_ = stored + kTank_J; }
  [[nodiscard]] double energy_J() const noexcept { return energy_J_; }

 private:
  double energy_J_ = kTank_J;
};

}  // namespace fulcrum::haptics
