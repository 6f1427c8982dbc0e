// The membrane as a continuum: the energy of a linear triangle as a function of its squared edge lengths.
//
//   E = a (I + b I^2),   I = tr C + 1 / det C - 3,   a = E t A0 / 6,   b = c / 6
//
// C is the right Cauchy-Green tensor in the plane of the triangle. This is the law of Yeoh (1993) with two terms, for
// an incompressible sheet whose faces are free of stress: 1 / det C is the squared stretch of its thickness. It is
// isotropic; with b = 0 it is neo-Hookean. At small strain it has Young's modulus E and Poisson's ratio 1/2, and c is
// that of a tension E t (e + c e^3) in a strip at strain e.
//
// C is linear in the squares of the edges, so no frame is needed, and no edge is preferred:
//
//   tr C  = sum alpha_i l_i,                 alpha_i = (L_j + L_k - L_i) / (8 A0^2)
//   det C = (g/4) (2 sum_{i<j} l_i l_j - sum l_i^2),   g/4 = 1 / (16 A0^2) = sum_{i<j} alpha_i alpha_j / 4   (Heron)
//   dE/dl_i = a (1 + 2 b I) (alpha_i + f' D_i),   D_i = d det C / d l_i
//
//   l_i, L_i   squared length of edge i [m^2], now and without stress;   A0  area without stress [m^2]
//   f          1 / det C, below det C = kLeastDeterminant its tangent: a sheet wrinkles instead of resisting
//   E t, c     modulus times thickness [N/m] and stiffening of the scene
//
// With d_i along edge i, the force on its first end is 2 dE/dl_i d_i. The stiffness has a geometric part, 2 dE/dl_i
// between the ends of an edge, and 4 H_ij d_i d_j^T with H the second derivative. Above kLeastDeterminant E is convex
// in C, so H is never negative; below it TriangleCoupling::kBound leaves out the negative part.
#pragma once

#include <Eigen/Core>
#include <array>

#include "services/base/core/types.h"

namespace fulcrum::physics {

/// Below this share of its area squared a triangle resists no more than here, and 1 / det C continues along its
/// tangent: real membranes buckle at far less. Assumed.
inline constexpr double kLeastDeterminant = 0.5;
/// Least 2 A0 over the squared longest edge, 1/2 for half a square. A thinner triangle has next to no area, and an
/// error of its edges is a large strain: its edges act as springs.
inline constexpr double kLeastTriangle = 0.1;

/// A triangle without stress. Edges: 0 along the row, 1 down the column, 2 diagonal.
struct TriangleRest {
  double stiffness = 0;           ///< a [J]; 0: not a triangle, its edges are springs.
  std::array<double, 3> trace{};  ///< alpha_i [1/m^2].
};
[[nodiscard]] TriangleRest RestOfTriangle(const std::array<double, 3>& lengths_m, double Et_N_per_m);

/// Energy and its derivatives by squared edge lengths.
struct TriangleTerms {
  double energy = 0;                                   ///< [J]
  Eigen::Vector3d tension = Eigen::Vector3d::Zero();   ///< 2 dE/dl_i: force over length [N/m].
  Eigen::Matrix3d coupling = Eigen::Matrix3d::Zero();  ///< 4 d2E/dl_i dl_j [N/m^3].
};
/// kForce leaves `coupling` 0; kBound makes it a bound from above that is never negative.
enum class TriangleCoupling { kForce, kExact, kBound };
[[nodiscard]] TriangleTerms EvaluateTriangle(const TriangleRest& rest, double b,
                                             const std::array<double, 3>& squares_m2, TriangleCoupling coupling);

}  // namespace fulcrum::physics
