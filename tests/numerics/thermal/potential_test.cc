#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <random>

#include "tests/numerics/thermal/electrode_current.h"
#include "tests/numerics/thermal/potential_rings.h"

namespace fulcrum::thermal {
namespace {

TEST(PotentialTest, CurrentBetweenCirclesIsTheLogarithms) {
  const RingsResult result = SolveRings(6.3, 29.2, 1e-6f);
  EXPECT_LT(result.current_error, 2e-3);
  EXPECT_LT(result.heat_error, 0.02);
}

TEST(PotentialTest, HeatOfTheSheetDoesNotDependOnTheWindow) {
  // The window is 64 cells wide: 12.8, 6.4 and 3.2 mm.
  std::array<EnergyShares, 3> shares;
  for (std::size_t n = 0; n < shares.size(); ++n) {
    ThermalParams params;
    params.cell_m = std::array{2e-4f, 1e-4f, 5e-5f}[n];
    shares[n] = SharesOfEnergy(MakeMaterial(params));
    EXPECT_LT(std::abs(shares[n].unaccounted), 0.005);
  }
  const EnergyShares tented = SharesOfEnergy(MakeMaterial(ThermalParams{}), true);
  EXPECT_LT(std::abs(tented.unaccounted), 0.005);
  EXPECT_EQ(tented.beneath, 0.0);
  EXPECT_GT(tented.beyond, 0.1);
  EXPECT_LT(shares[0].beyond, 0.1);
  EXPECT_GT(shares[2].beyond, 0.1);
  EXPECT_NEAR(shares[1].sheet, shares[0].sheet, 0.02);
  EXPECT_NEAR(shares[2].sheet, shares[0].sheet, 0.02);
}

TEST(PotentialTest, CurrentIsThatInThreeDimensions) {
  // Fat, and fat with as much fluid as makes it conduct three times as well; two radii of hooks.
  for (const float sigma_fat : {0.02f, 0.035f, 0.1f}) {
    for (const double radius : {5e-4, 1e-3}) {
      ThermalParams params;
      params.sigma_fat_S_m = sigma_fat;
      const Material material = MakeMaterial(params);
      const DiscInDepth depth = SolveDiscInDepth(material, radius, 8e-6);
      const double drawn =
          WindowConductance(material, {.length_m = 0, .radius_m = radius, .arc_m = 1e-9}, 0, {0.3f, 0.2f});
      EXPECT_NEAR(drawn / depth.conductance_S, 1, 0.035) << sigma_fat << " S/m, " << radius << " m";
    }
  }
  const Material material = MakeMaterial(ThermalParams{});
  EXPECT_NEAR(SharesOfEnergy(material).sheet, SolveDiscInDepth(material, 5e-4, 8e-6).sheet_share, 0.02);
}

TEST(PotentialTest, WorkingToleranceKeepsCurrentAndHeat) {
  const RingsResult result = SolveRings(6.3, 29.2, kWorkingTolerance);
  EXPECT_LT(result.current_error, 0.01);
  EXPECT_LT(result.heat_error, 0.02);
}

std::unique_ptr<PotentialProblem> Random(unsigned seed, float holes) {
  auto problem = std::make_unique<PotentialProblem>();
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> uniform(0, 1);
  problem->face_s = problem->face_t = 3e-4f;
  for (int k = 0; k < kWindowCells; ++k) {
    const bool hole = uniform(random) < holes;
    problem->sigma[k] = hole ? 0.0f : 0.35f * (uniform(random) < 0.3f ? 0.01f : 1.0f + uniform(random));
    problem->ground[k] = hole ? 0.0f : 7e-8f;
    const int i = k % kWindow - 32, j = k / kWindow - 32;
    if (i * i + j * j < 30) problem->contact[k] = 2 * problem->sigma[k] * 1e-8f / 3e-4f;
  }
  return problem;
}

TEST(PotentialTest, StaysBetweenGroundAndElectrodeWithHolesAndJumps) {
  // Islands of tissue without a connection to either electrode converge last: their energy is zero.
  constexpr float kSlack = 0.01f;
  for (const float holes : {0.0f, 0.2f, 0.45f}) {
    const auto problem = Random(3, holes);
    PotentialSolver solver;
    const PotentialResult result = solver.Solve(*problem, 1e-5f);
    EXPECT_LE(result.imbalance, kImbalanceLimit);
    EXPECT_GT(result.conductance_S, 0.0f);
    for (int k = 0; k < kWindowCells; ++k) {
      EXPECT_GE(solver.heat()[k], 0.0f);
      if (problem->sigma[k] == 0.0f) {
        EXPECT_EQ(solver.heat()[k], 0.0f);
        continue;
      }
      EXPECT_GE(solver.Voltage(k % kWindow, k / kWindow), -kSlack);
      EXPECT_LE(solver.Voltage(k % kWindow, k / kWindow), 1.0f + kSlack);
    }
  }
}

TEST(PotentialTest, IslandsThatFloatStayWhereTheyAre) {
  // A tented sheet with a hole that contains isolated pieces of tissue: single cells, and squares and bars that are
  // single cells of a coarser level. They start from their value before they were cut off.
  auto problem = Random(7, 0.0f);
  for (int k = 0; k < kWindowCells; ++k) {
    const int i = k % kWindow, j = k / kWindow;
    problem->ground[k] = i == 0 || j == 0 || i == kWindow - 1 || j == kWindow - 1 ? 1e-4f : 0.0f;
    const bool in_hole = i >= 44 && i < 60 && j >= 20 && j < 44;
    const bool island = i % 8 >= 4 && (j % 8 >= 4 || (j == 25 && i % 8 < 6));
    if (in_hole && !island) problem->sigma[k] = 0;
  }
  std::array<float, kWindowCells> start;
  for (int k = 0; k < kWindowCells; ++k) start[k] = 0.3f + 1e-3f * static_cast<float>(k % 37);
  PotentialSolver solver;
  solver.ImportStart(start);
  for (int n = 0; n < 200; ++n) {
    for (float& c : problem->contact) c *= n % 2 == 0 ? 1.03f : 1 / 1.03f;
    const PotentialResult result = solver.Solve(*problem, 1e-2f);
    ASSERT_GT(result.conductance_S, 0.0f) << n;
    ASSERT_LE(result.imbalance, kImbalanceLimit) << n;
  }
  for (int k = 0; k < kWindowCells; ++k) {
    if (problem->sigma[k] == 0.0f) continue;
    EXPECT_GE(solver.Voltage(k % kWindow, k / kWindow), -0.1f) << k;
    EXPECT_LE(solver.Voltage(k % kWindow, k / kWindow), 1.1f) << k;
  }
}

TEST(PotentialTest, PowerInIsHeatPlusGround) {
  for (const float tolerance : {1e-1f, 1e-2f, 1e-4f}) {
    const auto problem = Random(5, 0.3f);
    PotentialSolver solver;
    const PotentialResult result = solver.Solve(*problem, tolerance);
    EXPECT_LE(result.imbalance, kImbalanceLimit);
    double heat = 0;
    for (const float q : solver.heat()) heat += q;
    EXPECT_NEAR(heat, result.heat_S, 1e-4 * heat);
    EXPECT_LE(result.heat_S, result.conductance_S);
  }
}

TEST(PotentialTest, WarmStartIsCheaperAndSameAsCold) {
  const auto problem = Random(9, 0.1f);
  PotentialSolver solver;
  const PotentialResult cold = solver.Solve(*problem, 1e-4f);
  for (float& c : problem->contact) c *= 1.02f;
  const PotentialResult warm = solver.Solve(*problem, 1e-4f);
  EXPECT_LT(warm.iterations, cold.iterations);
  PotentialSolver fresh;
  EXPECT_NEAR(warm.conductance_S, fresh.Solve(*problem, 1e-4f).conductance_S, 1e-3f * warm.conductance_S);
}

TEST(PotentialTest, NoContactOrBadNumbersDeliverNothing) {
  auto problem = Random(1, 0.0f);
  PotentialSolver solver;
  problem->sigma[100] = NAN;
  EXPECT_EQ(solver.Solve(*problem, 1e-2f).conductance_S, 0.0f);
  problem = Random(1, 0.0f);
  EXPECT_GT(solver.Solve(*problem, 1e-2f).conductance_S, 0.0f);  // the next solve is valid again
  problem->contact.fill(0);
  EXPECT_EQ(solver.Solve(*problem, 1e-2f).conductance_S, 0.0f);
}

Material WithCells(float cell_m) {
  ThermalParams params;
  params.cell_m = cell_m;
  // The methods of electrode_current.h have one leak everywhere.
  Material material = MakeMaterial(params);
  material.spreading = 0;
  return material;
}

/// Largest error of the window's current, over headings and offsets of the capsule from the cells' corners.
double LargestError(float cell_m, const CapsuleOnSheet& capsule, double exact) {
  const Material material = WithCells(cell_m);
  double largest = 0;
  for (const float heading : {0.0f, 0.4f, 0.785f, 1.2f}) {
    for (const Vec2f& from_node : {Vec2f(0, 0), Vec2f(0.5f, 0.5f), Vec2f(0.5f, 0), Vec2f(0.2f, 0.3f)}) {
      largest = std::max(largest, std::abs(WindowConductance(material, capsule, heading, from_node) / exact - 1));
    }
  }
  return largest;
}

TEST(ElectrodeCurrentTest, ReferenceFindsTheDiscsBesselFunctions) {
  const Material material = WithCells(1e-4f);
  const CapsuleOnSheet disc{.arc_m = 1e-9};
  EXPECT_NEAR(ReferenceConductance(material, disc, 2e-5) / DiscConductance(material, disc.radius_m), 1, 3e-4);
}

TEST(ElectrodeCurrentTest, DrawnFromTheWindowIsThatFromThePlane) {
  const auto errors = [](const CapsuleOnSheet& capsule, double exact) {
    const double coarse = LargestError(2e-4f, capsule, exact), fine = LargestError(5e-5f, capsule, exact);
    const double working = LargestError(1e-4f, capsule, exact);
    EXPECT_LT(coarse, 0.02);
    EXPECT_LT(working, 0.006);
    EXPECT_LT(fine, 0.002);
    EXPECT_LT(working, 0.5 * coarse);
    EXPECT_LT(fine, 0.6 * working);
  };
  const CapsuleOnSheet disc{.arc_m = 1e-9};
  errors(disc, DiscConductance(WithCells(1e-4f), disc.radius_m));
  for (const double length : {0.0, 1e-3}) {
    const CapsuleOnSheet capsule{.length_m = length};
    errors(capsule, ReferenceConductance(WithCells(1e-4f), capsule, 2e-5));
  }
}

TEST(ElectrodeCurrentTest, LongCapsuleInTheWorkingWindow) {
  const CapsuleOnSheet capsule{.length_m = 3e-3};
  EXPECT_LT(LargestError(1e-4f, capsule, ReferenceConductance(WithCells(1e-4f), capsule, 2e-5)), 0.003);
}

}  // namespace
}  // namespace fulcrum::thermal
