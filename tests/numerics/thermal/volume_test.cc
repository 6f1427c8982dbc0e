// The tissue beneath the sheet: convergence, bounds, energy, depth of burn, restart.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <vector>

#include "tests/numerics/thermal/flat_scene.h"
#include "tests/numerics/thermal/volume_cases.h"
#include "thermal_node/volume/brick_kernels.h"

namespace fulcrum::thermal {
namespace {

constexpr float kDt = 0.01f;
const Vec2f kSpot(0.0103f, 0.0101f);

template <class Visit>
void ForCells(const VolumeField& volume, const Visit& visit) {
  for (Brick* brick : volume.awake()) {
    for (int k = 0; k < kLayers; ++k) {
      for (int j = 0; j < kBrick; ++j) {
        for (int i = 0; i < kBrick; ++i) visit(brick, i, j, k);
      }
    }
  }
}

/// A sheet of two by two bricks, their contact and both ledgers.
struct Stack {
  explicit Stack(Sheet sheet, ThermalParams params = {})
      : material(MakeMaterial(SheetOnly(params))),
        field(std::move(sheet), material),
        volume(field.sheet(), params),
        contact(material, volume.material()) {}

  static ThermalParams SheetOnly(ThermalParams params) {
    params.h_below_W_m2K = 0;
    return params;
  }
  int Step(float dt_s) {
    field.Diffuse(dt_s, &ledger);
    return contact.Step(dt_s, &field, &volume, &ledger);
  }
  /// theta of a tile's cells from a function of the cell's number.
  template <class Value>
  void Warm(int tx, int ty, const Value& value) {
    Tile* tile = field.Wake(tx, ty);
    for (int k = 0; k < kTileCells; ++k) {
      if ((tile->state.flags[k] & kNoTissue) == 0) {
        tile->state.enthalpy[k] = value(k) * material.HeatCapacity(tile->state.water[k]);
      }
    }
    field.RefreshTheta(tile, &ledger);
  }

