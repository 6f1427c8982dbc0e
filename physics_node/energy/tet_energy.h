// Stable neo-Hookean solid (Smith, de Goes, Kim 2018, eq. 13-14, without the logarithmic barrier, so that it is finite
// and recovers from any inversion):
//
//   Psi(F) = mu/2 (|F|^2 - 3) - mu (J - 1) + lambda/2 (J - 1)^2,   J = det F
//   P(F)   = mu F + (lambda (J - 1) - mu) cof F
//
// With lambda = lambda_Lame + mu it has the Lamé parameters at rest: linearising, the volumetric part is
// lambda_Lame = lambda - mu, and the shear part 2 mu.
#pragma once

#include "services/base/core/types.h"

namespace fulcrum::physics {

/// Columns are cross products of F's columns: d det(F) / dF.
template <class Scalar>
[[nodiscard]] Eigen::Matrix<Scalar, 3, 3> Cofactor(const Eigen::Matrix<Scalar, 3, 3>& F) {
  Eigen::Matrix<Scalar, 3, 3> c;
  c.col(0) = F.col(1).cross(F.col(2));
  c.col(1) = F.col(2).cross(F.col(0));
  c.col(2) = F.col(0).cross(F.col(1));
  return c;
}

template <class Scalar>
[[nodiscard]] Scalar TetEnergy(const Eigen::Matrix<Scalar, 3, 3>& F, Scalar mu, Scalar lambda_lame) {
  const Scalar j1 = F.determinant() - Scalar(1);
  return mu / 2 * (F.squaredNorm() - Scalar(3)) - mu * j1 + (lambda_lame + mu) / 2 * j1 * j1;
}

/// First Piola-Kirchhoff stress [Pa].
template <class Scalar>
[[nodiscard]] Eigen::Matrix<Scalar, 3, 3> TetStress(const Eigen::Matrix<Scalar, 3, 3>& F, Scalar mu,
                                                    Scalar lambda_lame) {
  return mu * F + ((lambda_lame + mu) * (F.determinant() - Scalar(1)) - mu) * Cofactor(F);
}

}  // namespace fulcrum::physics
