// The rotation that fits a set of places best to its places at rest (shape matching: Mueller et al. 2005).
//
//   R = argmax tr(R^T A),    A = sum_i (x_i - c) p_i^T
//
//   x_i  places [m], c their centre      p_i  places at rest about theirs [m]
//
// By Newton's method from the last rotation, whose steps ascend also where the function is not concave: R <- exp(w) R,
//
//   w = |H|^-1 g,   g = sum_i q_i x (x_i - c),   H = tr(S) I - (S + S^T) / 2,   S = A R^T,   q_i = R p_i
//
// A set in one line leaves the rotation about the line as it was; one in a plane, and a mirrored one, are no special
// cases.
#pragma once

#include "services/base/core/types.h"

namespace fulcrum::physics {

/// R from A, beginning at `from`; `from` if A is 0 or not finite. The same input gives the same bits.
[[nodiscard]] Eigen::Quaterniond FitRotation(const Mat3d& A, const Eigen::Quaterniond& from);

/// tr(S) I - (S + S^T) / 2.
[[nodiscard]] inline Mat3d TurnStiffness(const Mat3d& S) {
  return S.trace() * Mat3d::Identity() - 0.5 * (S + S.transpose());
}

}  // namespace fulcrum::physics
