// The constraints of mode paper in scalar form, for any floating-point type: value C(x) and gradient. Reference for the
// vector kernels: tests compare the kernels with these functions, and these with finite differences.
//
// A projection moves particle i by  dx_i = -k w_i C / (sum_j w_j |grad_j C|^2) * grad_i C,  which for k = 1 solves
// the linearised constraint C(x) + grad C . dx = 0 (Mueller et al., Position Based Dynamics, 2007, eq. 4-6).
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cmath>

namespace fulcrum::physics {

template <class S>
using V3 = Eigen::Matrix<S, 3, 1>;

template <class S, int N>
struct Evaluated {
  S value;
  std::array<V3<S>, N> gradient;
};

/// C = |b - a| - rest [m].
template <class S>
Evaluated<S, 2> Stretch(const V3<S>& a, const V3<S>& b, S rest) {
  const V3<S> d = b - a;
  const S length = d.norm();
  const V3<S> n = length > S(0) ? V3<S>(d / length) : V3<S>::Zero();
  return {length - rest, {-n, n}};
}

/// C = (b-a) x (c-a) . (d-a) / 6 - rest [m^3].
template <class S>
Evaluated<S, 4> Volume(const std::array<V3<S>, 4>& x, S rest) {
  const V3<S> b = x[1] - x[0], c = x[2] - x[0], d = x[3] - x[0];
  const V3<S> gb = c.cross(d) / S(6), gc = d.cross(b) / S(6), gd = b.cross(c) / S(6);
  return {gd.dot(d) - rest, {-(gb + gc + gd), gb, gc, gd}};
}

/// Signed angle between the triangles (x0, x1, x2) and (x1, x0, x3) about x1 - x0, less `rest` and wrapped to
/// (-pi, pi] [rad]; 0 when flat.
///
/// The published correction uses C = acos(n1 . n2) - rest with q_i = d(n1 . n2)/dx_i, whose gradient -q/sin(angle) is
/// 0/0 on a flat sheet, loses the sign of the fold, and is printed with a factor 4 in one source, without it in
/// another and with mass sums of either kind. Derived from the projection formula above, the factor is
/// sqrt(1 - d^2) C / sum_j w_j |q_j|^2 with no 4. The signed angle needs neither: its gradient is smooth everywhere
/// except where a triangle has no area (Bridson et al. 2003, with the sign of this angle).
template <class S>
Evaluated<S, 4> Bending(const std::array<V3<S>, 4>& x, S rest) {
  const V3<S> e = x[1] - x[0];
  const S length = e.norm();
  const V3<S> n1 = (x[0] - x[2]).cross(x[1] - x[2]);
  const V3<S> n2 = (x[1] - x[3]).cross(x[0] - x[3]);
  const V3<S> m1 = n1 / n1.squaredNorm(), m2 = n2 / n2.squaredNorm(), hinge = e / length;
  S c = std::atan2(n1.cross(n2).dot(hinge), n1.dot(n2)) - rest;
  c = std::remainder(c, S(2 * M_PI));
  return {c,
          {m1 * (x[1] - x[2]).dot(hinge) + m2 * (x[1] - x[3]).dot(hinge),
           m1 * (x[2] - x[0]).dot(hinge) + m2 * (x[3] - x[0]).dot(hinge), -length * m1, -length * m2}};
}

/// Eq. 9: C = |m - sum_i b_i s_i| - rest [m]; gradients of m, s0, s1, s2.
template <class S>
Evaluated<S, 4> Bind(const std::array<V3<S>, 4>& x, const std::array<S, 3>& b, S rest) {
  const V3<S> d = x[0] - (b[0] * x[1] + b[1] * x[2] + b[2] * x[3]);
  const S length = d.norm();
  const V3<S> n = length > S(0) ? V3<S>(d / length) : V3<S>::Zero();
  return {length - rest, {n, -b[0] * n, -b[1] * n, -b[2] * n}};
}

/// Moves x by one projection.
template <class S, int N>
void Project(const Evaluated<S, N>& c, const std::array<S, N>& w, S k, std::array<V3<S>, N>* x) {
  S sum = 0;
  for (int i = 0; i < N; ++i) {
    sum += w[i] * c.gradient[i].squaredNorm();
  }
  if (sum > S(0)) {
    for (int i = 0; i < N; ++i) {
      (*x)[i] -= (k * c.value / sum * w[i]) * c.gradient[i];
    }
  }
}

}  // namespace fulcrum::physics