  Material material;
  HeatField field;
  VolumeField volume;
  SheetContact contact;
  Ledger ledger;
};

scene::SceneData SceneWithVolume(bool on = true) {
  scene::SceneData data = FlatScene(21, 21, 1e-3f);
  data.fixed.thermal.volume = on ? 1 : 0;
  return data;
}

TipInput Dwell(float power_W, CauteryMode mode = CauteryMode::kCoag) {
  TipInput tip;
  tip.active = true;
  tip.path.from = tip.path.to = kSpot;
  tip.path.radius_m = 5e-4f;
  tip.mode = mode;
  tip.power_W = power_W;
  return tip;
}

TEST(VolumeTest, HalfSpaceConvergesInSecondOrder) {
  const double coarse = HalfSpaceError(3e-4f), fine = HalfSpaceError(1.5e-4f);
  EXPECT_GE(std::log2(coarse / fine), 1.9);
  EXPECT_LE(fine, 1e-3);
}

TEST(VolumeTest, WavesOverTwoBricksDecayInSecondOrder) {
  const double coarse = CosineError(2), fine = CosineError(1);
  EXPECT_GE(std::log2(coarse / fine), 1.9);
  EXPECT_LE(coarse, 1e-3);
}

TEST(VolumeTest, SheetCoolsIntoFatAsALayerOnAHalfSpace) {
  const double coarse = SheetOnFatError(2e-4f), fine = SheetOnFatError(1e-4f);
  EXPECT_LE(fine, 0.01);
  EXPECT_LT(fine, coarse);
}

TEST(VolumeTest, MaximumPrincipleHoldsWithTheSheetAndLongSteps) {
  std::mt19937 random(11);
  std::uniform_real_distribution<float> uniform(0, 1);
  ThermalParams params;
  params.fat_depth_m = 2.1e-3f;  // fat above the wall of the rectum
  Sheet sheet = SheetOfBricks(2, 1, params.cell_m);
  SetMetric(&sheet, [&](const Vec2f&) {
    const float s = 0.8f + 0.4f * uniform(random), t = 0.8f + 0.4f * uniform(random);
    return SurfaceMetric{s * s, 0, t * t};
  });
  Stack stack(std::move(sheet), params);
  double removed = 0;
  for (int n = 0; n < 9; ++n) {
    Tile* tile = stack.field.Wake(n % 3, n / 3);
    for (int k = 0; k < kTileCells; ++k) {
      tile->state.water[k] = uniform(random);
      if (uniform(random) < 0.45f) stack.field.TakeOut(tile, k, kRemoved, &removed);
    }
    stack.Warm(n % 3, n / 3, [&](int) { return uniform(random) < 0.5f ? 60.0f : 0.0f; });
  }
  stack.volume.Wake(0, 0, kWholeBrick);
  stack.volume.Wake(1, 0, kWholeBrick);
  ForCells(stack.volume, [&](Brick* brick, int i, int j, int k) {
    brick->enthalpy[BrickIndex(i, j, k)] = uniform(random) < 0.5f ? 60.0f : 0.0f;
  });
  stack.volume.Advance(0);  // theta from the enthalpy
  for (const float dt : {0.001f, 0.01f, 0.1f, 1.0f, 10.0f}) {
    EXPECT_GE(stack.Step(dt), 1);
    ForCells(stack.volume, [&](const Brick* brick, int i, int j, int k) {
      const float theta = brick->theta[BrickThetaIndex(i, j, k)];
      ASSERT_GE(theta, -1e-4f);
      ASSERT_LE(theta, 60.001f);
    });
    for (const Tile* tile : stack.field.awake()) {
      EXPECT_GE(tile->theta_min, -1e-4f);
      EXPECT_LE(tile->theta_max, 60.001f);
    }
  }
}

TEST(VolumeTest, BothLedgersCloseAcrossBricksAndSleep) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> uniform(0.85f, 1.2f);
  Sheet sheet = SheetOfBricks(2, 2, 1e-4f);
  SetMetric(&sheet, [&](const Vec2f&) {
    const float s = uniform(random), t = uniform(random);
    return SurfaceMetric{s * s, 0.1f * s * t, t * t};
  });
  ThermalParams params;
  params.perfusion_per_s = 0.1f;  // cools quickly
  Stack stack(std::move(sheet), params);
  // At the corner where the four bricks meet.
  for (const int tx : {2, 3}) {
    for (const int ty : {2, 3}) stack.Warm(tx, ty, [](int k) { return k % 7 == 0 ? 60.0f : 5.0f; });
  }
  const double start = stack.field.Stored();
  ASSERT_GT(start, 0.0);
  for (int n = 0; n < 6000 && !(stack.field.idle() && stack.volume.idle()); ++n) {
    if (n < 100) {
      for (int i = 0; i < 64; ++i) stack.volume.AddSource({64 + i, 96}, 2e5f, kDt);
    }
    stack.Step(kDt);
    if (n == 20) {
      EXPECT_EQ(stack.volume.awake().size(), 4u);
    }
    if (n % 50 != 0) continue;
    ASSERT_NEAR(stack.field.Stored() + stack.ledger.Out(), start, 2e-5 * start) << n;
    ASSERT_LE(stack.volume.ledger().ClosureError(stack.volume.Stored()), 2e-5) << n;
  }
  EXPECT_GT(stack.volume.ledger().from_sheet, 0.3 * start);
  EXPECT_GT(stack.volume.ledger().joule, 0.0);
  EXPECT_TRUE(stack.volume.idle());
}

TEST(VolumeTest, BadCellStartsAnewAndItsNeighboursNeverReadIt) {
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), -1e30f}) {
    const Sheet sheet = SheetOfBricks(1, 1, 1e-4f);
    VolumeField volume(sheet, PlainFat(1e-4f));
    Brick* brick = volume.Wake(0, 0, kWholeBrick);
    brick->enthalpy.fill(40.0f);
    volume.Advance(0);
    brick->enthalpy[BrickIndex(20, 21, 9)] = bad;
    for (int n = 0; n < 20; ++n) volume.Advance(kDt);
    EXPECT_EQ(volume.quarantined(), 1u);
    ForCells(volume, [&](const Brick* b, int i, int j, int k) {
      const float theta = b->theta[BrickThetaIndex(i, j, k)];
      ASSERT_GE(theta, 0.0f);
      ASSERT_LE(theta, 40.001f);
    });
  }
}

