#include "tests/benchmark/physics/baselines/textbook_pbd.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "physics_node/tissue/constraints.h"

namespace fulcrum::physics::baselines {
namespace {

using Vec = Eigen::Vector3d;
using Particles = std::vector<PbdParticle>;

/// Least denominator of a correction, relative to its largest term, where a vertex cannot move; masses of zero excepted
/// (DESIGN.md, "Vertices that cannot move").
constexpr double kLeastPart = 0.2;

template <int N>
std::array<V3<double>, N> Positions(const Particles& particles, const std::array<Index, N>& v) {
  std::array<V3<double>, N> x;
  for (std::size_t i = 0; i < N; ++i) {
    x[i] = particles[v[i]].x;
  }
  return x;
}

class StretchObject : public PbdConstraint {
 public:
  StretchObject(Index a, Index b, double rest, double k) : v_{a, b}, rest_(rest), k_(k) {}
  void Project(Particles* particles) const override {
    PbdParticle &a = (*particles)[v_[0]], &b = (*particles)[v_[1]];
    const Vec d = b.x - a.x;
    const double length = d.norm();
    if (a.w + b.w > 0 && length > 0) {
      const Vec move = d * (k_ * (length - rest_) / (length * (a.w + b.w)));
      a.x += a.w * move;
      b.x -= b.w * move;
    }
  }

 private:
  std::array<Index, 2> v_;
  double rest_, k_;
};

class VolumeObject : public PbdConstraint {
 public:
  VolumeObject(const Tetrahedron& v, const Particles& particles, double k) : v_(v), k_(k) {
    const auto rest = Volume<double>(Positions<4>(particles, v), 0.0);
    rest_ = rest.value;
    for (std::size_t i = 0; i < 4; ++i) {
      floor_ += 1e-3 * particles[v[i]].w * rest.gradient[i].squaredNorm();
    }
  }
  void Project(Particles* particles) const override {
    const auto c = Volume<double>(Positions<4>(*particles, v_), rest_);
    double sum = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      sum += (*particles)[v_[i]].w * c.gradient[i].squaredNorm();
    }
    if (sum > 0) {
      const double lambda = -k_ * c.value / std::max(sum, floor_);
      for (std::size_t i = 0; i < 4; ++i) {
        PbdParticle& p = (*particles)[v_[i]];
        p.x += lambda * p.w * c.gradient[i];
      }
    }
  }

 private:
  Tetrahedron v_;
  double rest_, floor_ = 0, k_;
};

class BendingObject : public PbdConstraint {
 public:
  BendingObject(const BendingConstraint& c, double k) : v_(c.v), rest_(c.rest_angle), k_(k) {}
  void Project(Particles* particles) const override {
    const auto c = Bending<double>(Positions<4>(*particles, v_), rest_);
    double sum = 0, heaviest = 0, steepest = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      const double w = (*particles)[v_[i]].w, g = c.gradient[i].squaredNorm();
      sum += w * g;
      heaviest = std::max(heaviest, w);
      steepest = std::max(steepest, g);
    }
    if (sum > 0) {
      const double lambda = -k_ * c.value / std::max(sum, kLeastPart * heaviest * steepest);
      for (std::size_t i = 0; i < 4; ++i) {
        PbdParticle& p = (*particles)[v_[i]];
        p.x += lambda * p.w * c.gradient[i];
      }
    }
  }

 private:
  std::array<Index, 4> v_;
  double rest_, k_;
};

/// Pulls along the line between the two points when stretched, pushes along the organ's normal when pressed in.
class BindingObject : public PbdConstraint {
 public:
  BindingObject(const Binding& c, const Particles& particles, double k)
      : v_{c.membrane, c.surface[0], c.surface[1], c.surface[2]},
        b_{c.barycentric[0], c.barycentric[1], c.barycentric[2]},
        rest_length_(c.rest_length),
        k_(k) {
    rest_height_ = std::max(0.0, Normal(particles).dot(Arm(particles)));
  }
  void Project(Particles* particles) const override {
    const Vec d = Arm(*particles), n = Normal(*particles);
    const double length = d.norm(), height = n.dot(d);
    double sum = (*particles)[v_[0]].w, heaviest = sum;
    for (std::size_t i = 0; i < 3; ++i) {
      const double w = (*particles)[v_[i + 1]].w;
      sum += w * b_[i] * b_[i];
      heaviest = std::max(heaviest, w);
    }
    if (!(sum > 0)) {
      return;
    }
    const double pressed = std::max(std::min(1.0, 10 * k_) * (rest_height_ - height), 0.3 * rest_height_ - height);
    Vec move = std::max(0.0, pressed) * n;
    if (length > rest_length_) {
      move -= k_ * (length - rest_length_) / length * d;
    }
    move /= std::max(sum, kLeastPart * heaviest);
    (*particles)[v_[0]].x += (*particles)[v_[0]].w * move;
    for (std::size_t i = 0; i < 3; ++i) {
      PbdParticle& p = (*particles)[v_[i + 1]];
      p.x -= p.w * b_[i] * move;
    }
  }

