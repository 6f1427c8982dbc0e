#include "physics_node/energy/triangle_energy.h"

#include <algorithm>
#include <cmath>

namespace fulcrum::physics {

TriangleRest RestOfTriangle(const std::array<double, 3>& lengths_m, double Et_N_per_m) {
  std::array<double, 3> square{};
  for (std::size_t i = 0; i < 3; ++i) {
    square[i] = lengths_m[i] * lengths_m[i];
  }
  const double sum = square[0] + square[1] + square[2];
  const double sixteen_area_sq =
      sum * sum - 2 * (square[0] * square[0] + square[1] * square[1] + square[2] * square[2]);
  const double longest = std::max({square[0], square[1], square[2]});
  // 16 A0^2 = 4 (2 A0)^2.
  const double least = 2 * kLeastTriangle * longest;
  if (!(sixteen_area_sq > least * least)) {
    return {};
  }
  TriangleRest rest;
  rest.stiffness = Et_N_per_m * std::sqrt(sixteen_area_sq) / 24;
  for (std::size_t i = 0; i < 3; ++i) {
    rest.trace[i] = 2 * (sum - 2 * square[i]) / sixteen_area_sq;
  }
  return rest;
}

TriangleTerms EvaluateTriangle(const TriangleRest& rest, double b, const std::array<double, 3>& squares_m2,
                               TriangleCoupling coupling) {
  const Eigen::Map<const Eigen::Vector3d> alpha(rest.trace.data()), l(squares_m2.data());
  const double half_g = (alpha[0] * alpha[1] + alpha[1] * alpha[2] + alpha[2] * alpha[0]) / 2;
  // D_i and, as det C is homogeneous of degree 2, det C itself.
  const Eigen::Vector3d slope = half_g * (Eigen::Vector3d::Constant(l.sum()) - 2 * l);
  const double determinant = slope.dot(l) / 2, at = std::max(determinant, kLeastDeterminant);
  const double f1 = -1 / (at * at), f2 = determinant < kLeastDeterminant ? 0 : 2 / (at * at * at);
  const double invariant = alpha.dot(l) + 1 / at + f1 * (determinant - at) - 3;
  const double weight = 1 + 2 * b * invariant;
  const Eigen::Vector3d first = alpha + f1 * slope;
  TriangleTerms terms;
  terms.energy = rest.stiffness * (invariant + b * invariant * invariant);
  terms.tension = 2 * rest.stiffness * weight * first;
  if (coupling == TriangleCoupling::kForce) {
    return terms;
  }
  Eigen::Matrix3d second = Eigen::Matrix3d::Constant(half_g);
  second.diagonal().array() -= 2 * half_g;
  if (coupling == TriangleCoupling::kBound && determinant < kLeastDeterminant) {
    // Of f1 D_ij = -f1 half_g (2 I - 1 1^T) without the negative part.
    second = -2 * half_g * Eigen::Matrix3d::Identity();
  }
  terms.coupling = 4 * rest.stiffness *
                   (weight * (f2 * slope * slope.transpose() + f1 * second) + 2 * b * first * first.transpose());
  return terms;
}

}  // namespace fulcrum::physics
