#include "tests/numerics/physics/reference/explicit_dynamics.h"

#include <cmath>

namespace fulcrum::physics::reference {

ExplicitDynamics::ExplicitDynamics(const ElasticEnergy* energy, const Points& start, double step_s)
    : energy_(energy),
      step_s_(step_s),
      x_(start),
      v_(Points::Zero(3, start.cols())),
      starts_(static_cast<std::size_t>(start.cols()), true) {}

void ExplicitDynamics::Hold(const std::vector<Index>& particles, Motion motion) {
  held_ = particles;
  motion_ = std::move(motion);
}

void ExplicitDynamics::Run(int count) {
  const ElasticModel& model = energy_->model();
  // Drag at the middle of the step: v' - v = h (f / m - c (v + v') / 2).
  const double c = model.damping_per_s * step_s_ / 2, keep = (1 - c) / (1 + c), gain = step_s_ / (1 + c);
  for (int i = 0; i < count; ++i) {
    energy_->Gradient(x_, &gradient_);
    for (Eigen::Index p = 0; p < x_.cols(); ++p) {
      const double mass = model.mass[static_cast<std::size_t>(p)];
      if (mass > 0) {
        v_.col(p) =
            keep * v_.col(p) - (starts_[static_cast<std::size_t>(p)] ? 0.5 : 1.0) * gain / mass * gradient_.col(p);
        x_.col(p) += step_s_ * v_.col(p);
      }
    }
    ++steps_;
    starts_.assign(starts_.size(), false);
    for (const Index p : held_) {
      const Vec3d next = motion_(p, time_s());
      v_.col(p).setZero();
      starts_[p] = true;
      x_.col(p) = next;
    }
  }
}

double HighestFrequency(const ElasticEnergy& energy, const Points& x) {
  const SparseMatrix lower = energy.Hessian(x, false);
  const auto K = lower.selfadjointView<Eigen::Lower>();
  const std::vector<double>& mass = energy.model().mass;
  Eigen::VectorXd v(lower.cols()), inverse_mass(lower.cols());
  for (Eigen::Index i = 0; i < v.size(); ++i) {
    const double m = mass[static_cast<std::size_t>(i / 3)];
    inverse_mass[i] = m > 0 ? 1 / m : 0;
    v[i] = std::sin(static_cast<double>(i * i % 1009));  // An arbitrary start, the same in every run.
  }
  double eigenvalue = 0;
  for (int i = 0; i < 100; ++i) {
    v.normalize();
    v = inverse_mass.cwiseProduct(K * v).eval();
    eigenvalue = v.norm();
  }
  return std::sqrt(eigenvalue);
}

}  // namespace fulcrum::physics::reference