 private:
  [[nodiscard]] Vec Arm(const Particles& p) const {
    return p[v_[0]].x - (b_[0] * p[v_[1]].x + b_[1] * p[v_[2]].x + b_[2] * p[v_[3]].x);
  }
  [[nodiscard]] Vec Normal(const Particles& p) const {
    return (p[v_[2]].x - p[v_[1]].x).cross(p[v_[3]].x - p[v_[1]].x).normalized();
  }
  std::array<Index, 4> v_;
  std::array<double, 3> b_;
  double rest_length_, rest_height_, k_;
};

/// Edges 3 * node + direction of the membrane, row by row.
std::vector<Index> EdgesOfScene(const MembraneGrid& grid) {
  std::vector<Index> edges(3 * std::size_t{grid.node_count()});
  std::iota(edges.begin(), edges.end(), Index{0});
  return edges;
}

/// The same as the kernels sweep over them (physics_node/pbd/kernels.h): even row pairs, then odd ones; along a row
/// even slots, odd slots, then the last one, where slot = column % slots. More than one slot.
std::vector<Index> EdgesOfKernels(const MembraneGrid& grid) {
  const Index slots = (grid.cols + 7) / 8;
  std::vector<Index> edges;
  const auto add = [&](Index row, Index col, Index direction) {
    edges.push_back(3 * (row * grid.cols + col) + direction);
  };
  const auto along = [&](Index row) {
    for (Index pass = 0; pass < 3; ++pass) {
      for (Index col = 0; col < grid.cols; ++col) {
        const Index slot = col % slots;
        if (pass == 2 ? slot + 1 == slots : slot % 2 == pass && slot + 1 != slots) {
          add(row, col, 0);
        }
      }
    }
  };
  for (Index first = 0; first < 2; ++first) {
    for (Index row = first; row < grid.rows; row += 2) {
      for (Index r = row; first == 0 && r < std::min(row + 2, grid.rows); ++r) {
        along(r);
      }
      for (Index direction = 1; direction < 3; ++direction) {
        for (Index col = 0; col < grid.cols; ++col) {
          add(row, col, direction);
        }
      }
    }
  }
  return edges;
}

}  // namespace

TextbookPbd::TextbookPbd(const SceneView& scene, Order order) : params_(scene.physics) {
  for (std::size_t i = 0; i < scene.rest_position.size(); ++i) {
    const Vec x = scene.rest_position[i].cast<double>();
    particles_.push_back({x, x, scene.inverse_mass[i]});
  }
  for (const StretchConstraint& c : scene.tube_edges) {
    constraints_.push_back(std::make_unique<StretchObject>(c.a, c.b, c.rest_length, params_.k_stretch_tube));
  }
  for (const Tetrahedron& tet : scene.tets) {
    constraints_.push_back(std::make_unique<VolumeObject>(tet, particles_, params_.k_volume));
  }
  const std::array<Index, 3> apart{1, scene.membrane.cols, scene.membrane.cols + 1};
  for (const Index edge : order == Order::kScene ? EdgesOfScene(scene.membrane) : EdgesOfKernels(scene.membrane)) {
    const float rest = scene.membrane_rest_length[edge];
    if (rest > 0) {
      const Index a = scene.membrane.first + edge / 3;
      constraints_.push_back(std::make_unique<StretchObject>(a, a + apart[edge % 3], rest, params_.k_stretch_membrane));
    }
  }
  for (const BendingConstraint& c : scene.bending) {
    constraints_.push_back(std::make_unique<BendingObject>(c, params_.k_bending));
  }
  for (const Binding& c : scene.bindings) {
    constraints_.push_back(std::make_unique<BindingObject>(c, particles_, params_.k_binding));
  }
}

void TextbookPbd::Step() {
  const double dt = params_.dt_s, keep = std::max(0.0, 1.0 - params_.damping_per_s * dt);
  const Vec fall = params_.gravity.cast<double>() * dt * dt;
  for (PbdParticle& p : particles_) {
    const Vec step = (p.x - p.previous) * keep + fall;
    p.previous = p.x;
    if (p.w > 0) {
      p.x += step;
    }
  }
  for (std::uint32_t i = 0; i < params_.iterations; ++i) {
    for (const auto& constraint : constraints_) {
      constraint->Project(&particles_);
    }
  }
}

}  // namespace fulcrum::physics::baselines
