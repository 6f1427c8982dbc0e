#include "tests/benchmark/physics/baselines/mass_spring.h"

#include <algorithm>
#include <map>

namespace fulcrum::physics::baselines {

MassSpring::MassSpring(const SceneView& scene)
    : dt_(scene.physics.dt_s),
      model_(BuildElasticModel(scene)),
      x_(model_.rest_position),
      v_(x_.size(), Vec3d::Zero()),
      force_(x_.size()) {
  for (const double mass : model_.mass) {
    w_.push_back(mass > 0 ? 1 / mass : 0);
  }
  model_.load.resize(x_.size(), Vec3d::Zero());
  for (const ElasticSpring& s : model_.springs) {
    springs_.push_back({s.a, s.b, s.rest_length, s.rest_length > 0 ? s.axial / s.rest_length : 0});
  }
  AddOrgan(model_);
  LimitStiffness(dt_ / kSubsteps);
}

/// Springs along the edges of the tetrahedra, each tet giving E V / L^2 (Van Gelder 1998).
void MassSpring::AddOrgan(const ElasticModel& model) {
  const double E = model.mu_Pa * (3 * model.lambda_Pa + 2 * model.mu_Pa) / (model.lambda_Pa + model.mu_Pa);
  std::map<std::pair<Index, Index>, double> edges;
  for (const ElasticTet& tet : model.tets) {
    for (std::size_t i = 0; i < 4; ++i) {
      for (std::size_t j = i + 1; j < 4; ++j) {
        const auto [a, b] = std::minmax(tet.v[i], tet.v[j]);
        edges[{a, b}] += E * tet.volume / (model.rest_position[a] - model.rest_position[b]).squaredNorm();
      }
    }
  }
  for (const auto& [ends, stiffness] : edges) {
    const double rest = (model.rest_position[ends.first] - model.rest_position[ends.second]).norm();
    springs_.push_back({ends.first, ends.second, rest, stiffness});
  }
}

/// Central differences are stable below a frequency of 2 / h; by Gershgorin w * 2 * (sum of stiffnesses) bounds its
/// square. Each spring's stiffness is limited to what both its ends allow; the dead load is reduced with it, so that
/// the rest shape stays in equilibrium.
void MassSpring::LimitStiffness(double h) {
  std::vector<double> sum(x_.size(), 0);
  for (const Spring& s : springs_) {
    sum[s.a] += s.stiffness;
    sum[s.b] += s.stiffness;
  }
  for (const ElasticBinding& b : model_.bindings) {
    sum[b.membrane] += b.stiffness;
    for (std::size_t i = 0; i < 3; ++i) {
      sum[b.surface[i]] += b.barycentric[i] * b.stiffness;
    }
  }
  const auto part = [&](Index p) { return w_[p] > 0 ? std::min(1.0, 1.0 / (h * h * w_[p] * sum[p])) : 1.0; };
  for (ElasticBinding& b : model_.bindings) {
    b.stiffness *= std::min({part(b.membrane), part(b.surface[0]), part(b.surface[1]), part(b.surface[2])});
  }
  std::fill(model_.load.begin(), model_.load.end(), Vec3d::Zero());
  for (Spring& s : springs_) {
    s.stiffness *= std::min(part(s.a), part(s.b));
    if (s.stiffness > 0) {
      const Vec3d d = model_.rest_position[s.b] - model_.rest_position[s.a];
      const Vec3d tension = s.stiffness * (d.norm() - s.rest) * d.normalized();
      model_.load[s.a] -= tension;
      model_.load[s.b] += tension;
    }
  }
}

void MassSpring::SetPositions(std::span<const float> xyz) {
  for (std::size_t p = 0; p < x_.size(); ++p) {
    x_[p] = Vec3d(xyz[3 * p], xyz[3 * p + 1], xyz[3 * p + 2]);
    v_[p].setZero();
  }
}

void MassSpring::ReadPositions(std::span<float> xyz) const {
  for (std::size_t p = 0; p < x_.size(); ++p) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      xyz[3 * p + axis] = static_cast<float>(x_[p][static_cast<Eigen::Index>(axis)]);
    }
  }
}

void MassSpring::Hold(std::span<const Index> particles) {
  for (const Index p : held_) {
    w_[p] = model_.mass[p] > 0 ? 1 / model_.mass[p] : 0;
  }
  held_.assign(particles.begin(), particles.end());
  begin_.clear();
  for (const Index p : held_) {
    w_[p] = 0;
    v_[p].setZero();
    begin_.push_back(x_[p]);
  }
  end_ = begin_;
}

void MassSpring::MoveHeld(std::span<const Vec3f> places) {
  for (std::size_t i = 0; i < places.size(); ++i) {
    end_[i] = places[i].cast<double>();
  }
}

void MassSpring::CutEdges(std::span<const std::size_t> edges) {
  for (const std::size_t edge : edges) {
    springs_[edge].stiffness = 0;
  }
}

void MassSpring::Step() {
  const double h = dt_ / kSubsteps, keep = 1 / (1 + model_.damping_per_s * h);
  for (int substep = 1; substep <= kSubsteps; ++substep) {
    force_ = model_.load;
    for (const Spring& s : springs_) {
      const Vec3d d = x_[s.b] - x_[s.a];
      const double length = d.norm();
      if (s.stiffness > 0 && length > 0) {
        const Vec3d f = (s.stiffness * (length - s.rest) / length) * d;
        force_[s.a] += f;
        force_[s.b] -= f;
      }
    }
    for (const ElasticBinding& b : model_.bindings) {
      Vec3d d = x_[b.membrane];
      for (std::size_t i = 0; i < 3; ++i) {
        d -= b.barycentric[i] * x_[b.surface[i]];
      }
      const double length = d.norm();
      if (length > 0) {
        const Vec3d f = (b.stiffness * (length - b.rest_length) / length) * d;
        force_[b.membrane] -= f;
        for (std::size_t i = 0; i < 3; ++i) {
          force_[b.surface[i]] += b.barycentric[i] * f;
        }
      }
    }
    for (std::size_t p = 0; p < x_.size(); ++p) {
      if (w_[p] > 0) {
        v_[p] = keep * (v_[p] + h * (w_[p] * force_[p] + model_.gravity));
        x_[p] += h * v_[p];
      }
    }
    const double part = static_cast<double>(substep) / kSubsteps;
    for (std::size_t i = 0; i < held_.size(); ++i) {
      x_[held_[i]] = begin_[i] + part * (end_[i] - begin_[i]);
    }
  }
  begin_ = end_;
}

}  // namespace fulcrum::physics::baselines
