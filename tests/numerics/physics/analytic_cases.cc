#include "tests/numerics/physics/analytic_cases.h"

#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <vector>

#include "services/scene/format/scene_file.h"
#include "tests/numerics/physics/reference/static_solver.h"
#include "tests/numerics/physics/solid_mesh.h"

namespace fulcrum::physics {
namespace {

using reference::ElasticEnergy;
using reference::Points;

constexpr double kYoungs_Pa = kSolidYoungs_Pa;
/// Residual forces are far below the loads, which are chosen for displacements of about 1e-4 of the size.
constexpr double kTolerance_N = 1e-12;

}  // namespace

BarErrors HangingBar(int n, double poisson) {
  // A quarter of the bar, x from the lower end up; y = 0 and z = 0 are planes of symmetry.
  constexpr double kLength = 0.04, kHalf = 0.01, kWeight = 1e-3 * kYoungs_Pa / kLength;
  const SolidMesh mesh = MakeBar(n, kLength, kHalf, poisson);
  Points load = mesh.NoLoad();
  for (const ElasticTet& tet : mesh.model.tets) {
    for (const Index v : tet.v) {
      load(0, v) -= kWeight * tet.volume / 4;
    }
  }
  AddTraction(
      mesh, [](const Vec3d& p) { return p.x() > kLength * (1 - 1e-9); },
      [](const Vec3d&, const Vec3d& outward) { return Vec3d(kWeight * kLength * outward); }, &load);
  const Index top = mesh.Node(mesh.bricks[0], 0, 0);
  const Points u = Displacement(
      mesh,
      HeldWhere(mesh,
                [&](const Vec3d& p, int axis) { return axis > 0 ? p[axis] == 0 : p == mesh.model.rest_position[top]; }),
      load, kTolerance_N);
  Eigen::Array3d error = Eigen::Array3d::Zero(), size = Eigen::Array3d::Zero();
  for (Eigen::Index p = 0; p < u.cols(); ++p) {
    const Vec3d& x = mesh.model.rest_position[static_cast<std::size_t>(p)];
    const double across = poisson * (x.y() * x.y() + x.z() * x.z());
    const Eigen::Array3d exact = kWeight / kYoungs_Pa *
                                 Eigen::Array3d((x.x() * x.x() - kLength * kLength + across) / 2,
                                                -poisson * x.x() * x.y(), -poisson * x.x() * x.z());
    error += (u.col(p).array() - exact).square();
    size += exact.square();
  }
  BarErrors errors;
  errors.stretch = std::sqrt(error[0] / size[0]);
  errors.contraction = std::sqrt((error[1] + error[2]) / (size[1] + size[2]));
  return errors;
}

double HangingSheet(int n) {
  constexpr double kLength = 0.04, kWidth = 0.02, kDensity = 0.5, kEt = 3000, kGravity = 9.81;
  scene::SceneData data;
  const int rows = 2 * n + 1, cols = n + 1;
  const double h = kLength / (rows - 1), w = kWidth / (cols - 1);
  data.fixed.membrane.rows = static_cast<std::uint32_t>(rows);
  data.fixed.membrane.cols = static_cast<std::uint32_t>(cols);
  data.fixed.physics.membrane_Et_N_per_m = static_cast<float>(kEt);
  data.fixed.physics.membrane_model = MembraneModel::kSprings;
  data.fixed.physics.gravity = Vec3f(0, 0, static_cast<float>(-kGravity));
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < cols; ++c) {
      const double mass = kDensity * h * w * (r == rows - 1 ? 0.5 : 1) * (c == 0 || c == cols - 1 ? 0.5 : 1);
      data.rest_position.push_back(Vec3d(c * w, 0, -r * h).cast<float>());
      data.inverse_mass.push_back(r == 0 ? 0.0f : static_cast<float>(1 / mass));
      data.membrane_rest_length.push_back(c + 1 < cols ? static_cast<float>(w) : 0.0f);
      data.membrane_rest_length.push_back(r + 1 < rows ? static_cast<float>(h) : 0.0f);
      data.membrane_rest_length.push_back(c + 1 < cols && r + 1 < rows ? static_cast<float>(std::hypot(w, h)) : 0.0f);
    }
  }
  ElasticModel model = BuildElasticModel(data.View());
  // Strains are so small that the rounding of the scene's floats would matter, in lengths and in the load that balances
  // them.
  model.load.clear();
  for (int p = 0; p < rows * cols; ++p) {
    model.rest_position[static_cast<std::size_t>(p)] = Vec3d((p % cols) * w, 0, -(p / cols) * h);
  }
  for (ElasticSpring& s : model.springs) {
    if (s.axial > 0) {
      s.rest_length = (model.rest_position[s.b] - model.rest_position[s.a]).norm();
    }
  }
  // The sheet is held in its plane: it has no lateral tension that would do so.
  std::vector<bool> held;
  for (std::size_t p = 0; p < model.mass.size(); ++p) {
    held.insert(held.end(), {false, true, false});
  }
  const Points rest = reference::RestPoints(model);
  const Points u = SolveStatic(ElasticEnergy(model), rest, held, {}, kTolerance_N).x - rest;
  const auto drop = [&](double s) { return kDensity * kGravity * (s * kLength - s * s / 2) / kEt; };
  double error = 0, size = 0;
  for (int r = 1; r < rows; ++r) {
    for (int c = 0; c < cols; ++c) {
      const Eigen::Index here = r * cols + c;
      // At the node and half way to the node above.
      const double at = -u(2, here), between = -(u(2, here) + u(2, here - cols)) / 2;
      error += std::pow(at - drop(r * h), 2) + std::pow(between - drop((r - 0.5) * h), 2);
      size += std::pow(drop(r * h), 2) + std::pow(drop((r - 0.5) * h), 2);
    }
  }
  return std::sqrt(error / size);
}

