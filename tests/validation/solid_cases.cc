#include "tests/validation/solid_cases.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "tests/numerics/physics/solid_mesh.h"

namespace fulcrum::validation {
namespace {

using physics::AddTraction;
using physics::Displacement;
using physics::HeldWhere;
using physics::MakeSolid;
using physics::SolidMesh;
using physics::reference::Points;

constexpr double kPoisson = 0.45, kDensity_kg_m3 = 1000, kTolerance_N = 1e-9, kRounding_m = 1e-9;
/// The first steps of a large load must not invert an element.
constexpr int kLoadSteps = 8;

constexpr double kInner_m = 0.015, kOuter_m = 0.018;
constexpr int kSlices = 2;

SolidMesh Tube(int n) {
  const int segments = 24 * n;
  const double slice = 2 * std::numbers::pi * kInner_m / segments;
  return MakeSolid({kSlices, segments, n}, true, kPoisson, [&](int i, int j, int k) {
    const double r = kInner_m + (kOuter_m - kInner_m) * k / n, angle = 2 * std::numbers::pi * j / segments;
    return Vec3d(i * slice, r * std::cos(angle), r * std::sin(angle));
  });
}

/// Plane strain, and the two planes of symmetry.
std::vector<bool> TubeHeld(const SolidMesh& mesh) {
  return HeldWhere(mesh, [](const Vec3d& p, int axis) { return axis == 0 || std::abs(p[axis]) < kRounding_m; });
}

constexpr double kLength_m = 0.08, kThickness_m = 0.01;

/// Half of the bar; y = 0 is its plane of symmetry.
SolidMesh HalfBar(int n) {
  const double h = kThickness_m / n;
  return MakeSolid({8 * n, n / 2, n}, false, kPoisson, [h](int i, int j, int k) { return Vec3d(i * h, j * h, k * h); });
}

std::vector<bool> BarHeld(const SolidMesh& mesh) {
  return HeldWhere(mesh, [](const Vec3d& p, int axis) { return p.x() == 0 || (axis == 1 && p.y() == 0); });
}

/// The `count` lowest natural frequencies [Hz] about rest, by subspace iteration.
std::vector<double> Frequencies(SolidMesh mesh, const std::vector<bool>& held, int count) {
  std::fill(mesh.model.mass.begin(), mesh.model.mass.end(), 0.0);
  for (const physics::ElasticTet& tet : mesh.model.tets) {
    for (const Index v : tet.v) mesh.model.mass[v] += kDensity_kg_m3 * tet.volume / 4;
  }
  const auto stiffness = physics::reference::ElasticEnergy(mesh.model).Hessian(mesh.Rest(), false);
  std::vector<Eigen::Index> place(held.size(), -1);
  Eigen::Index size = 0;
  for (std::size_t i = 0; i < held.size(); ++i) {
    if (!held[i]) place[i] = size++;
  }
  std::vector<Eigen::Triplet<double>> terms;
  for (Eigen::Index column = 0; column < stiffness.outerSize(); ++column) {
    for (physics::reference::SparseMatrix::InnerIterator at(stiffness, column); at; ++at) {
      const Eigen::Index i = place[static_cast<std::size_t>(at.row())], j = place[static_cast<std::size_t>(at.col())];
      if (i >= 0 && j >= 0 && i >= j) terms.emplace_back(i, j, at.value());
    }
  }
  Eigen::SparseMatrix<double> K(size, size);
  K.setFromTriplets(terms.begin(), terms.end());
  const Eigen::SimplicialLLT<Eigen::SparseMatrix<double>, Eigen::Lower> factor(K);
  if (factor.info() != Eigen::Success) throw std::runtime_error("the stiffness is singular: something is not held");
  Eigen::VectorXd mass(size);
  for (std::size_t i = 0; i < held.size(); ++i) {
    if (place[i] >= 0) mass[place[i]] = mesh.model.mass[i / 3];
  }
  const int vectors = count + 6;
  Eigen::MatrixXd x(size, vectors);
  for (Eigen::Index i = 0; i < size; ++i) {
    for (int c = 0; c < vectors; ++c) x(i, c) = std::sin(1.0 + 0.7 * static_cast<double>(i * (c + 1)));
  }
  constexpr int kIterations = 30;
  Eigen::VectorXd squares;
  for (int i = 0; i < kIterations; ++i) {
    const Eigen::MatrixXd loads = mass.asDiagonal() * x, y = factor.solve(loads);
    const Eigen::MatrixXd reduced_K = y.transpose() * loads, reduced_M = y.transpose() * mass.asDiagonal() * y;
    const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> modes(reduced_K, reduced_M);
    x = y * modes.eigenvectors();
    squares = modes.eigenvalues();
  }
  std::vector<double> frequencies;
  for (int c = 0; c < count; ++c) frequencies.push_back(std::sqrt(squares[c]) / (2 * std::numbers::pi));
  return frequencies;
}

}  // namespace

Quantities Dent(int n) {
  constexpr double kSize_m = 0.02, kRadius_m = 0.01, kPressure_Pa = 1.4e4;
  const double h = kSize_m / n;
  const SolidMesh mesh =
      MakeSolid({n, n, n}, false, kPoisson, [h](int i, int j, int k) { return Vec3d(i * h, j * h, k * h); });
  Points load = mesh.NoLoad();
  AddTraction(
      mesh, [](const Vec3d& p) { return p.z() > kSize_m - kRounding_m; },
      [](const Vec3d& p, const Vec3d&) {
        const double far = p.head<2>().squaredNorm() / (kRadius_m * kRadius_m);
        return Vec3d(0, 0, far < 1 ? -kPressure_Pa * (1 - far) * (1 - far) : 0);
      },
      &load);
  const auto held = HeldWhere(mesh, [](const Vec3d& p, int axis) { return p.z() == 0 || (axis < 2 && p[axis] == 0); });
  const Points u = Displacement(mesh, held, load, kTolerance_N, kLoadSteps);
  return {{"dent.depth", -u(2, mesh.Node(0, 0, n))}};
}

Quantities Pinch(int n) {
  constexpr double kPressure_Pa = 350;
  const SolidMesh mesh = Tube(n);
  Points load = mesh.NoLoad();
  // The faces are flat, so the angle alone says what the traction is.
  const double least_radius_m = kOuter_m * (1 - kRounding_m);
  AddTraction(
      mesh, [&](const Vec3d& p) { return p.tail<2>().norm() > least_radius_m; },
      [](const Vec3d& p, const Vec3d&) {
        const double angle = std::atan2(std::abs(p.y()), std::abs(p.z()));
        const double share = angle < std::numbers::pi / 6 ? std::pow(std::cos(3 * angle), 2) : 0;
        return Vec3d(0, 0, -std::copysign(kPressure_Pa * share, p.z()));
      },
      &load);
  const Points u = Displacement(mesh, TubeHeld(mesh), load, kTolerance_N, kLoadSteps);
  double closure = 0, widening = 0;
  for (int i = 0; i <= kSlices; ++i) {
    closure += (u(2, mesh.Node(i, 18 * n, n)) - u(2, mesh.Node(i, 6 * n, n))) / (kSlices + 1);
    widening += (u(1, mesh.Node(i, 0, n)) - u(1, mesh.Node(i, 12 * n, n))) / (kSlices + 1);
  }
  return {{"pinch.closure", closure}, {"pinch.widening", widening}};
}

Quantities Bend(int n) {
  constexpr double kPressure_Pa = 170;
  const SolidMesh mesh = HalfBar(n);
  Points load = mesh.NoLoad();
  AddTraction(
      mesh, [](const Vec3d& p) { return p.z() > kThickness_m - kRounding_m; },
      [](const Vec3d& p, const Vec3d&) { return Vec3d(0, 0, -kPressure_Pa * std::pow(p.x() / kLength_m, 2)); }, &load);
  const Points u = Displacement(mesh, BarHeld(mesh), load, kTolerance_N, kLoadSteps);
  const auto end = static_cast<Eigen::Index>(mesh.Node(mesh.bricks[0], 0, n / 2));
  return {{"bend.sinking", -u(2, end)}, {"bend.approach", -u(0, end)}};
}

Quantities VibrateBar(int n) {
  const SolidMesh bar = HalfBar(n);
  const std::vector<double> bending = Frequencies(bar, BarHeld(bar), 2);
  return {{"vibrate.bar_1", bending[0]}, {"vibrate.bar_2", bending[1]}};
}

Quantities VibrateTube(int n) {
  const SolidMesh tube = Tube(n);
  return {{"vibrate.tube", Frequencies(tube, TubeHeld(tube), 1)[0]}};
}

}  // namespace fulcrum::validation
