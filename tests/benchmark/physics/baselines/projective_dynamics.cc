#include "tests/benchmark/physics/baselines/projective_dynamics.h"

#include <array>

namespace fulcrum::physics::baselines {
namespace {

/// Calls add(particles, coefficients, weight) for each quadratic weight/2 |sum_i c_i x_i - target|^2 of the system. The
/// organ has mu V |F - R|^2, three rows per tet.
template <class Add>
void ForTerms(const ElasticModel& model, const Add& add) {
  for (const ElasticSpring& s : model.springs) {
    if (s.axial > 0) {
      add(std::array<Index, 2>{s.a, s.b}, std::array<double, 2>{-1, 1}, s.axial / s.rest_length);
    }
  }
  for (const ElasticTet& tet : model.tets) {
    for (int row = 0; row < 3; ++row) {
      std::array<double, 4> c{0, 0, 0, 0};
      for (int i = 0; i < 3; ++i) {
        c[static_cast<std::size_t>(i) + 1] = tet.inverse_edges(i, row);
        c[0] -= tet.inverse_edges(i, row);
      }
      add(tet.v, c, 2 * model.mu_Pa * tet.volume);
    }
  }
  for (const ElasticHinge& hinge : model.hinges) {
    add(hinge.v, hinge.c, hinge.stiffness);
  }
  for (const ElasticBinding& b : model.bindings) {
    add(std::array<Index, 4>{b.membrane, b.surface[0], b.surface[1], b.surface[2]},
        std::array<double, 4>{1, -b.barycentric[0], -b.barycentric[1], -b.barycentric[2]}, b.stiffness);
  }
}

/// The rotation nearest to `a`, iterated from an initial guess (Mueller et al. 2016).
void Turn(const Mat3d& a, Eigen::Quaterniond* q) {
  for (int i = 0; i < 4; ++i) {
    const Mat3d r = q->toRotationMatrix();
    const Vec3d omega = (r.col(0).cross(a.col(0)) + r.col(1).cross(a.col(1)) + r.col(2).cross(a.col(2))) /
                        (std::abs(r.col(0).dot(a.col(0)) + r.col(1).dot(a.col(1)) + r.col(2).dot(a.col(2))) + 1e-9);
    const double angle = omega.norm();
    if (angle < 1e-9) {
      return;
    }
    *q = Eigen::Quaterniond(Eigen::AngleAxisd(angle, omega / angle)) * *q;
    q->normalize();
  }
}

}  // namespace

ProjectiveDynamics::ProjectiveDynamics(const SceneView& scene)
    : dt_(scene.physics.dt_s),
      model_(BuildElasticModel(scene)),
      x_(model_.rest_position.size(), 3),
      v_(Points::Zero(x_.rows(), 3)),
      turn_(model_.tets.size(), Eigen::Quaterniond::Identity()),
      is_held_(model_.rest_position.size(), false),
      unknown_(model_.rest_position.size(), -1) {
  for (Eigen::Index p = 0; p < x_.rows(); ++p) {
    x_.row(p) = model_.rest_position[static_cast<std::size_t>(p)].transpose();
  }
  model_.load.resize(model_.rest_position.size(), Vec3d::Zero());
}

void ProjectiveDynamics::SetPositions(std::span<const float> xyz) {
  for (Eigen::Index p = 0; p < x_.rows(); ++p) {
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      x_(p, axis) = xyz[static_cast<std::size_t>(3 * p + axis)];
    }
  }
  v_.setZero();
}

void ProjectiveDynamics::ReadPositions(std::span<float> xyz) const {
  for (Eigen::Index p = 0; p < x_.rows(); ++p) {
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      xyz[static_cast<std::size_t>(3 * p + axis)] = static_cast<float>(x_(p, axis));
    }
  }
}

void ProjectiveDynamics::Hold(std::span<const Index> particles) {
  held_.assign(particles.begin(), particles.end());
  is_held_.assign(is_held_.size(), false);
  held_place_.resize(static_cast<Eigen::Index>(held_.size()), 3);
  for (std::size_t i = 0; i < held_.size(); ++i) {
    is_held_[held_[i]] = true;
    held_place_.row(static_cast<Eigen::Index>(i)) = x_.row(held_[i]);
    v_.row(held_[i]).setZero();
  }
  factor_due_ = true;
}

void ProjectiveDynamics::MoveHeld(std::span<const Vec3f> places) {
  for (std::size_t i = 0; i < places.size(); ++i) {
    held_place_.row(static_cast<Eigen::Index>(i)) = places[i].cast<double>().transpose();
  }
}

void ProjectiveDynamics::CutEdges(std::span<const std::size_t> edges) {
  for (const std::size_t edge : edges) {
    model_.springs[edge].axial = 0;
  }
  factor_due_ = true;
}

