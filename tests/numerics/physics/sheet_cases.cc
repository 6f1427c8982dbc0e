#include "tests/numerics/physics/sheet_cases.h"

#include <Eigen/Dense>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <stdexcept>
#include <vector>

#include "physics_node/energy/elastic_model.h"
#include "services/scene/format/scene_file.h"
#include "tests/numerics/physics/reference/static_solver.h"

namespace fulcrum::physics {
namespace {

using reference::ElasticEnergy;
using reference::Points;

constexpr double kEt = 150, kRadius_m = 0.02, kPlate_m = kRadius_m / 4;
constexpr double kSheetTolerance_N = 1e-9;
/// Nodes within so much of a cell of a circle belong to it.
constexpr double kSnap = 0.45;

/// A sheet of nodes at `place(row, column)`, in double: rounding of the scene's floats would show.
ElasticModel MakeSheet(MembraneModel kind, Index size, const std::function<Vec3d(Index, Index)>& place) {
  scene::SceneData data;
  data.fixed.membrane.rows = size;
  data.fixed.membrane.cols = size;
  data.fixed.physics.membrane_model = kind;
  data.fixed.physics.membrane_Et_N_per_m = static_cast<float>(kEt);
  data.fixed.physics.membrane_stiffening = 0;
  const auto length = [&](Index r, Index c, Index down, Index right) {
    return r + down < size && c + right < size ? (place(r + down, c + right) - place(r, c)).norm() : 0.0;
  };
  std::vector<double> lengths;
  for (Index r = 0; r < size; ++r) {
    for (Index c = 0; c < size; ++c) {
      data.rest_position.push_back(place(r, c).cast<float>());
      data.inverse_mass.push_back(1.0f);
      for (const double l : {length(r, c, 0, 1), length(r, c, 1, 0), length(r, c, 1, 1)}) {
        lengths.push_back(l);
        data.membrane_rest_length.push_back(static_cast<float>(l));
      }
    }
  }
  ElasticModel model = BuildElasticModel(data.View());
  model.load.clear();
  for (Index p = 0; p < size * size; ++p) {
    model.rest_position[p] = place(p / size, p % size);
  }
  for (std::size_t i = 0; i < model.springs.size(); ++i) {
    model.springs[i].rest_length = lengths[i];
  }
  for (ElasticTriangle& triangle : model.triangles) {
    triangle.rest =
        RestOfTriangle({lengths[triangle.edges[0]], lengths[triangle.edges[1]], lengths[triangle.edges[2]]}, kEt);
  }
  return model;
}

struct Disc {
  ElasticModel model;
  std::vector<Index> rim, plate, free;
  Index size = 0;
};
/// Grid of 2 n + 1 nodes a side. Nodes beyond the rim stand on it, the plate's outermost ones on its rim; free nodes
/// keep their places, so every triangle with a free node is well shaped.
Disc MakeDisc(MembraneModel kind, int n, double plate_m) {
  const double h = kRadius_m / n;
  const int margin = n + 1, size = 2 * margin + 1;
  const auto flat = [&](int r, int c) { return Vec3d((c - margin) * h, (r - margin) * h, 0); };
  const auto radius = [&](int r, int c) { return flat(r, c).norm(); };
  const auto is_plate = [&](int r, int c) { return plate_m > 0 && radius(r, c) <= plate_m + kSnap * h; };
  const auto touches_free = [&](int r, int c) {
    for (const auto& [dr, dc] : {std::pair(0, 1), {1, 0}, {1, 1}, {0, -1}, {-1, 0}, {-1, -1}}) {
      if (!is_plate(r + dr, c + dc)) {
        return true;
      }
    }
    return false;
  };
  const auto is_rim = [&](int r, int c) { return radius(r, c) >= kRadius_m - kSnap * h; };
  Disc disc;
  disc.size = static_cast<Index>(size);
  disc.model = MakeSheet(kind, disc.size, [&](Index row, Index column) -> Vec3d {
    const int r = static_cast<int>(row), c = static_cast<int>(column);
    const Vec3d at = flat(r, c);
    if (is_rim(r, c)) {
      return at * (kRadius_m / at.norm());
    }
    return is_plate(r, c) && at.norm() > 0 && touches_free(r, c) ? Vec3d(at * (plate_m / at.norm())) : at;
  });
  for (int r = 0; r < size; ++r) {
    for (int c = 0; c < size; ++c) {
      (is_rim(r, c) ? disc.rim : is_plate(r, c) ? disc.plate : disc.free).push_back(static_cast<Index>(r * size + c));
    }
  }
  return disc;
}

/// The disc with its plate moved.
struct Moved {
  Points x;
  Vec3d force = Vec3d::Zero();  ///< On the plate's mover [N].
};
Moved Move(const Disc& disc, const Vec3d& by, bool in_plane) {
  const ElasticEnergy energy(disc.model);
  const Points rest = reference::RestPoints(disc.model);
  std::vector<bool> held(3 * disc.model.mass.size(), false);
  for (const std::vector<Index>* fixed : {&disc.rim, &disc.plate}) {
    for (const Index p : *fixed) {
      std::fill_n(held.begin() + 3 * static_cast<std::ptrdiff_t>(p), 3, true);
    }
  }
  for (std::size_t p = 0; p < disc.model.mass.size() && in_plane; ++p) {
    held[3 * p + 2] = true;
  }
  Points x = rest;
  constexpr int kParts = 4;
  for (int part = 1; part <= kParts; ++part) {
    const double share = static_cast<double>(part) / kParts;
    // Free nodes follow by their distance, so that Newton's method begins near the solution.
    for (const Index p : disc.free) {
      const double r = rest.col(p).norm(), weight = std::log(kRadius_m / r) / std::log(kRadius_m / kPlate_m);
      x.col(p) += by * std::clamp(weight, 0.0, 1.0) / kParts;
    }
    for (const Index p : disc.plate) {
      x.col(p) = rest.col(p) + share * by;
    }
    x = SolveStatic(energy, x, held, {}, kSheetTolerance_N).x;
  }
  Moved moved{x};
  Points gradient;
  energy.Gradient(x, &gradient);
  for (const Index p : disc.plate) {
    moved.force += gradient.col(p);
  }
  return moved;
}

/// The lifted annulus in one dimension: radius and height of circles of the sheet, whose energy per area is the law of
/// the triangles at the stretches l1 = |d(r, z)/ds| and l2 = r / s (s: radius without stress). Newton's method on a
/// chain of elements.
struct Annulus {
  static constexpr int kElements = 2000;
  std::vector<double> s;
  Eigen::VectorXd place;  ///< r, z of each circle.
  double force = 0;       ///< [N]

