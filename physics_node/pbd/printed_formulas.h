// The formulas of position-based dynamics as the paper prints them: its Table 1, eq. 1 to 9 and appendix A1 to A5, in
// scalar form. Mode paper with `as: printed` runs them; what the paper leaves open, and where a formula differs from
// the one that is right, is on the page deploy/docs/measurements/paper.
//
//   p_i  position [m]     w_i  inverse mass [1/kg], 0 = fixed     k  stiffness of Table 1; its place in the formulas is
//                                                                    not printed: every correction is multiplied by it
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "services/base/core/types.h"

namespace fulcrum::physics::printed {

// Table 1. One stiffness of stretch for organ, membrane and the links of eq. 9.
inline constexpr float kStep_s = 0.2f;
inline constexpr int kIterations = 3;
inline constexpr float kStretch = 0.3f, kVolume = 0.9f, kBending = 0.65f;

using Vec = Eigen::Vector3d;
template <int N>
using Points = std::array<Vec, N>;
template <int N>
using Weights = std::array<double, N>;

/// The correction of a constraint is 0/0 where its gradients vanish; nothing moves then.
inline void Move(const Vec& by, Vec* p) {
  if (by.allFinite()) {
    *p += by;
  }
}

/// Eq. 1: |p1 - p2| - d [m].
inline double StretchOf(const Points<2>& p, double rest) { return (p[0] - p[1]).norm() - rest; }

/// A1, A2: both ends move along the edge, each by its share of the inverse masses.
inline void ProjectStretch(const Weights<2>& w, double rest, double k, Points<2>* p) {
  const Vec d = (*p)[0] - (*p)[1];
  const double length = d.norm(), factor = k * (length - rest) / ((w[0] + w[1]) * length);
  if (std::isfinite(factor)) {
    (*p)[0] -= w[0] * factor * d;
    (*p)[1] += w[1] * factor * d;
  }
}

/// Eq. 2 without V0: ((p2 - p1) x (p3 - p1)) . (p4 - p1) / 6 [m^3].
inline double VolumeOf(const Points<4>& p) { return (p[1] - p[0]).cross(p[2] - p[0]).dot(p[3] - p[0]) / 6.0; }

/// A3, with q_i the gradient of eq. 2.
inline void ProjectVolume(const Weights<4>& w, double rest, double k, Points<4>* p) {
  const Vec b = (*p)[1] - (*p)[0], c = (*p)[2] - (*p)[0], d = (*p)[3] - (*p)[0];
  Points<4> q{Vec::Zero(), c.cross(d) / 6.0, d.cross(b) / 6.0, b.cross(c) / 6.0};
  q[0] = -(q[1] + q[2] + q[3]);
  double sum = 0;
  for (int i = 0; i < 4; ++i) {
    sum += w[i] * q[i].squaredNorm();
  }
  const double factor = -k * (VolumeOf(*p) - rest) / sum;
  for (int i = 0; i < 4; ++i) {
    Move(factor * w[i] * q[i], &(*p)[i]);
  }
}

/// A5: d = ((p2-p1) x (p3-p1)) / (|p2-p1| |p3-p1|) . ((p2-p1) x (p4-p1)) / (|p2-p1| |p4-p1|). It divides by products of
/// lengths, and so is the cosine of eq. 3 and 8 only where both angles at p1 are 90 degrees.
inline double CosineOf(const Points<4>& p) {
  const Vec e = (p[1] - p[0]).normalized(), a = (p[2] - p[0]).normalized(), b = (p[3] - p[0]).normalized();
  return e.cross(a).dot(e.cross(b));
}
/// Eq. 3 and 8 without phi0, from A5: acos(d) [rad], in [0, pi]; the two senses of a fold are not distinguished.
inline double AngleOf(const Points<4>& p) { return std::acos(std::clamp(CosineOf(p), -1.0, 1.0)); }

/// q_i of A4 [1/m], whose own formula is not in the paper: minus the gradient of d as A5 prints it. With that of eq. 3
/// and the d of A5 a flat sheet would explode, because q vanishes on it and sqrt(1 - d^2) does not.
inline Points<4> BendingDirections(const Points<4>& p) {
  const Vec e = p[1] - p[0], a = p[2] - p[0], b = p[3] - p[0];
  const Vec eu = e.normalized(), au = a.normalized(), bu = b.normalized();
  const auto across = [](const Vec& unit, const Vec& v) { return Vec(v - unit.dot(v) * unit); };
  Points<4> q;
  q[1] = across(eu, eu.dot(bu) * au + eu.dot(au) * bu) / e.norm();
  q[2] = -across(au, bu - eu.dot(bu) * eu) / a.norm();
  q[3] = -across(bu, au - eu.dot(au) * eu) / b.norm();
  q[0] = -(q[1] + q[2] + q[3]);
  return q;
}

/// A4, with the factor 4 w_i / (sum w_j) of Mueller et al. 2006 (later w_i / sum w_j |q_j|^2).
inline void ProjectBending(const Weights<4>& w, double rest_rad, double k, Points<4>* p) {
  const double d = CosineOf(*p);
  const Points<4> q = BendingDirections(*p);
  double masses = 0, squares = 0;
  for (int i = 0; i < 4; ++i) {
    masses += w[i];
    squares += q[i].squaredNorm();
  }
  const double root = std::sqrt(std::max(0.0, 1.0 - d * d));
  const double factor = -k * 4.0 * root * (AngleOf(*p) - rest_rad) / (masses * squares);
  for (int i = 0; i < 4; ++i) {
    Move(factor * w[i] * q[i], &(*p)[i]);
  }
}

/// Largest distance of a link [m]: delta of eq. 9 is infinite beyond it. Not printed; assumed.
inline constexpr double kLinkReach_m = 0.015;
/// Length that counts as much as a difference of 1 between the normals' products [m]: eq. 9 adds a length to a cosine
/// and states no unit; taken as millimetre.
inline constexpr double kLinkUnit_m = 0.001;

/// Eq. 9: cost of linking a node at p with unit normal n to a vertex at q with unit normal m.
inline double LinkCost(const Vec& p, const Vec& n, const Vec& q, const Vec& m) {
  const double distance = (p - q).norm();
  const double delta = distance > kLinkReach_m ? std::numeric_limits<double>::infinity() : 0.0;
  return distance / kLinkUnit_m - n.dot(m) + delta;
}

}  // namespace fulcrum::physics::printed
