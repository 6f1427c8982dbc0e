// The law of the membrane's triangles: against Yeoh's solid in closed form, by finite differences, and where triangles
// are crushed.
#include "physics_node/energy/triangle_energy.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <random>

namespace fulcrum::physics {
namespace {

using Squares = std::array<double, 3>;
using Mat2 = Eigen::Matrix2d;
using Vec2 = Eigen::Vector2d;

constexpr double kEt = 150, kSide = 0.002;

/// A right triangle of the grid and an oblique one: the three corners in the order of the edges 0 (a b), 1 (b c),
/// 2 (a c).
constexpr double kCorners[2][3][2] = {{{0, 0}, {kSide, 0}, {kSide, kSide}},
                                      {{0, 0}, {kSide, 0.0004}, {0.0013, 0.0017}}};

Squares EdgesOf(const double corners[3][2], const Mat2& F) {
  const auto at = [&](int i) { return Vec2(F * Vec2(corners[i][0], corners[i][1])); };
  return {(at(1) - at(0)).squaredNorm(), (at(2) - at(1)).squaredNorm(), (at(2) - at(0)).squaredNorm()};
}
TriangleRest RestOf(const double corners[3][2]) {
  Squares l = EdgesOf(corners, Mat2::Identity());
  for (double& value : l) value = std::sqrt(value);
  return RestOfTriangle(l, kEt);
}
double AreaOf(const double c[3][2]) {
  return 0.5 * std::abs((c[1][0] - c[0][0]) * (c[2][1] - c[0][1]) - (c[2][0] - c[0][0]) * (c[1][1] - c[0][1]));
}

/// Yeoh's solid, incompressible, thickness stretch 1 / (l1 l2): E t / 6 (I + c/6 I^2) per area.
double YeohEnergy(double l1, double l2, double c) {
  const double invariant = l1 * l1 + l2 * l2 + 1 / (l1 * l1 * l2 * l2) - 3;
  return kEt / 6 * (invariant + c / 6 * invariant * invariant);
}

TEST(TriangleEnergy, IsYeohsSolidInEveryDirection) {
  for (const auto& corners : kCorners) {
    const TriangleRest rest = RestOf(corners);
    for (const double c : {0.0, 2.0}) {
      for (double angle = 0; angle < 3.1; angle += 0.3) {
        for (const auto& [l1, l2] : {std::pair(1.5, 0.9), std::pair(2.5, 1.1), std::pair(1.01, 1.0)}) {
          const Mat2 turn = Eigen::Rotation2Dd(angle).toRotationMatrix();
          const Mat2 F = turn * Vec2(l1, l2).asDiagonal() * turn.transpose();
          EXPECT_NEAR(
              EvaluateTriangle(rest, c / 6, EdgesOf(corners, F), TriangleCoupling::kExact).energy / AreaOf(corners),
              YeohEnergy(l1, l2, c), 1e-9 * kEt)
              << angle << ' ' << l1;
        }
      }
    }
  }
}

/// The tension of a strip whose sides are free, l2 = 1 / sqrt(l1): E t (l - 1/l^2) / 3 (1 + c/3 (l^2 + 2/l - 3)).
TEST(TriangleEnergy, AStripCarriesItsModulusAndStiffens) {
  const TriangleRest rest = RestOf(kCorners[0]);
  const auto energy = [&](double l, double c) {
    return EvaluateTriangle(rest, c / 6, EdgesOf(kCorners[0], Vec2(l, 1 / std::sqrt(l)).asDiagonal()),
                            TriangleCoupling::kExact)
               .energy /
           AreaOf(kCorners[0]);
  };
  constexpr double kStep = 1e-5;
  for (const double c : {0.0, 3.0}) {
    const auto tension = [&](double l) { return (energy(l + kStep, c) - energy(l - kStep, c)) / (2 * kStep); };
    EXPECT_NEAR(tension(1.001) / 0.001, kEt, 0.002 * kEt);
    EXPECT_NEAR(tension(1.6), kEt / 3 * (1.6 - 1 / 2.56) * (1 + c / 3 * (2.56 + 1.25 - 3)), 1e-4 * kEt);
  }
}

TEST(TriangleEnergy, DerivativesAreThoseOfTheEnergy) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> stretch(0.85, 1.6);
  for (const auto& corners : kCorners) {
    const TriangleRest rest = RestOf(corners);
    for (int i = 0; i < 50; ++i) {
      Mat2 F;
      F << stretch(random), 0.2 * stretch(random), -0.1, stretch(random);
      const Squares l = EdgesOf(corners, F);
      const TriangleTerms terms = EvaluateTriangle(rest, 0.4, l, TriangleCoupling::kExact);
      for (std::size_t e = 0; e < 3; ++e) {
        const double step = 1e-5 * l[e];
        Squares more = l, less = l;
        more[e] += step;
        less[e] -= step;
        const TriangleTerms after = EvaluateTriangle(rest, 0.4, more, TriangleCoupling::kExact),
                            before = EvaluateTriangle(rest, 0.4, less, TriangleCoupling::kExact);
        const auto k = static_cast<Eigen::Index>(e);
        EXPECT_NEAR(terms.tension[k], (after.energy - before.energy) / step, 1e-5 * kEt);
        EXPECT_LT(((after.tension - before.tension) / step - terms.coupling.col(k)).norm(),
                  1e-4 * terms.coupling.norm());
      }
      EXPECT_GT(terms.coupling.selfadjointView<Eigen::Lower>().eigenvalues().minCoeff(), 0);
    }
  }
}

/// Crushed, folded to a line or a point: finite, resisting, and a matrix for the solve that is not negative and not
/// below the true one.
TEST(TriangleEnergy, ACrushedTriangleStaysFinite) {
  const TriangleRest rest = RestOf(kCorners[0]);
  for (const Squares& l : {Squares{0, 0, 0}, Squares{4e-6, 4e-6, 0}, Squares{4e-6, 4e-6, 16e-6},
                           Squares{1e-9, 4e-6, 4e-6}, Squares{1e-6, 1e-6, 2e-6}, Squares{1, 1, 2}}) {
    const TriangleTerms plain = EvaluateTriangle(rest, 0.4, l, TriangleCoupling::kExact),
                        clamped = EvaluateTriangle(rest, 0.4, l, TriangleCoupling::kBound);
    EXPECT_TRUE(std::isfinite(plain.energy) && plain.tension.allFinite() && clamped.coupling.allFinite());
    const double scale = clamped.coupling.norm();
    EXPECT_GE(clamped.coupling.selfadjointView<Eigen::Lower>().eigenvalues().minCoeff(), -1e-9 * scale);
    EXPECT_GE((clamped.coupling - plain.coupling).selfadjointView<Eigen::Lower>().eigenvalues().minCoeff(),
              -1e-9 * scale);
    EXPECT_GE(plain.energy, 0);
  }
}

TEST(TriangleEnergy, ASliverIsNoTriangle) {
  EXPECT_GT(RestOfTriangle({1, 1, std::sqrt(2.0)}, kEt).stiffness, 0);
  EXPECT_EQ(RestOfTriangle({1, 1, 1.999}, kEt).stiffness, 0);
  EXPECT_EQ(RestOfTriangle({1, 1, 3}, kEt).stiffness, 0);
  EXPECT_EQ(RestOfTriangle({0, 0, 0}, kEt).stiffness, 0);
  EXPECT_EQ(RestOfTriangle({1, 1, NAN}, kEt).stiffness, 0);
}

}  // namespace
}  // namespace fulcrum::physics
