// An energy against inverted tetrahedra. The organ's law sits at patches of some twenty tetrahedra, so a single one may
// turn over within a patch of J > 0: a fold below the resolution of the law. Inverted tetrahedra get
//
//   E = k V / 2 |F - R|^2,     dE/dx_i = k V (F - R) g_i,     K_ij = k V g_i . g_j I
//
//   F = sum_i x_i (x) g_i  deformation gradient, g_i [1/m];  R the rotation nearest to F (polar decomposition)
//   V volume at rest [m^3];  k stiffness [Pa]
//
// until they are nearly in their shape at rest again. The force opens folds from any state, slivers and mirrored
// tetrahedra alike. Since R follows F, the constant matrix k V is never below the second derivative (the bound behind
// shape matching and projective dynamics: Bouaziz et al. 2014), so substeps do not overshoot. Tissue without folds gets
// nothing.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "physics_node/energy/elastic_model.h"

namespace fulcrum::physics::implicit {

class InversionGuard {
 public:
  /// `solid` of each vertex; empty: one for all. Tetrahedra of one solid follow each other.
  explicit InversionGuard(const ElasticModel& model, std::span<const Index> solid = {});

  /// Once a substep: examines the next part of the tetrahedra of solids that are computed, or were since their last
  /// examination (all of them within kScanSubsteps substeps; `computed` by solid, empty: all), and linearises those
  /// found so far.
  void Linearise(const float* place, std::span<const std::uint8_t> computed = {});
  /// Solids of which tetrahedra are guarded, ascending.
  [[nodiscard]] std::span<const Index> folded() const { return folded_; }
  /// body(vertex) for the vertices of the tetrahedra found.
  template <class Body>
  void ForVerticesFound(const Body& body) const {
    for (const Found& found : found_) std::for_each(tets_[found.tet].begin(), tets_[found.tet].end(), body);
  }
  /// body(vertex, stiffness [N/m]): what the guarded tetrahedra add to the diagonal, a vertex perhaps several times.
  template <class Body>
  void ForDiagonal(const Body& body) const;
  /// Adds the forces of the last Linearise to the tube part of `residual`.
  void AddForce(float* residual) const;
  /// out += scale * K p; returns p . K p.
  double Apply(const float* p, float scale, float* out) const;
  /// p . K p.
  [[nodiscard]] double Curvature(const float* p) const;
  /// Of the guarded tetrahedra, at `place` [J].
  [[nodiscard]] double Energy(const float* place) const;

 private:
  /// Substeps in which all tetrahedra are examined once: a sixteenth each costs little, and a fold is found in 0.1 s.
  static constexpr std::size_t kScanSubsteps = 16;
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
  /// Tetrahedra of a solid, and how many are still to be examined: all of them once after it has moved.
  struct Part {
    Index solid = 0;
    std::size_t first = 0, end = 0, due = 0;
  };
  [[nodiscard]] Eigen::Matrix3f Gradient(std::size_t tet, const float* place) const;
  void Scan(const float* place, std::span<const std::uint8_t> computed);

  std::vector<Vertices> tets_;
  std::vector<Part> parts_;
  std::vector<Shape> shapes_;
  std::vector<Found> found_;
  std::vector<Index> folded_;
  std::size_t next_ = 0;
};

template <class Body>
void InversionGuard::ForDiagonal(const Body& body) const {
  // Blocks of the diagonal leave out what couples the four vertices; twice the diagonal bounds the largest eigenvalue
  // of the preconditioned element by two instead of four.
  constexpr float kDiagonalFactor = 2.0f;
  for (const Found& found : found_) {
    const Shape& shape = shapes_[found.tet];
    for (std::size_t k = 0; k < 4; ++k) {
      body(tets_[found.tet][k], kDiagonalFactor * shape.stiffness * shape.gradient[k].squaredNorm());
    }
  }
}

}  // namespace fulcrum::physics::implicit