  explicit Annulus(double lift) {
    for (int i = 0; i <= kElements; ++i) {
      s.push_back(kPlate_m + (kRadius_m - kPlate_m) * i / kElements);
    }
    place.resize(2 * (kElements + 1));
    for (int i = 0; i <= kElements; ++i) {
      place[2 * i] = s[static_cast<std::size_t>(i)];
      place[2 * i + 1] = lift * std::log(kRadius_m / s[static_cast<std::size_t>(i)]) / std::log(kRadius_m / kPlate_m);
    }
    for (int iteration = 0; iteration < 60; ++iteration) {
      if (Step() < 1e-12) {
        return;
      }
    }
    throw std::runtime_error("the axisymmetric solution does not converge");
  }

  /// r, z at a radius without stress.
  [[nodiscard]] Eigen::Vector2d At(double radius) const {
    const double t = std::clamp((radius - kPlate_m) / (kRadius_m - kPlate_m), 0.0, 1.0) * kElements;
    const int i = std::min(static_cast<int>(t), kElements - 1);
    return place.segment<2>(2 * i) * (i + 1 - t) + place.segment<2>(2 * i + 2) * (t - i);
  }

 private:
  /// Energy of an element at r0, z0, r1, z1.
  static double Energy(double s0, double s1, const Eigen::Vector4d& q) {
    const double l1_sq = (q.tail<2>() - q.head<2>()).squaredNorm() / ((s1 - s0) * (s1 - s0));
    const double l2 = (q[0] + q[2]) / (s0 + s1), l2_sq = l2 * l2;
    return std::numbers::pi * (s1 * s1 - s0 * s0) * kEt / 6 * (l1_sq + l2_sq + 1 / (l1_sq * l2_sq) - 3);
  }
  /// One Newton step; returns the largest change [m].
  double Step() {
    std::vector<Eigen::Triplet<double>> entries;
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(place.size());
    for (int i = 0; i < kElements; ++i) {
      const double s0 = s[static_cast<std::size_t>(i)], s1 = s[static_cast<std::size_t>(i) + 1];
      Eigen::Vector4d q = place.segment<4>(2 * i);
      // E = c (L + M + 1 / (L M) - 3), L = l1^2 and M = l2^2 with their derivatives by q.
      const double c = std::numbers::pi * (s1 * s1 - s0 * s0) * kEt / 6, w = 1 / ((s1 - s0) * (s1 - s0)),
                   m = 1 / ((s0 + s1) * (s0 + s1));
      Eigen::Vector4d span(q[0] - q[2], q[1] - q[3], q[2] - q[0], q[3] - q[1]), ring(q[0] + q[2], 0, q[0] + q[2], 0);
      const double L = w * span.head<2>().squaredNorm(), M = m * ring[0] * ring[0];
      const Eigen::Vector4d dL = 2 * w * span, dM = 2 * m * ring;
      Eigen::Matrix4d ddL = Eigen::Matrix4d::Identity(), ddM = Eigen::Matrix4d::Zero();
      ddL(0, 2) = ddL(2, 0) = ddL(1, 3) = ddL(3, 1) = -1;
      ddL *= 2 * w;
      ddM(0, 0) = ddM(0, 2) = ddM(2, 0) = ddM(2, 2) = 2 * m;
      const double eL = 1 - 1 / (L * L * M), eM = 1 - 1 / (L * M * M);
      const Eigen::Vector4d g = c * (eL * dL + eM * dM);
      const Eigen::Matrix4d H = c * (eL * ddL + eM * ddM + 2 / (L * L * L * M) * dL * dL.transpose() +
                                     2 / (L * M * M * M) * dM * dM.transpose() +
                                     1 / (L * L * M * M) * (dL * dM.transpose() + dM * dL.transpose()));
      gradient.segment<4>(2 * i) += g;
      for (int a = 0; a < 4; ++a) {
        for (int b = 0; b < 4; ++b) {
          entries.emplace_back(2 * i + a, 2 * i + b, H(a, b));
        }
      }
    }
    const Eigen::Index free = place.size() - 4;
    Eigen::SparseMatrix<double> H(place.size(), place.size());
    H.setFromTriplets(entries.begin(), entries.end());
    const Eigen::SparseMatrix<double> inner = H.block(2, 2, free, free);
    Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor(inner);
    const Eigen::VectorXd step = factor.solve(-gradient.segment(2, free));
    const double largest = step.cwiseAbs().maxCoeff(), part = std::min(1.0, 2e-3 / largest);
    place.segment(2, free) += part * step;
    force = gradient[1];
    return largest;
  }
};

}  // namespace

DirectionalModuli MeasureModuli(MembraneModel kind) {
  constexpr Index kSize = 5;
  constexpr double kCell = 0.001, kStrain = 1e-5, kSide = kCell * (kSize - 1);
  const ElasticModel model = MakeSheet(kind, kSize, [](Index r, Index c) { return Vec3d(kCell * c, kCell * r, 0); });
  const ElasticEnergy energy(model);
  const Points rest = reference::RestPoints(model);
  // Second derivatives of the energy by the strains xx, yy, 2 xy.
  const auto at = [&](const Eigen::Vector3d& strain) {
    Mat3d F = Mat3d::Identity();
    F(0, 0) += strain[0];
    F(1, 1) += strain[1];
    F(0, 1) = F(1, 0) = strain[2] / 2;
    return energy.Energy(F * rest) / (kSide * kSide);
  };
  Eigen::Matrix3d stiffness;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      const Eigen::Vector3d a = kStrain * Eigen::Vector3d::Unit(i), b = kStrain * Eigen::Vector3d::Unit(j);
      stiffness(i, j) = (at(a + b) - at(a - b) - at(b - a) + at(-a - b)) / (4 * kStrain * kStrain);
    }
  }
  const Eigen::Matrix3d compliance = stiffness.inverse();
  DirectionalModuli moduli;
  for (int degree = 0; degree < 180; ++degree) {
    const double t = degree * std::numbers::pi / 180, c = std::cos(t), s = std::sin(t);
    const Eigen::Vector3d along(c * c, s * s, c * s), across(s * s, c * c, -c * s);
    const double soft = along.dot(compliance * along);
    moduli.modulus_spread = std::max(moduli.modulus_spread, std::abs(1 / (soft * kEt) - 1));
    moduli.poisson_error = std::max(moduli.poisson_error, std::abs(-across.dot(compliance * along) / soft - 0.5));
  }
  return moduli;
}

