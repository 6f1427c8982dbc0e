// Conduction against exact solutions, and its bounds.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "tests/numerics/thermal/heat_cases.h"
#include "tests/numerics/thermal/moving_gaussian.h"
#include "thermal_node/heat/heat_field.h"

namespace fulcrum::thermal {
namespace {

constexpr double kPi = std::numbers::pi;

ThermalParams Lossless() {
  ThermalParams params;
  params.h_top_W_m2K = params.h_below_W_m2K = params.h_tented_W_m2K = params.perfusion_per_s = 0;
  return params;
}

TEST(HeatTest, EigenfunctionDecaysWithSecondOrder) {
  const double coarse = ModeError(2e-4f, 4e-2f), fine = ModeError(1e-4f, 1e-2f);
  EXPECT_LT(fine, 2e-3);
  EXPECT_GE(std::log2(coarse / fine), 1.9);
}

TEST(HeatTest, VariableTissueIsSolvedWithSecondOrder) {
  const double coarse = VariableError(2e-4f, 4e-2f), fine = VariableError(1e-4f, 1e-2f);
  EXPECT_LT(fine, 2e-2);
  EXPECT_GE(std::log2(coarse / fine), 1.9);
}

TEST(HeatTest, CurvedAndShearedSurfaceIsSolvedWithSecondOrder) {
  const double coarse = SphereError(1e-4f, 1e-2f), fine = SphereError(5e-5f, 2.5e-3f);
  EXPECT_LT(fine, 5e-4);
  EXPECT_GE(std::log2(coarse / fine), 1.9);
}

TEST(HeatTest, FrontOfBoilingFollowsNeumann) {
  // Times at which the front is in different places of a cell.
  const auto largest = [](float cell_m) {
    double error = 0;
    for (const double time_s : {0.5, 0.7, 1.0, 1.3, 1.6})
      error = std::max(error, std::abs(StefanError(cell_m, time_s)));
    return error;
  };
  const double coarse = largest(2e-4f), working = largest(1e-4f), fine = largest(5e-5f);
  EXPECT_LT(coarse, 0.06);
  EXPECT_LT(working, 0.02);
  EXPECT_LT(fine, 0.01);
}

TEST(HeatTest, StepIsOfSecondOrderInTime) { EXPECT_GE(TimeOrder(), 1.9); }

TEST(HeatTest, MovingGaussianMatchesTheExactIntegral) {
  EXPECT_LT(RunMovingGaussian(1e-4f).max_error, 1e-3);    // measured 0.04 % of the peak
  EXPECT_LT(RunMovingGaussian(7.5e-5f).max_error, 1e-3);  // 0.03 %; stable in one substep, but not accurate
}

TEST(HeatTest, ResultDoesNotDependOnWhereTheTilesLie) {
  // The same blob on the same sheet, moved by a number of cells that is no multiple of the tile.
  const auto run = [](int shift) {
    HeatField field(MakeFlatSheet(12.8e-3f, 12.8e-3f, 1e-4f), MakeMaterial(Lossless()));
    const float centre = 6.4e-3f + 1e-4f * static_cast<float>(shift);
    Ledger ledger;
    Fill(&field, [&](double x, double y) {
      return 50 * std::exp(-((x - centre) * (x - centre) + (y - centre) * (y - centre)) / 2e-7);
    });
    for (int n = 0; n < 100; ++n) field.Diffuse(0.01f, &ledger);
    std::vector<float> around;
    for (int j = -30; j < 30; ++j) {
      for (int i = -30; i < 30; ++i) {
        const int ix = 64 + shift + i, iy = 64 + shift + j;
        const Tile* tile = field.Find(ix / kTile, iy / kTile);
        around.push_back(tile->theta[ThetaIndex(ix % kTile, iy % kTile)]);
      }
    }
    return around;
  };
  // Different tiles sleep, so different amounts below the waking threshold are cut off.
  constexpr float kTolerance = 0.3f * kWakeTheta;
  const std::vector<float> a = run(0), b = run(13);
  for (std::size_t k = 0; k < a.size(); ++k) EXPECT_NEAR(a[k], b[k], kTolerance);
}

TEST(HeatTest, RestMetricStretchesLengths) {
  // Cells 1.5 times as long along s on the rest shape: the mode decays as on a sheet 1.5 times as long.
  Sheet sheet = MakeFlatSheet(6.4e-3f, 6.4e-3f, 1e-4f);
  SetMetric(&sheet, [](const Vec2f&) { return SurfaceMetric{2.25f, 0, 1}; });
  const Material material = MakeMaterial(Lossless());
  HeatField field(sheet, material);
  const double length = 6.4e-3, k = kPi / length;
  Fill(&field, [&](double x, double) { return 30 + 20 * std::cos(k * x); });
  Ledger ledger;
  for (int n = 0; n < 200; ++n) field.Diffuse(0.01f, &ledger);
  const double alpha = material.k_wet / material.rc_wet;
  ForCells(field, [&](double theta, double x, double) {
    EXPECT_NEAR(theta, 30 + 20 * std::exp(-alpha * k * k / 2.25 * 2.0) * std::cos(k * x), 0.02);
  });
}

TEST(HeatTest, MaximumPrincipleHoldsWithRandomHolesAndLongSteps) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> uniform(0, 1);
  HeatField field(MakeFlatSheet(9.6e-3f, 9.6e-3f, 1e-4f), MakeMaterial(ThermalParams{}));
  Fill(&field, [&](double, double) { return uniform(random) < 0.5f ? 60.0 : 0.0; });
  Ledger ledger;
  double removed = 0;
  for (Tile* tile : field.awake()) {
    for (int k = 0; k < kTileCells; ++k) {
      tile->state.water[k] = uniform(random);  // k and rc jump from cell to cell
      if (uniform(random) < 0.45f) field.TakeOut(tile, k, kRemoved, &removed);
    }
    for (int k = 0; k < kTileCells; ++k) {
      const float cap = field.material().HeatCapacity(tile->state.water[k]) * 60;
      tile->state.enthalpy[k] = std::min(tile->state.enthalpy[k], cap);
    }
    field.RefreshTheta(tile, &ledger);
  }
  for (const float dt : {0.001f, 0.01f, 0.1f, 1.0f, 10.0f}) {
    field.Diffuse(dt, &ledger);
    for (const Tile* tile : field.awake()) {
      EXPECT_GE(tile->theta_min, 0.0f);
      EXPECT_LE(tile->theta_max, 60.001f);
      for (int k = 0; k < kTileCells; ++k) {
        if ((tile->state.flags[k] & kRemoved) != 0) {
          ASSERT_EQ(tile->state.enthalpy[k], 0.0f);
        }
      }
    }
  }
}

TEST(HeatTest, StiffStepsStayBoundedAndKeepTheHeat) {
  // A sink of a million per second, and lossless tissue that would require a million explicit substeps.
  ThermalParams params = Lossless();
  params.cell_m = 2.5e-5f;
  Material material = MakeMaterial(params);
  material.k_wet *= 1e4f;
  HeatField field(MakeFlatSheet(1.6e-3f, 2.4e-3f, 2.5e-5f), material);
  const auto theta = [](double x, double y) { return x < 8e-4 && y < 1e-3 ? 60.0 : 5.0; };
  Fill(&field, theta);
  for (Tile* tile : field.awake()) {
    for (int k = 0; k < kTileCells; ++k) {
      if (k % 3 == 0 && (tile->state.flags[k] & kNoTissue) == 0) tile->state.water[k] = 0;  // conducts 3e4 times less
    }
    tile->material_stale = true;
  }
  Fill(&field, theta);
  Ledger ledger;
  const double start = field.Stored();
  for (const float dt : {0.01f, 1.0f, 10.0f}) {
    EXPECT_EQ(field.Diffuse(dt, &ledger), kMaxSubsteps);
    EXPECT_NEAR(field.Stored(), start, 1e-5 * start);
    for (const Tile* tile : field.awake()) EXPECT_LE(tile->theta_max, 60.001f);
    ForCells(field, [](double t, double, double) { ASSERT_GE(t, 4.999); });
  }
  EXPECT_EQ(field.stiff_steps(), 3u);

  material.loss_resting = material.loss_tented = 1e6f * material.rc_wet;
  HeatField cooled(MakeFlatSheet(1.6e-3f, 2.4e-3f, 2.5e-5f), material);
  Fill(&cooled, theta);
  Ledger lost;
  const double before = cooled.Stored();
  cooled.Diffuse(0.01f, &lost);
  EXPECT_LT(cooled.Stored(), 1e-3 * before);
  EXPECT_NEAR(cooled.Stored() + lost.Out(), before, 1e-5 * before);
}

TEST(HeatTest, HeatIsConservedAcrossTilesSleepAndLosses) {
  HeatField field(MakeFlatSheet(32e-3f, 32e-3f, 1e-4f), MakeMaterial(ThermalParams{}));
  Ledger ledger;
  Tile* tile = field.Wake(5, 5);
  for (int k = 0; k < 40; ++k) tile->state.enthalpy[k] = 1e8f;
  field.RefreshTheta(tile, &ledger);
  const double start = field.Stored();
  std::size_t most = 0;
  for (int n = 0; n < 6000 && !field.idle(); ++n) {
    field.Diffuse(0.01f, &ledger);
    most = std::max(most, field.awake().size());
    ASSERT_NEAR(field.Stored() + ledger.Out(), start, 1e-5 * start);
  }
  EXPECT_TRUE(field.idle());  // all have fallen asleep again
  EXPECT_GT(most, 4u);        // and further tiles had woken
  EXPECT_LT(ledger.dropped, 0.1 * start);
}

/// A blob of `peak` kelvin around the middle of tile (tx, ty).
void AddBlob(HeatField* field, int tx, int ty, float peak) {
  Ledger ledger;
  Tile* tile = field->Wake(tx, ty);
  for (int k = 0; k < kTileCells; ++k) {
    const int i = k % kTile, j = k / kTile;
    const float x = static_cast<float>(i) - 15.5f, y = static_cast<float>(j) - 15.5f;
    tile->state.enthalpy[k] =
        peak * std::exp(-(x * x + y * y) / 25) * field->material().HeatCapacity(tile->state.water[k]);
  }
  field->RefreshTheta(tile, &ledger);
}

/// The same, of tissue in which dry and wet cells alternate: at 0.1 mm it needs more substeps than wet tissue.
void AddDryBlob(HeatField* field, int tx, int ty, float peak) {
  Tile* tile = field->Wake(tx, ty);
  for (int k = 0; k < kTileCells; k += 3) tile->state.water[k] = 0;
  tile->material_stale = true;
  AddBlob(field, tx, ty, peak);
}

TEST(HeatTest, EachIslandTakesItsOwnSubstepsAndTheSameBitsAsAlone) {
  const auto make = [] { return HeatField(MakeFlatSheet(64e-3f, 16e-3f, 1e-4f), MakeMaterial(ThermalParams{})); };
  HeatField both = make(), slow = make(), fast = make();
  AddBlob(&both, 15, 3, 50);
  AddBlob(&slow, 15, 3, 50);
  AddDryBlob(&both, 2, 1, 50);
  AddDryBlob(&fast, 2, 1, 50);
  Ledger ledger, of_slow, of_fast;
  for (int n = 0; n < 60; ++n) {
    EXPECT_EQ(slow.Diffuse(0.01f, &of_slow), 1);
    const int fastest = fast.Diffuse(0.01f, &of_fast);
    EXPECT_GT(fastest, 1);
    EXPECT_EQ(both.Diffuse(0.01f, &ledger), fastest);
    EXPECT_EQ(both.Find(15, 3)->substeps, 1);
    EXPECT_EQ(both.Find(2, 1)->substeps, fastest);
  }
  ASSERT_GT(slow.awake().size(), 1u);  // islands of several tiles
  ASSERT_GT(fast.awake().size(), 1u);
  for (const HeatField* alone : {&slow, &fast}) {
    for (const Tile* tile : alone->awake()) {
      const Tile* same = both.Find(tile->tx, tile->ty);
      ASSERT_NE(same, nullptr);
      EXPECT_EQ(same->state.enthalpy, tile->state.enthalpy);
      EXPECT_EQ(same->state.water, tile->state.water);
    }
  }
  EXPECT_NEAR(ledger.Out(), of_slow.Out() + of_fast.Out(), 1e-9 * ledger.Out());
}

TEST(HeatTest, IslandsThatMeetBecomeOneAndKeepTheHeat) {
  HeatField field(MakeFlatSheet(32e-3f, 9.6e-3f, 1e-4f), MakeMaterial(Lossless()));
  Ledger ledger;
  AddDryBlob(&field, 2, 1, 55);
  AddBlob(&field, 6, 1, 55);
  const double start = field.Stored();
  bool apart = false, together = false;
  for (int n = 0; n < 3000 && !together; ++n) {
    const int most = field.Diffuse(0.01f, &ledger);
    ASSERT_NEAR(field.Stored() + ledger.Out(), start, 1e-6 * start);
    const int of_dry = field.Find(2, 1)->substeps, of_wet = field.Find(6, 1)->substeps;
    ASSERT_EQ(of_dry, most);
    const bool bridged = field.Find(4, 1) != nullptr && field.Find(4, 1)->state.awake != 0;
    apart = apart || (of_dry > 1 && of_wet == 1);
    together = bridged && of_wet == of_dry;
  }
  EXPECT_TRUE(apart);
  EXPECT_TRUE(together);
}

TEST(HeatTest, TilesThatTouchAtACornerOnlyAreTwoIslands) {
  // On a sheared map, whose cells have links across corners: no link leads past two sleeping tiles.
  Sheet sheet = MakeFlatSheet(6.4e-3f, 6.4e-3f, 1e-4f);
  SetMetric(&sheet, [](const Vec2f& /*at*/) { return SurfaceMetric{1.0f, -0.4f, 1.0f}; });
  HeatField field(sheet, MakeMaterial(Lossless()));
  Ledger ledger;
  AddDryBlob(&field, 0, 0, 50);
  Tile* first = field.Find(0, 0);
  Tile* second = field.Wake(1, 1);
  second->state.enthalpy[0] = 0.9f * kWakeTheta * field.material().rc_wet;  // too cold to wake its neighbours
  second->state.enthalpy[kTileCells / 2 + kTile / 2] = 20.0f * kSleepTheta * field.material().rc_wet;
  field.RefreshTheta(second, &ledger);
  const double heat_of_first = first->Heat(), heat_of_second = second->Heat();
  const int most = field.Diffuse(0.01f, &ledger);
  ASSERT_EQ(field.awake().size(), 2u);
  EXPECT_EQ(first->substeps, most);
  EXPECT_LT(second->substeps, most);
  EXPECT_NEAR(first->Heat(), heat_of_first, 1e-6 * heat_of_first);
  EXPECT_NEAR(second->Heat(), heat_of_second, 1e-6 * heat_of_second);
}

TEST(HeatTest, LinksOfOneSignGiveTheBitsOfTheGeneralKernel) {
  for (const float shear : {-0.4f, 0.4f, 0.0f}) {
    Sheet sheet = MakeFlatSheet(9.6e-3f, 9.6e-3f, 1e-4f);
    SetMetric(&sheet, [&](const Vec2f& at) {
      return shear != 0.0f ? SurfaceMetric{1.0f, shear, 1.0f} : SurfaceMetric{1.0f, 60.0f * (at.x() - 5e-3f), 1.0f};
    });
    HeatField fast(sheet, MakeMaterial(ThermalParams{})), general(sheet, MakeMaterial(ThermalParams{}));
    for (HeatField* field : {&fast, &general}) {
      std::mt19937 random(3);
      std::uniform_real_distribution<float> uniform(0, 1);
      Fill(field, [&](double, double) { return uniform(random) < 0.3f ? 55.0 : 0.0; });
      double removed = 0;
      for (Tile* tile : field->awake()) {
        for (int k = 0; k < kTileCells; ++k) {
          if (uniform(random) < 0.1f) field->TakeOut(tile, k, kRemoved, &removed);
        }
      }
    }
    // The first metric's links lie along one diagonal, its opposite's along the other, the last one's along both.
    for (const Tile* tile : fast.awake()) {
      EXPECT_EQ(tile->geometry.has_main && tile->geometry.has_anti, shear == 0.0f && tile->tx == 1);
      EXPECT_TRUE(tile->geometry.has_main || tile->geometry.has_anti);
    }
    for (Tile* tile : general.awake()) tile->geometry.has_main = tile->geometry.has_anti = true;
    Ledger a, b;
    for (int n = 0; n < 20; ++n) {
      fast.Diffuse(0.01f, &a);
      general.Diffuse(0.01f, &b);
    }
    EXPECT_EQ(a.lost, b.lost);
    for (std::size_t n = 0; n < fast.awake().size(); ++n) {
      EXPECT_EQ(fast.awake()[n]->state.enthalpy, general.awake()[n]->state.enthalpy);
    }
  }
}

TEST(HeatTest, BadCellIsQuarantinedAndItsNeighboursAreNot) {
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), 1e30f}) {
    HeatField field(MakeFlatSheet(9.6e-3f, 9.6e-3f, 1e-4f), MakeMaterial(ThermalParams{}));
    Ledger ledger;
    Fill(&field, [](double, double) { return 40.0; });
    Tile* tile = field.Find(1, 1);
    tile->state.enthalpy[500] = bad;
    field.RefreshTheta(tile, &ledger);
    for (int n = 0; n < 50; ++n) field.Diffuse(0.01f, &ledger);
    EXPECT_EQ(field.quarantined(), 1u);
    EXPECT_EQ(tile->state.flags[500], kQuarantined);
    ForCells(field, [&](double theta, double, double) {
      ASSERT_GT(theta, 0.0);
      ASSERT_LE(theta, 40.0);
    });
  }
}

TEST(HeatTest, BoilingHoldsAtHundredDegreesUntilTheWaterIsSpent) {
  const Material material = MakeMaterial(Lossless());
  HeatField field(MakeFlatSheet(3.2e-3f, 3.2e-3f, 1e-4f), material);
  Ledger ledger;
  Fill(&field, [](double, double) { return 0.0; });
  Tile* tile = field.Find(0, 0);
  const float to_boil = material.BoilingEnthalpy(1.0f);
  EXPECT_NEAR(to_boil * 1e-9f, 0.225f, 0.01f);  // 0.23 J/mm^3 from 37 to 100 C
  // Uniform heating by 1.2 times the heat for warming and half the water.
  for (int n = 0; n < 100; ++n) {
    for (float& h : tile->state.enthalpy) h += (to_boil + 0.5f * material.latent) / 100;
    field.RefreshTheta(tile, &ledger);
    field.Diffuse(0.01f, &ledger);
    EXPECT_LE(tile->theta_max, material.theta_boil * 1.0001f);
  }
  EXPECT_NEAR(tile->state.water[0], 0.5f, 0.005f);
  EXPECT_NEAR(tile->theta_max, material.theta_boil, 0.01f);
}

}  // namespace
}  // namespace fulcrum::thermal