double LameTube(int n, double poisson) {
  constexpr double kInner = 0.015, kOuter = 0.018, kPressure = 1e-4 * kYoungs_Pa;
  constexpr int kAlong = 2;
  const int segments = 24 * n;
  const double slice = 2 * std::numbers::pi * kInner / segments;
  const SolidMesh mesh = MakeSolid({kAlong, segments, n}, true, poisson, [&](int i, int j, int k) {
    const double r = kInner + (kOuter - kInner) * k / n, angle = 2 * std::numbers::pi * j / segments;
    return Vec3d(i * slice, r * std::cos(angle), r * std::sin(angle));
  });
  Points load = mesh.NoLoad();
  AddTraction(
      mesh, [](const Vec3d& p) { return std::hypot(p.y(), p.z()) < kInner * (1 + 1e-9); },
      [](const Vec3d&, const Vec3d& outward) { return Vec3d(-kPressure * outward); }, &load);
  // Plane strain; two points prevent rigid motion across the tube.
  const Index right = mesh.Node(0, 0, 0), top = mesh.Node(0, segments / 4, 0), left = mesh.Node(0, segments / 2, 0);
  const auto& rest = mesh.model.rest_position;
  const Points u = Displacement(
      mesh,
      HeldWhere(mesh,
                [&](const Vec3d& p, int axis) {
                  const bool end = p.x() < 0.5 * slice || p.x() > (kAlong - 0.5) * slice;
                  return axis == 0 ? end : axis == 1 ? p == rest[top] : p == rest[right] || p == rest[left];
                }),
      load, kTolerance_N);
  double widening = 0;
  for (int i = 0; i <= kAlong; ++i) {
    for (int j = 0; j < segments; ++j) {
      const Vec3d place = rest[mesh.Node(i, j, 0)], moved = u.col(mesh.Node(i, j, 0));
      widening += (place.y() * moved.y() + place.z() * moved.z()) / kInner / ((kAlong + 1) * segments);
    }
  }
  const double exact = (1 + poisson) / kYoungs_Pa * kPressure * kInner * kInner / (kOuter * kOuter - kInner * kInner) *
                       ((1 - 2 * poisson) * kInner + kOuter * kOuter / kInner);
  return widening / exact - 1;
}

namespace {
constexpr double kBeamLength = 0.08, kBeamThickness = 0.01;
constexpr double kBeamInertia = kBeamThickness * kBeamThickness * kBeamThickness * kBeamThickness / 12;
bool AtEnd(const Vec3d& p) { return p.x() > kBeamLength * (1 - 1e-9); }

double MeanEndDeflection(const SolidMesh& mesh, const Points& u) {
  double sum = 0;
  int count = 0;
  for (Eigen::Index p = 0; p < u.cols(); ++p) {
    if (AtEnd(mesh.model.rest_position[static_cast<std::size_t>(p)])) {
      sum += u(2, p);
      ++count;
    }
  }
  return sum / count;
}
}  // namespace

double Cantilever(int n, double poisson) {
  constexpr double kForce = 2e-5;
  const SolidMesh mesh = MakeBar(n, kBeamLength, kBeamThickness, poisson);
  Points load = mesh.NoLoad();
  constexpr double kArea = kBeamThickness * kBeamThickness;
  AddTraction(
      mesh, AtEnd, [](const Vec3d&, const Vec3d&) { return Vec3d(kForce / kArea * Vec3d::UnitZ()); }, &load);
  const Points u =
      Displacement(mesh, HeldWhere(mesh, [](const Vec3d& p, int) { return p.x() == 0; }), load, kTolerance_N);
  const double shear = kYoungs_Pa / (2 * (1 + poisson)), shape = 10 * (1 + poisson) / (12 + 11 * poisson);
  const double exact = kForce * std::pow(kBeamLength, 3) / (3 * kYoungs_Pa * kBeamInertia) +
                       kForce * kBeamLength / (shape * shear * kArea);
  return MeanEndDeflection(mesh, u) / exact - 1;
}

double PureBending(int n, double poisson) {
  constexpr double kMoment = 1e-6;
  const SolidMesh mesh = MakeBar(n, kBeamLength, kBeamThickness, poisson);
  Points load = mesh.NoLoad();
  constexpr double kMiddle = kBeamThickness / 2;
  AddTraction(
      mesh, AtEnd,
      [](const Vec3d& p, const Vec3d&) { return Vec3d(-kMoment * (p.z() - kMiddle) / kBeamInertia, 0, 0); }, &load);
  // At the root cross-sections stay plane and change their shape freely; one edge prevents rigid motion.
  const Points u = Displacement(mesh,
                                HeldWhere(mesh,
                                          [](const Vec3d& p, int axis) {
                                            const bool root = p.x() == 0;
                                            const bool centre = root && std::abs(p.z() - kMiddle) < 1e-9 &&
                                                                std::abs(p.y() - kMiddle) < 1e-9;
                                            const bool below = root && p.z() == 0 && std::abs(p.y() - kMiddle) < 1e-9;
                                            return axis == 0 ? root : axis == 1 ? centre || below : centre;
                                          }),
                                load, kTolerance_N);
  // u_z = M / 2EI (x^2 + nu ((z - m)^2 - (y - m)^2)), so the middle of the end determines the error.
  const double exact = kMoment * kBeamLength * kBeamLength / (2 * kYoungs_Pa * kBeamInertia);
  return u(2, mesh.Node(mesh.bricks[0], n / 2, n / 2)) / exact - 1;
}

}  // namespace fulcrum::physics
