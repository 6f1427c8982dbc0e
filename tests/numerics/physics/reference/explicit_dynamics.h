// The equation of motion by central differences with tiny steps: no linearisation, no solver tolerance, second order.
#pragma once

#include <functional>
#include <vector>

#include "tests/numerics/physics/reference/elastic_energy.h"

namespace fulcrum::physics::reference {

class ExplicitDynamics {
 public:
  /// Starts at rest at `start`; steps of `step_s`.
  ExplicitDynamics(const ElasticEnergy* energy, const Points& start, double step_s);

  /// Position at a time [s] of a particle with prescribed motion; replaces the previous prescription. Empty: all free.
  using Motion = std::function<Vec3d(Index particle, double time_s)>;
  void Hold(const std::vector<Index>& particles, Motion motion);

  /// Continues with another energy of as many particles.
  void ChangeEnergy(const ElasticEnergy* energy) { energy_ = energy; }

  /// Advances by `count` steps.
  void Run(int count);

  [[nodiscard]] double time_s() const { return static_cast<double>(steps_) * step_s_; }
  [[nodiscard]] const Points& x() const { return x_; }
  /// Half a step behind x.
  [[nodiscard]] const Points& velocity() const { return v_; }

 private:
  const ElasticEnergy* energy_;
  double step_s_;
  long steps_ = 0;
  Points x_, v_, gradient_;
  std::vector<bool>
      starts_;  ///< [particles] Starts from rest: the next kick is half, as velocities are half a step behind.
  std::vector<Index> held_;
  Motion motion_;
};

/// Largest eigenfrequency at x, sqrt(max eigenvalue of M^-1 K) [rad/s], by power iteration; the steps of central
/// differences must be shorter than 2 over it.
[[nodiscard]] double HighestFrequency(const ElasticEnergy& energy, const Points& x);

}  // namespace fulcrum::physics::reference
