// The organ's law sits at patches of some twenty tetrahedra, so a single one may turn over within a sound patch and
// stay so: a fold finer than the law can see. This adds what the law lacks there and nowhere else,
//
//   E = k V / 2 |F - R|^2,   R the rotation nearest to F,
//
// for tetrahedra that have been found turned over, until they are nearly in their shape at rest again. It draws a fold
// open from wherever it is, slivers and mirrored ones alike, and since R follows F, the constant matrix k V is never
// below its second derivative (the bound behind shape matching and projective dynamics: Bouaziz et al. 2014), so
// substeps do not go too far. Nothing is added to tissue without folds.
#pragma once

#include <array>
#include <vector>

#include "physics_node/energy/elastic_model.h"

namespace fulcrum::physics::implicit {

class InversionGuard {
 public:
  explicit InversionGuard(const ElasticModel& model);

  /// Once a substep: looks at the next part of all tetrahedra (all of them within kParts substeps), and linearises
  /// those found so far.
  void Linearise(const float* place);
  /// There are some.
  [[nodiscard]] bool folded() const { return !found_.empty(); }
  /// body(vertex, stiffness [N/m]): what the diagonal should know of those found, a vertex perhaps several times.
  template <class Body>
  void ForDiagonal(const Body& body) const;
  /// Adds the forces of the last Linearise to the tube part of `residual`.
  void AddForce(float* residual) const;
  /// out += scale * K p; returns p . K p.
  double Apply(const float* p, float scale, float* out) const;
  /// p . K p.
  [[nodiscard]] double Curvature(const float* p) const;
  /// Of those found, at `place` [J].
  [[nodiscard]] double Energy(const float* place) const;

 private:
  static constexpr std::size_t kParts = 16;
  using Vertices = std::array<Index, 4>;
  struct Shape {
    float stiffness = 0;  ///< k V [J].
    std::array<Vec3f, 4> gradient{Vec3f::Zero(), Vec3f::Zero(), Vec3f::Zero(),
                                  Vec3f::Zero()};  ///< F = sum x (x) gradient [1/m].
  };
  struct Found {
    std::size_t tet = 0;
    Eigen::Matrix3f strain = Eigen::Matrix3f::Zero();  ///< F - R.
  };
  [[nodiscard]] Eigen::Matrix3f Gradient(std::size_t tet, const float* place) const;
  void Look(const float* place);

  std::vector<Vertices> tets_;
  std::vector<Shape> shapes_;
  std::vector<Found> found_;
  std::size_t next_ = 0;
};

template <class Body>
void InversionGuard::ForDiagonal(const Body& body) const {
  // Four vertices that share an element: the largest eigenvalue stays below two.
  constexpr float kShare = 2.0f;
  for (const Found& found : found_) {
    const Shape& shape = shapes_[found.tet];
    for (std::size_t k = 0; k < 4; ++k) {
      body(tets_[found.tet][k], kShare * shape.stiffness * shape.gradient[k].squaredNorm());
    }
  }
}

}  // namespace fulcrum::physics::implicit