void ProjectiveDynamics::Factor() {
  free_.clear();
  for (Index p = 0; p < unknown_.size(); ++p) {
    const bool moves = model_.mass[p] > 0 && !is_held_[p];
    unknown_[p] = moves ? static_cast<int>(free_.size()) : -1;
    if (moves) {
      free_.push_back(p);
    }
  }
  std::vector<Eigen::Triplet<double>> square, all;
  for (std::size_t i = 0; i < free_.size(); ++i) {
    square.emplace_back(i, i, model_.mass[free_[i]] / (dt_ * dt_));
  }
  ForTerms(model_, [&](const auto& v, const auto& c, double weight) {
    for (std::size_t i = 0; i < v.size(); ++i) {
      for (std::size_t j = 0; j < v.size(); ++j) {
        if (unknown_[v[i]] >= 0) {
          (unknown_[v[j]] >= 0 ? square : all)
              .emplace_back(unknown_[v[i]], unknown_[v[j]] >= 0 ? unknown_[v[j]] : static_cast<int>(v[j]),
                            weight * c[i] * c[j]);
        }
      }
    }
  });
  const auto n = static_cast<Eigen::Index>(free_.size());
  Matrix system(n, n);
  system.setFromTriplets(square.begin(), square.end());
  coupling_.resize(n, x_.rows());
  coupling_.setFromTriplets(all.begin(), all.end());
  factor_.compute(system);
  factor_due_ = false;
}

/// Right-hand side of the elements: sum of weight * c_i * target.
ProjectiveDynamics::Points ProjectiveDynamics::LocalStep() {
  Points sum = Points::Zero(static_cast<Eigen::Index>(free_.size()), 3);
  const auto add = [&](Index p, const Vec3d& value) {
    if (unknown_[p] >= 0) {
      sum.row(unknown_[p]) += value.transpose();
    }
  };
  for (const ElasticSpring& s : model_.springs) {
    if (s.axial > 0) {
      const Vec3d d = (x_.row(s.b) - x_.row(s.a)).transpose();
      const Vec3d target = d * (s.axial / std::max(d.norm(), 1e-12));
      add(s.a, -target);
      add(s.b, target);
    }
  }
  for (std::size_t i = 0; i < model_.tets.size(); ++i) {
    const ElasticTet& tet = model_.tets[i];
    Mat3d edges;
    for (int j = 0; j < 3; ++j) {
      edges.col(j) = (x_.row(tet.v[static_cast<std::size_t>(j) + 1]) - x_.row(tet.v[0])).transpose();
    }
    Turn(edges * tet.inverse_edges, &turn_[i]);
    const Mat3d target = 2 * model_.mu_Pa * tet.volume * turn_[i].toRotationMatrix() * tet.inverse_edges.transpose();
    for (int j = 0; j < 3; ++j) {
      add(tet.v[static_cast<std::size_t>(j) + 1], target.col(j));
    }
    add(tet.v[0], -target.rowwise().sum());
  }
  for (const ElasticHinge& hinge : model_.hinges) {
    Vec3d target = Vec3d::Zero();
    for (std::size_t j = 0; j < 4; ++j) {
      target += hinge.c[j] * model_.rest_position[hinge.v[j]];
    }
    for (std::size_t j = 0; j < 4; ++j) {
      add(hinge.v[j], hinge.stiffness * hinge.c[j] * target);
    }
  }
  for (const ElasticBinding& b : model_.bindings) {
    Vec3d d = x_.row(b.membrane).transpose();
    for (std::size_t j = 0; j < 3; ++j) {
      d -= b.barycentric[j] * x_.row(b.surface[j]).transpose();
    }
    const Vec3d target = d * (b.stiffness * b.rest_length / std::max(d.norm(), 1e-12));
    add(b.membrane, target);
    for (std::size_t j = 0; j < 3; ++j) {
      add(b.surface[j], -b.barycentric[j] * target);
    }
  }
  return sum;
}

void ProjectiveDynamics::Step() {
  if (factor_due_) {
    Factor();
  }
  const double keep = 1 / (1 + model_.damping_per_s * dt_);
  const Points start = x_;
  Points inertia(static_cast<Eigen::Index>(free_.size()), 3);
  for (std::size_t i = 0; i < free_.size(); ++i) {
    const Index p = free_[i];
    const auto row = static_cast<Eigen::Index>(i);
    x_.row(p) += dt_ * keep * v_.row(p) + dt_ * dt_ * model_.gravity.transpose();
    inertia.row(row) = model_.mass[p] / (dt_ * dt_) * x_.row(p) + model_.load[p].transpose();
  }
  for (std::size_t i = 0; i < held_.size(); ++i) {
    x_.row(held_[i]) = held_place_.row(static_cast<Eigen::Index>(i));
  }
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    const Points solved = factor_.solve(inertia + LocalStep() - coupling_ * x_);
    for (std::size_t i = 0; i < free_.size(); ++i) {
      x_.row(free_[i]) = solved.row(static_cast<Eigen::Index>(i));
    }
  }
  v_ = (x_ - start) / dt_;
  for (const Index p : held_) {
    v_.row(p).setZero();
  }
}

}  // namespace fulcrum::physics::baselines
