// The tissue as one elastic energy in SI units, in double, independent of any solver. The fast solver packs it into
// vectors, the reference solver of the tests minimises it as it stands, so their difference is the solver's error.
//
//   E(x) = sum springs  A L (e^2 / 2 + c e^4 / 4),      e = |x_j - x_i| / L - 1        (membrane)
//        + sum hinges   k / 2 |sum_i c_i (x_i - X_i)|^2                                  (membrane bending)
//        + sum tets     V Psi(F)                                                        (organ, tet_energy.h)
//        + sum bindings k / 2 (|x_m - sum_i b_i x_i| - d)^2                              (eq. 9 of the paper)
//
// with inertia M and viscous drag -damping M v.
#pragma once

#include <array>
#include <vector>

#include "services/core/scene_view.h"

namespace fulcrum::physics {

/// Membrane edge 3 * node + direction, as in TopologyState.
struct ElasticSpring {
  Index a = 0, b = 0;      ///< Particles.
  double rest_length = 0;  ///< Without tension: shorter than in the rest shape where the membrane is prestrained [m].
  double axial = 0;        ///< A: tension per engineering strain [N]; 0 where the grid has no such edge.
};

/// Quadratic bending (Bergou et al. 2006) about the rest shape: constant Hessian, no singular angles. That the rest
/// curvature does not turn with the sheet costs a moment of rigidity x curvature, far below the tension's.
struct ElasticHinge {
  std::array<Index, 4> v{};
  std::array<double, 4> c{};  ///< Dimensionless; they sum to 0 and vanish on any linear displacement.
  double stiffness = 0;       ///< [N/m]
};

struct ElasticTet {
  Tetrahedron v{};
  double volume = 0;    ///< At rest [m^3].
  Mat3d inverse_edges;  ///< Inverse of the matrix with columns X1 - X0, X2 - X0, X3 - X0 [1/m].
};

struct ElasticBinding {
  Index membrane = 0;
  Triangle surface{};
  std::array<double, 3> barycentric{};
  double rest_length = 0;  ///< [m]
  double stiffness = 0;    ///< [N/m]
};

struct ElasticModel {
  std::vector<Vec3d> rest_position;  ///< [n] frame W, m.
  std::vector<double> mass;          ///< [n] kg; 0 = fixed.
  std::vector<ElasticSpring> springs;
  std::vector<ElasticHinge> hinges;
  std::vector<ElasticTet> tets;
  std::vector<ElasticBinding> bindings;
  double stiffening = 0;            ///< c of the springs.
  double mu_Pa = 0, lambda_Pa = 0;  ///< Lamé parameters of the organ.
  double damping_per_s = 0;
  Vec3d gravity = Vec3d::Zero();

  [[nodiscard]] bool fixed(Index particle) const { return mass[particle] == 0.0; }
};

/// Moduli into elements. Springs: a row or column of the grid carries E t times its share of the width, so a strip in
/// uniaxial tension along rows or columns is exact; diagonals give the sheet its shear stiffness.
[[nodiscard]] ElasticModel BuildElasticModel(const SceneView& scene);

}  // namespace fulcrum::physics