TEST(VolumeTest, BoilingHoldsAtHundredDegrees) {
  const Sheet sheet = SheetOfBricks(1, 1, 1e-4f);
  VolumeField volume(sheet, PlainFat(1e-4f));
  const float half_spent = 63.0f + 0.5f * volume.material().latent[0];
  Brick* brick = volume.Wake(0, 0, kWholeBrick);
  brick->enthalpy.fill(half_spent);
  volume.Advance(kDt);
  EXPECT_NEAR(volume.MaxTheta(), 63.0f, 1e-3f);
  EXPECT_NEAR(brick->enthalpy[5], half_spent, 1e-3f);
}

TEST(VolumeTest, DamageRateIsThatOfTheSheet) {
  const DamageRate rate(kCellDeath, 37.0f);
  std::vector<float> theta(kBrick), omega(kBrick, 0.0f);
  for (int i = 0; i < kBrick; ++i) theta[i] = 5.0f + static_cast<float>(i);
  // So short that no cell reaches the cap.
  constexpr float kShort = 1e-3f;
  EXPECT_TRUE(DamageRow(theta.data(), omega.data(), kBrick, rate, kShort));
  EXPECT_EQ(omega[0], 0.0f);
  for (int i = 1; i < kBrick; ++i) EXPECT_NEAR(omega[i] / (kShort * rate.At(theta[i])), 1.0f, 1e-6f) << theta[i];
  EXPECT_LT(omega[20], 1.0f);
  EXPECT_FALSE(DamageRow(theta.data(), omega.data(), 20, rate, kShort));
}

TEST(VolumeTest, DepthOfBurnGrowsWithPowerAndTime) {
  const scene::SceneData data = SceneWithVolume();
  const SceneView scene = data.View();
  float weaker = 0;
  for (const float power : {1.0f, 2.0f, 4.0f}) {
    ThermalSolver solver(scene);
    float before = 0;
    for (int second = 1; second <= 3; ++second) {
      for (int n = 0; n < 100; ++n) solver.Step(Dwell(power), kDt);
      const float depth = solver.figures().burn_depth_m;
      EXPECT_GE(depth, before);
      before = depth;
    }
    EXPECT_GT(before, weaker) << power;
    EXPECT_GE(before, 1e-4f);
    EXPECT_LT(before, 4.8e-3f) << "the whole depth";
    // Deepest below the tip, none far away.
    EXPECT_NEAR(solver.volume()->BurnDepth(kSpot), before, 3e-4f);
    EXPECT_EQ(solver.volume()->BurnDepth(kSpot + Vec2f(0.008f, 0)), 0.0f);
    EXPECT_LE(solver.ledger().ClosureError(solver.field().Stored()), 1e-5);
    EXPECT_LE(solver.volume()->ledger().ClosureError(solver.volume()->Stored()), 1e-5);
    // The Joule heat below is a part of the generator's energy beyond the sheet's own heat: that of an even leak.
    EXPECT_LE(solver.volume()->ledger().joule, solver.ledger().generator - solver.ledger().joule);
    EXPECT_GE(solver.volume()->ledger().joule, 0.15 * (solver.ledger().generator - solver.ledger().joule));
    weaker = before;
  }
}

TEST(VolumeTest, RestartInMidBurnContinuesBitForBit) {
  const scene::SceneData data = SceneWithVolume();
  const SceneView scene = data.View();
  std::vector<std::byte> bytes(ThermalSolver::CheckpointCapacity(scene));
  const auto run = [&](bool restart, std::vector<std::uint64_t>* hashes) {
    auto solver = std::make_unique<ThermalSolver>(scene);
    for (int frame = 0; frame < 200; ++frame) {
      if (restart && frame == 100) {
        const std::size_t used = solver->Save(bytes);
        EXPECT_GT(used, 0u);
        auto restarted = std::make_unique<ThermalSolver>(scene);
        EXPECT_FALSE(restarted->Restore(std::span(bytes).first(used - 1)));
        EXPECT_TRUE(restarted->Restore(std::span(bytes).first(used)));
        EXPECT_EQ(restarted->FullHash(), solver->FullHash());
        solver = std::move(restarted);
      }
      TipInput tip = Dwell(20);
      tip.path.from += Vec2f(2e-5f, 1e-5f) * static_cast<float>(frame);
      tip.path.to = tip.path.from + Vec2f(2e-5f, 1e-5f);
      solver->Step(frame < 150 ? tip : TipInput{}, kDt);
      hashes->push_back(solver->TickHash());
    }
    EXPECT_GT(solver->figures().burn_depth_m, 0.0f);
    return solver->FullHash();
  };
  std::vector<std::uint64_t> through, restarted;
  const std::uint64_t a = run(false, &through), b = run(true, &restarted);
  EXPECT_EQ(a, b);
  EXPECT_EQ(through, restarted);
  const scene::SceneData off = SceneWithVolume(false);
  EXPECT_FALSE(ThermalSolver(off.View()).Restore(bytes)) << "a checkpoint with a volume does not fit a scene without";
}

