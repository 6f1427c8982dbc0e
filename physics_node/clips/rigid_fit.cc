#include "physics_node/clips/rigid_fit.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace fulcrum::physics {
namespace {

/// A warm start needs one or two steps; from any rotation less than twenty.
constexpr int kMostSteps = 30;
/// Step at which the rotation is found [rad]: far below the rounding of a position over the size of a clip.
constexpr double kFound_rad = 1e-10;
/// Longest step [rad]. Newton's step for a rotation by t about one axis is tan t, which overshoots from 65 degrees on.
constexpr double kLongestStep_rad = 1.0;
/// Least eigenvalue that is divided by, over the largest: about the line of a set in one line it is 0.
constexpr double kLeastEigenvalue = 1e-6;

}  // namespace

Eigen::Quaterniond FitRotation(const Mat3d& A, const Eigen::Quaterniond& from) {
  if (!A.allFinite()) return from;
  Eigen::Quaterniond turn = from;
  for (int i = 0; i < kMostSteps; ++i) {
    const Mat3d S = A * turn.toRotationMatrix().transpose();
    const Vec3d g(S(2, 1) - S(1, 2), S(0, 2) - S(2, 0), S(1, 0) - S(0, 1));
    const Eigen::SelfAdjointEigenSolver<Mat3d> H(TurnStiffness(S));
    const Eigen::Array3d sizes = H.eigenvalues().array().abs();
    const double largest = sizes.maxCoeff();
    if (!(largest > 0)) return turn;
    const Vec3d along = H.eigenvectors().transpose() * g;
    Vec3d w = H.eigenvectors() * (along.array() / sizes.max(kLeastEigenvalue * largest)).matrix();
    const double length = w.norm();
    if (!(length > kFound_rad)) return turn;
    if (length > kLongestStep_rad) w *= kLongestStep_rad / length;
    const double angle = std::min(length, kLongestStep_rad);
    turn = (Eigen::Quaterniond(Eigen::AngleAxisd(angle, w / angle)) * turn).normalized();
  }
  return turn;
}

}  // namespace fulcrum::physics
