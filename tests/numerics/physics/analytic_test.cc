// The discretisation against theory, on meshes small enough for the default run.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/numerics/physics/analytic_cases.h"
#include "tests/numerics/physics/sheet_cases.h"

namespace fulcrum::physics {
namespace {

double Order(double coarse, double fine) { return std::log2(std::abs(coarse / fine)); }

TEST(Analytic, ABarStretchesAndNarrowsUnderItsWeight) {
  const BarErrors coarse = HangingBar(2, 0.45), fine = HangingBar(4, 0.45);
  EXPECT_LT(fine.stretch, 0.005);
  EXPECT_LT(fine.contraction, 0.02);
  EXPECT_GT(Order(coarse.stretch, fine.stretch), 1.5);
  EXPECT_GT(Order(coarse.contraction, fine.contraction), 1);
}

TEST(Analytic, ASheetHangs) {
  const double coarse = HangingSheet(8), fine = HangingSheet(16);
  EXPECT_LT(fine, 0.001);
  EXPECT_GT(Order(coarse, fine), 1.5);
}

TEST(Analytic, ASheetIsTheSameInEveryDirection) {
  const DirectionalModuli moduli = MeasureModuli(MembraneModel::kContinuum);
  EXPECT_LT(moduli.modulus_spread, 1e-4);
  EXPECT_LT(moduli.poisson_error, 1e-4);
  // What the grid of springs does instead.
  EXPECT_GT(MeasureModuli(MembraneModel::kSprings).modulus_spread, 0.5);
}

TEST(Analytic, ADraggedSheetResistsAlikeInEveryDirection) {
  const Drag drag = DragDisc(MembraneModel::kContinuum, 16);
  EXPECT_LT(drag.anisotropy, 0.03);
  EXPECT_LT(drag.side, 0.02);
}

TEST(Analytic, ALiftedSheetHasTheAxisymmetricShape) {
  const Lift coarse = LiftDisc(MembraneModel::kContinuum, 16), fine = LiftDisc(MembraneModel::kContinuum, 32);
  EXPECT_LT(coarse.shape_error, 0.01);
  EXPECT_LT(std::abs(coarse.force_error), 0.01);
  EXPECT_LT(coarse.asymmetry, 0.01);
  EXPECT_GT(Order(coarse.shape_error, fine.shape_error), 1.5);
}

TEST(Analytic, ADiscUnderPressureIsHenckys) {
  const double coarse = HenckyDisc(MembraneModel::kContinuum, 16), fine = HenckyDisc(MembraneModel::kContinuum, 32);
  EXPECT_LT(std::abs(coarse), 0.01);
  EXPECT_GT(Order(coarse, fine), 1.5);
}

TEST(Analytic, ATubeWidensUnderPressure) {
  for (const double poisson : {0.0, 0.3, 0.45, 0.49}) {
    EXPECT_LT(std::abs(LameTube(1, poisson)), 0.03) << poisson;
  }
  EXPECT_LT(std::abs(LameTube(2, 0.45)), std::abs(LameTube(1, 0.45)));
}

TEST(Analytic, ACantileverBendsWithoutLocking) {
  for (const double poisson : {0.0, 0.3, 0.45, 0.49}) {
    EXPECT_LT(std::abs(Cantilever(4, poisson)), 0.05) << poisson;
  }
  EXPECT_LT(std::abs(PureBending(4, 0.45)), 0.05);
  EXPECT_LT(std::abs(PureBending(4, 0.45)), std::abs(PureBending(2, 0.45)));
}

}  // namespace
}  // namespace fulcrum::physics
