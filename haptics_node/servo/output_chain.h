// The last stages before the motors, in this order and nowhere else: finite -> limit -> rate limit -> send.
#pragma once

#include <cmath>
#include <cstdint>

#include "services/base/core/types.h"

namespace fulcrum::haptics {

/// Share of the force limit up to which forces pass unchanged; above, a tanh knee leads to the limit (2.8 N of 3.3 N).
inline constexpr double kKneeShare = 2.8 / 3.3;
/// Rate limit while fading or rising [N/ms].
inline constexpr double kCreepSlew_N_per_ms = 0.02;

struct OutputChain {
  double limit_N = 3.3;
  double slew_N_per_ms = 0.4;
  Vec3d sent = Vec3d::Zero();    ///< Last force sent to the motors [N].
  std::uint64_t not_finite = 0;  ///< Forces replaced by zero.

  /// Returns the force to send for the force `wanted`, both at the attach point. `dt` is the nominal period, so that a
  /// late tick does not change the force by more than a punctual one.
  [[nodiscard]] Vec3d Step(const Vec3d& wanted, bool creep, double dt) noexcept {
    Vec3d f = Finite(wanted);
    f = Limited(f);
    f = RateLimited(f, creep ? kCreepSlew_N_per_ms : slew_N_per_ms, dt);
    sent = f;
    return f;
  }

 private:
  [[nodiscard]] Vec3d Finite(const Vec3d& f) noexcept {
    // For components beyond 1e154 the square overflows; such a force is treated like an infinite one.
    if (std::isfinite(f.squaredNorm())) return f;
    ++not_finite;
    return Vec3d::Zero();
  }
  [[nodiscard]] Vec3d Limited(const Vec3d& f) const noexcept {
    const double size = f.norm();
    const double knee = kKneeShare * limit_N;
    if (size <= knee) return f;
    const double room = limit_N - knee;
    return (knee + room * std::tanh((size - knee) / room)) / size * f;
  }
  [[nodiscard]] Vec3d RateLimited(const Vec3d& f, double slew, double dt) const noexcept {
    const Vec3d step = f - sent;
    const double size = step.norm();
    const double most = slew * 1e3 * dt;
    return size <= most ? f : Vec3d(sent + most / size * step);
  }
};

}  // namespace fulcrum::haptics