TEST(VolumeTest, StructuresAreAsWarmAsTheVolumeAtTheirDepth) {
  for (const float depth : {6e-4f, 3e-3f}) {
    scene::SceneData data = SceneWithVolume();
    data.protected_structures = {{ProtectedKind::kNerve, 0.001f, depth, 0, 2}};
    data.protected_points = {{Vec3f::Zero(), Vec2f(0.002f, 0.0101f)}, {Vec3f::Zero(), Vec2f(0.018f, 0.0101f)}};
    ThermalSolver solver(data.View());
    // Up to a frame in which the structures are sampled.
    for (int n = 0; n < 200 + kProtectedFrame; ++n) solver.Step(Dwell(20), kDt);
    float warmest = 0;
    for (const ProtectedSample& sample : solver.protected_structures().samples()) {
      warmest = std::max(warmest, sample.theta);
    }
    // The samples lie a millimetre apart.
    EXPECT_EQ(warmest, solver.volume()->ThetaAt({0.0100f, 0.0101f}, depth));
    EXPECT_EQ(solver.figures().injuries, depth < 1e-3f ? 1u : 0u);
  }
}

TEST(VolumeTest, SleepingTissueKeepsItsBurn) {
  const Sheet sheet = SheetOfBricks(2, 2, 1e-4f);
  VolumeField volume(sheet, ThermalParams{});
  Brick* brick = volume.Wake(1, 0, {16, 32, 10, 20, 8});
  // 12 layers of 150 um at 60 C for 10 s: omega about 2.9; below them cold.
  volume.Wake(1, 0, {0, kBrick, 0, kBrick, 12});
  for (int k = 0; k < 12; ++k) {
    for (int n = 0; n < kColumns; ++n) brick->enthalpy[k * kColumns + n] = 23.0f;
  }
  volume.Advance(0);
  volume.Finish(10);
  const float depth = volume.BurnDepth({0.0123f, 0.002f});
  EXPECT_NEAR(depth, 12 * 1.5e-4f, 1e-4f);
  EXPECT_EQ(volume.deepest_burn_m(), depth);
  brick->enthalpy.fill(0.1f);
  volume.Advance(0);
  volume.Finish(kDt);
  EXPECT_TRUE(volume.idle());
  EXPECT_GT(volume.ledger().dropped, 0.0);
  EXPECT_EQ(volume.BurnDepth({0.0123f, 0.002f}), depth);
  EXPECT_EQ(volume.Existing().size(), 1u);
}

TEST(VolumeTest, OffCostsNothingAndColdSleeps) {
  const scene::SceneData off = SceneWithVolume(false);
  EXPECT_EQ(ThermalSolver(off.View()).volume(), nullptr);
  const scene::SceneData on = SceneWithVolume();
  ThermalSolver solver(on.View());
  solver.Step(TipInput{}, kDt);
  EXPECT_FALSE(solver.stepped());
  EXPECT_TRUE(solver.volume()->idle());
  TipInput tip = Dwell(10);
  tip.path.tented = true;
  for (int n = 0; n < 50; ++n) solver.Step(tip, kDt);
  EXPECT_EQ(solver.volume()->ledger().joule, 0.0) << "a tented sheet touches nothing";
  // Beyond the window the sheet lies on tissue, and current warms it there too.
  EXPECT_LT(solver.volume()->ledger().from_sheet, 0.1 * solver.ledger().joule);
}

}  // namespace
}  // namespace fulcrum::thermal