double HenckyDisc(MembraneModel kind, int n) {
  constexpr double kPressure_Pa = 0.003, kPoisson = 0.5;
  const Disc disc = MakeDisc(kind, n, 0);
  const Points rest = reference::RestPoints(disc.model);
  std::vector<bool> held(3 * disc.model.mass.size(), false);
  for (const Index p : disc.rim) {
    std::fill_n(held.begin() + 3 * static_cast<std::ptrdiff_t>(p), 3, true);
  }
  Points load = Points::Zero(3, rest.cols()), start = rest;
  for (Index r = 0; r + 1 < disc.size; ++r) {
    for (Index c = 0; c + 1 < disc.size; ++c) {
      const Index p = r * disc.size + c;
      for (const std::array<Index, 3>& t :
           {std::array{p, p + 1, p + disc.size + 1}, {p, p + disc.size, p + disc.size + 1}}) {
        const Vec3d area = 0.5 * (rest.col(t[1]) - rest.col(t[0])).cross(rest.col(t[2]) - rest.col(t[0]));
        for (const Index v : t) {
          load(2, v) += kPressure_Pa * area.norm() / 3;
        }
      }
    }
  }
  // Hencky (1915): N_r = N, N_t = N + r N', r (N_r + N_t)' + E t w'^2 / 2 = 0, N w' = -p r / 2, so with r in radii
  // and N in units of (p a)^(2/3) (E t)^(1/3):  N'' = -3 N'/r - 1 / (8 N^2),  N'(0) = 0,  N' + (1 - nu) N = 0 at 1.
  const auto solve = [](double centre, double* deflection) {
    constexpr int kSteps = 20000;
    double N = centre, slope = 0, w = 0;
    const double h = 1.0 / kSteps;
    const auto bend = [](double r, double tension, double d) {
      return r > 0 ? -3 * d / r - 1 / (8 * tension * tension) : -1 / (32 * tension * tension);
    };
    for (int i = 0; i < kSteps; ++i) {
      const double r = i * h;
      w += h * (r + h / 2) / (2 * (N + slope * h / 2));
      const double k1 = bend(r, N, slope), n2 = N + slope * h / 2, d2 = slope + k1 * h / 2;
      const double k2 = bend(r + h / 2, n2, d2);
      N += h * d2;
      slope += h * k2;
    }
    *deflection = w;
    return slope + (1 - kPoisson) * N;
  };
  double low = 0.1, high = 2, w = 0;
  for (int i = 0; i < 60; ++i) {
    const double middle = (low + high) / 2;
    (solve(middle, &w) > 0 ? high : low) = middle;
  }
  const double exact = w * kRadius_m * std::cbrt(kPressure_Pa * kRadius_m / kEt);
  for (const Index p : disc.free) {
    start(2, p) = exact * (1 - rest.col(p).squaredNorm() / (kRadius_m * kRadius_m));
  }
  const Points x = SolveStatic(ElasticEnergy(disc.model), start, held, load, kSheetTolerance_N).x;
  return x(2, static_cast<Eigen::Index>(disc.size) * disc.size / 2) / exact - 1;
}

