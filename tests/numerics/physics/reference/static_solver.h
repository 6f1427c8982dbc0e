// Static equilibrium by Newton's method: conjugate gradients on the true Hessian, preconditioned by a sparse Cholesky
// factor that is reused while it is effective.
#pragma once

#include <vector>

#include "tests/numerics/physics/reference/elastic_energy.h"

namespace fulcrum::physics::reference {

struct StaticResult {
  Points x;
  double residual_N = 0;  ///< Largest component of the residual force on a free particle.
  int iterations = 0;
};

/// Minimises the energy plus -sum load . x from `start`, over the coordinates of particles with mass that are not
/// `held` ([3 * particles], x y z of each; empty: none). Line search on the energy. Ends at `tolerance_N` or at the
/// limit of rounding. `load` may be empty. Throws std::runtime_error if the iteration stagnates above `tolerance_N` x
/// 1e4.
[[nodiscard]] StaticResult SolveStatic(const ElasticEnergy& energy, const Points& start, const std::vector<bool>& held,
                                       const Points& load, double tolerance_N = 1e-8);

}  // namespace fulcrum::physics::reference
