#include "tests/numerics/physics/reference/static_solver.h"

#include <Eigen/SparseCholesky>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

namespace fulcrum::physics::reference {
namespace {

constexpr int kMaxIterations = 200;
/// Limit on the length of a step: longer ones come from a nearly singular Hessian [m].
constexpr double kMaxStep = 0.01;

/// A factor is reused as preconditioner of later iterates up to this number of CG iterations.
constexpr int kRefactorAfter = 40;
constexpr int kMaxCgIterations = 200;
/// Far from the solution an inexact step is as good as an exact one.
constexpr double kCgTolerance = 0.03;

/// Solves H step = b by conjugate gradients. At a direction of negative curvature the present step is returned, which
/// is a descent direction.
template <class Factor>
Eigen::VectorXd NewtonStep(const SparseMatrix& H, const Factor& factor, const Eigen::VectorXd& b, int* iterations) {
  Eigen::VectorXd step = Eigen::VectorXd::Zero(b.size()), r = b, z = factor.solve(r), p = z;
  const double first = r.dot(z);
  double rz = first;
  for (*iterations = 0; *iterations < kMaxCgIterations && rz > kCgTolerance * kCgTolerance * first; ++*iterations) {
    const Eigen::VectorXd Hp = H.selfadjointView<Eigen::Lower>() * p;
    const double curvature = p.dot(Hp);
    if (!(curvature > 0)) {
      return *iterations == 0 ? p : step;
    }
    step += rz / curvature * p;
    r -= rz / curvature * Hp;
    z = factor.solve(r);
    const double next = r.dot(z);
    p = z + next / rz * p;
    rz = next;
  }
  return step;
}

/// Submatrix of the free coordinates.
SparseMatrix Restrict(const SparseMatrix& H, const std::vector<int>& free_of, int free_count) {
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(static_cast<std::size_t>(H.nonZeros()));
  for (Eigen::Index col = 0; col < H.outerSize(); ++col) {
    for (SparseMatrix::InnerIterator it(H, col); it; ++it) {
      const int r = free_of[static_cast<std::size_t>(it.row())], c = free_of[static_cast<std::size_t>(col)];
      if (r >= 0 && c >= 0) {
        entries.emplace_back(r, c, it.value());
      }
    }
  }
  SparseMatrix result(free_count, free_count);
  result.setFromTriplets(entries.begin(), entries.end());
  return result;
}

}  // namespace

StaticResult SolveStatic(const ElasticEnergy& energy, const Points& start, const std::vector<bool>& held,
                         const Points& load, double tolerance_N) {
  const Eigen::Index n = energy.particle_count();
  std::vector<int> free_of(3 * static_cast<std::size_t>(n), -1);
  int free_count = 0;
  for (Eigen::Index p = 0; p < n; ++p) {
    const auto i = static_cast<std::size_t>(p);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (!energy.model().fixed(static_cast<Index>(p)) && !(!held.empty() && held[3 * i + axis])) {
        free_of[3 * i + axis] = free_count++;
      }
    }
  }
  StaticResult result{start, 0, 0};
  Points gradient, candidate_gradient;
  const auto value = [&](const Points& x) {
    return energy.Energy(x) - (load.cols() == n ? load.cwiseProduct(x).sum() : 0.0);
  };
  const auto slope = [&](const Points& x, Points* g) {
    energy.Gradient(x, g);
    if (load.cols() == n) {
      *g -= load;
    }
    double largest = 0;
    for (std::size_t i = 0; i < free_of.size(); ++i) {
      double& component = g->data()[i];
      component = free_of[i] < 0 ? 0 : component;
      largest = std::max(largest, std::abs(component));
    }
    return largest;
  };
  Eigen::SimplicialLLT<SparseMatrix> factor;
  int cg_iterations = kRefactorAfter + 1;
  result.residual_N = slope(result.x, &gradient);
  for (; result.iterations < kMaxIterations && result.residual_N > tolerance_N; ++result.iterations) {
    Eigen::VectorXd b(free_count);
    for (std::size_t i = 0; i < free_of.size(); ++i) {
      if (free_of[i] >= 0) {
        b[free_of[i]] = -gradient.data()[i];
      }
    }
    if (cg_iterations > kRefactorAfter) {
      factor.compute(Restrict(energy.Hessian(result.x, true), free_of, free_count));
      if (factor.info() != Eigen::Success) {
        throw std::runtime_error("the clamped Hessian is singular: something is not held");
      }
    }
    const SparseMatrix H = Restrict(energy.Hessian(result.x, false), free_of, free_count);
    const Eigen::VectorXd step = NewtonStep(H, factor, b, &cg_iterations);
    Points direction = Points::Zero(3, n);
    for (std::size_t i = 0; i < free_of.size(); ++i) {
      direction.data()[i] = free_of[i] < 0 ? 0 : step[free_of[i]];
    }
    const double longest = direction.cwiseAbs().maxCoeff(), before = value(result.x), downhill = b.dot(step);
    double t = longest > kMaxStep ? kMaxStep / longest : 1;
    bool moved = false;
    for (int halvings = 0; halvings < 30 && !moved; ++halvings, t /= 2) {
      const Points candidate = result.x + t * direction;
      const double residual = slope(candidate, &candidate_gradient);
      // Near the solution rounding hides differences of the energy; the force still resolves them.
      const double noise = 1e-12 * std::abs(before);
      if (value(candidate) <= before - 1e-4 * t * downhill || (t * downhill < noise && residual < result.residual_N)) {
        result.x = candidate;
        gradient = candidate_gradient;
        result.residual_N = residual;
        moved = true;
      }
    }
    if (!moved) {
      break;
    }
  }
  if (!(result.residual_N <= 1e4 * tolerance_N)) {
    throw std::runtime_error("no equilibrium: " + std::to_string(result.residual_N) + " N left after " +
                             std::to_string(result.iterations) + " iterations");
  }
  return result;
}

}  // namespace fulcrum::physics::reference