Lift LiftDisc(MembraneModel kind, int n) {
  const Disc disc = MakeDisc(kind, n, kPlate_m);
  const Vec3d by(0, 0, kRadius_m / 2);
  const Moved moved = Move(disc, by, false);
  const Annulus exact(by.z());
  const Points rest = reference::RestPoints(disc.model);
  double error = 0, size = 0, mirror = 0;
  for (const Index p : disc.free) {
    const Vec3d from = rest.col(p);
    const double radius = from.norm();
    const Eigen::Vector2d at = exact.At(radius);
    error += (moved.x.col(p) - Vec3d(from.x() / radius * at[0], from.y() / radius * at[0], at[1])).squaredNorm();
    size += (moved.x.col(p) - from).squaredNorm();
    // Mirrored left to right.
    const Index other = p - p % disc.size + (disc.size - 1 - p % disc.size);
    const Vec3d image = moved.x.col(other);
    mirror += (moved.x.col(p) - Vec3d(-image.x(), image.y(), image.z())).squaredNorm();
  }
  return {std::sqrt(error / size), moved.force.z() / exact.force - 1, std::sqrt(mirror / size)};
}

Drag DragDisc(MembraneModel kind, int n) {
  const Disc disc = MakeDisc(kind, n, kPlate_m);
  std::vector<double> along;
  Drag drag;
  for (int i = 0; i < 8; ++i) {
    const double angle = i * std::numbers::pi / 8;
    const Vec3d direction(std::cos(angle), std::sin(angle), 0);
    const Vec3d force = Move(disc, 0.15 * kRadius_m * direction, true).force;
    along.push_back(force.dot(direction));
    drag.side = std::max(drag.side, (force - along.back() * direction).norm() / along.back());
  }
  double mean = 0;
  for (const double force : along) {
    mean += force / static_cast<double>(along.size());
  }
  for (const double force : along) {
    drag.anisotropy = std::max(drag.anisotropy, std::abs(force / mean - 1));
  }
  return drag;
}

}  // namespace fulcrum::physics
