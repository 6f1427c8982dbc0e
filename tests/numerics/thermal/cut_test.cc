// Dragging an energised tip over a sheet: what it cuts, and where the energy goes.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "tests/numerics/thermal/flat_scene.h"
#include "tests/numerics/thermal/topology_validator.h"

namespace fulcrum::thermal {
namespace {

constexpr float kDt = 0.01f;

/// A drag that is not aligned with the mesh.
Drag Slanted(float speed_m_s, float length_m = 0.030f) {
  Drag drag;
  drag.from = {0.0103f, 0.0081f};
  drag.to = drag.from + length_m * Vec2f(std::cos(0.3f), std::sin(0.3f));
  drag.speed_m_s = speed_m_s;
  return drag;
}

/// Runs the whole drag; the topology is held to the cells after each commit.
void RunChecked(const SceneView& scene, const Drag& drag, ThermalSolver* solver) {
  TopologyValidator validator(scene, solver->field().sheet());
  for (int frame = 0; frame < drag.frames(kDt); ++frame) {
    solver->Step(drag.At(frame, kDt), kDt);
    if (!solver->committed()) continue;
    ASSERT_EQ(validator.Check(*solver), "") << "frame " << frame;
  }
}

class CutTest : public ::testing::TestWithParam<float> {};

TEST_P(CutTest, SlitIsContinuousAndEnergyCloses) {
  const scene::SceneData data = FlatScene(31, 51, 1e-3f);
  const SceneView scene = data.View();
  ThermalSolver solver(scene);
  const Drag drag = Slanted(GetParam());
  TopologyValidator validator(scene, solver.field().sheet());
  for (int frame = 0; frame < drag.frames(kDt); ++frame) {
    solver.Step(drag.At(frame, kDt), kDt);
    ASSERT_LE(solver.source_stats().imbalance, kImbalanceLimit);
    ASSERT_LE(solver.figures().power_W, drag.power_W * 1.001f);
    ASSERT_LE(solver.figures().voltage_V, scene.thermal.v_max_V * 1.001f);
    if (!solver.committed()) continue;
    ASSERT_EQ(validator.Check(solver), "");
  }
  for (int n = 0; n < kCommitFrames; ++n) solver.Step(TipInput{}, kDt);
  const SlitFigures slit = MeasureSlit(solver, scene, drag);
  EXPECT_EQ(slit.surviving_crossings, 0);
  EXPECT_GE(slit.width_min_m, 5e-4f);
  EXPECT_LE(slit.width_max_m, 2e-3f);
  EXPECT_GE(slit.brown_m, 5e-5f);  // browned …
  EXPECT_GE(slit.dead_m, slit.brown_m);
  EXPECT_LE(slit.dead_m, 1.5e-3f);  // … but not far
  EXPECT_LE(slit.warm_m, 3e-3f);
  // The hole reaches half its width beyond both ends of the path. The meter may miss up to a mark at each end; its way
  // from mark to mark is not quite straight.
  const float hole_m = 0.030f + slit.width_max_m;
  EXPECT_GE(solver.cut_length_m(), hole_m - 2.0f * kMarkSpacing);
  EXPECT_LE(solver.cut_length_m(), 1.05f * hole_m);
  EXPECT_LE(solver.ledger().ClosureError(solver.field().Stored()), 1e-4);
  // 37 to 100 C and all the water: no more tissue can go than the energy allows.
  const Material& m = solver.field().material();
  double removed_m3 = 0;
  for (const Tile* tile : solver.field().Existing()) {
    for (int k = 0; k < kTileCells; ++k) removed_m3 += (tile->state.flags[k] & kRemoved) != 0 ? tile->Volume(k) : 0.0;
  }
  EXPECT_LE(removed_m3 * (m.BoilingEnthalpy(1.0f) + m.latent), solver.ledger().joule);
}

INSTANTIATE_TEST_SUITE_P(Speeds, CutTest, ::testing::Values(0.002f, 0.004f, 0.008f));

TEST(CutPropertiesTest, FasterCutsAreNarrower) {
  const scene::SceneData data = FlatScene(31, 51, 1e-3f);
  const SceneView scene = data.View();
  float last = 1;
  for (const float speed : {0.003f, 0.008f}) {
    ThermalSolver solver(scene);
    const Drag drag = Slanted(speed, 0.012f);
    RunChecked(scene, drag, &solver);
    const float width = MeasureSlit(solver, scene, drag).width_mean_m;
    EXPECT_LT(width, last);
    last = width;
  }
}

TEST(CutPropertiesTest, CouplingStepHasConverged) {
  const scene::SceneData data = FlatScene(31, 51, 1e-3f);
  const SceneView scene = data.View();
  double joule[2];
  for (int n = 0; n < 2; ++n) {
    ThermalSolver solver(scene);
    if (n == 1) {
      solver.source()->max_change = 0.02f;
      solver.source()->min_step_s = 2.5e-5f;
      solver.source()->tolerance = 1e-3f;
    }
    RunDrag(Slanted(0.006f, 0.012f), kDt, &solver);
    joule[n] = solver.ledger().joule;
  }
  EXPECT_NEAR(joule[0], joule[1], 0.02 * joule[1]);
}

TEST(CutPropertiesTest, ALineOfMetalWidensTheSlitAcrossTheCutAndNotAlongIt) {
  const scene::SceneData data = FlatScene(31, 51, 1e-3f);
  const SceneView scene = data.View();
  Drag drag = Slanted(0.002f, 0.010f);
  drag.power_W = 60;
  const Vec2f along = (drag.to - drag.from).normalized(), across(-along.y(), along.x());
  const auto width = [&](const Vec2f& half) {
    ThermalSolver solver(scene);
    drag.half = half;
    RunChecked(scene, drag, &solver);
    EXPECT_LE(solver.ledger().ClosureError(solver.field().Stored()), 1e-4);
    return MeasureSlit(solver, scene, drag).width_mean_m;
  };
  const float point = width(Vec2f::Zero());
  EXPECT_NEAR(width(0.0005f * along), point, 2.5e-4f);
  EXPECT_NEAR(width(0.0005f * across), point + 0.001f, 3e-4f);
}

TEST(CutPropertiesTest, MetalThatTheWindowDoesNotHoldIsShortenedAndCounted) {
  scene::SceneData data = FlatScene(16, 16, 1e-3f);
  const auto run = [&](float cell_m, float half_m) {
    data.fixed.thermal.cell_m = cell_m;
    ThermalSolver solver(data.View());
    Drag drag{.from = {0.007f, 0.0075f}, .to = {0.008f, 0.0075f}, .speed_m_s = 0.01f};
    drag.half = {0, half_m};
    RunDrag(drag, kDt, &solver);
    EXPECT_GT(solver.ledger().joule, 0.0);
    return std::pair(solver.figures().shortened, solver.ledger().joule);
  };
  EXPECT_EQ(run(1e-4f, 2e-3f).first, 0u);
  const float most = kMetalReach * 5e-5f - Drag{}.radius_m;
  const auto [none, fits] = run(5e-5f, 0.9999f * most);
  const auto [all, shortened] = run(5e-5f, 2e-3f);
  EXPECT_EQ(none, 0u);
  EXPECT_EQ(all, 10u);
  EXPECT_NEAR(shortened, fits, 1e-3 * fits);
}

TEST(CutPropertiesTest, GoingOverAnOldSlitAddsNoLength) {
  const scene::SceneData data = FlatScene(31, 51, 1e-3f);
  const SceneView scene = data.View();
  ThermalSolver solver(scene);
  Drag drag = Slanted(0.004f);
  RunChecked(scene, drag, &solver);
  const float once = solver.cut_length_m();
  std::swap(drag.from, drag.to);
  RunChecked(scene, drag, &solver);
  EXPECT_NEAR(solver.cut_length_m(), once, kMarkSpacing);
}

TEST(CutPropertiesTest, CoagulationDriesAndBrownsButDoesNotCut) {
  const scene::SceneData data = FlatScene(31, 51, 1e-3f);
  const SceneView scene = data.View();
  ThermalSolver solver(scene);
  Drag drag = Slanted(0.004f);
  drag.mode = CauteryMode::kCoag;
  drag.power_W = 30;
  RunChecked(scene, drag, &solver);
  for (int n = 0; n < kCommitFrames; ++n) solver.Step(TipInput{}, kDt);
  const SlitFigures slit = MeasureSlit(solver, scene, drag);
  EXPECT_EQ(slit.width_max_m, 0.0f);
  EXPECT_GT(slit.brown_m, 2e-4f);
  EXPECT_EQ(solver.topology().dead_edge_count(), 0u);
  int shrunk = 0;
  for (const std::uint8_t s : solver.topology().committed().shrink) {
    shrunk += s > 0 ? 1 : 0;
    EXPECT_LE(static_cast<float>(s) * kShrinkUnit, scene.thermal.shrink_max);
  }
  EXPECT_GT(shrunk, 20);
  EXPECT_LE(solver.ledger().ClosureError(solver.field().Stored()), 1e-4);
}

TEST(CutPropertiesTest, PowerIsRegulatedBeforeTheTissueDries) {
  const scene::SceneData data = FlatScene(31, 51, 1e-3f);
  ThermalSolver solver(data.View());
  Drag drag = Slanted(0.008f);
  drag.power_W = 10;
  solver.Step(drag.At(0, kDt), kDt);
  EXPECT_NEAR(solver.figures().power_W, 10.0f, 0.1f);
}

TEST(CutPropertiesTest, BadCellsUnderTheTipAreQuarantinedAndTheCutGoesOn) {
  const scene::SceneData data = FlatScene(31, 51, 1e-3f);
  const SceneView scene = data.View();
  ThermalSolver solver(scene);
  const Drag drag = Slanted(0.004f);
  for (int frame = 0; frame < drag.frames(kDt); ++frame) {
    if (frame == 300) {
      const CellIndex cell = solver.field().sheet().CellOf(drag.At(frame + 30, kDt).path.to);
      Tile* tile = solver.mutable_field()->Wake(cell.ix / kTile, cell.iy / kTile);
      tile->state.enthalpy[(cell.iy % kTile) * kTile + cell.ix % kTile] = NAN;
    }
    solver.Step(drag.At(frame, kDt), kDt);
  }
  EXPECT_EQ(solver.field().quarantined(), 1u);
  EXPECT_EQ(MeasureSlit(solver, scene, drag).surviving_crossings, 0);
  EXPECT_TRUE(std::isfinite(solver.ledger().joule));
}

TEST(CutPropertiesTest, SameInputsGiveTheSameBitsAndARestartContinuesThem) {
  const scene::SceneData data = FlatScene(31, 51, 1e-3f);
  const SceneView scene = data.View();
  const auto run = [&](int restart_at, std::vector<std::uint64_t>* hashes) {
    auto solver = std::make_unique<ThermalSolver>(scene);
    const Drag drag = Slanted(0.008f);
    std::vector<std::byte> bytes(ThermalSolver::CheckpointCapacity(scene));
    for (int frame = 0; frame < drag.frames(kDt) + 50; ++frame) {
      if (frame == restart_at) {
        EXPECT_TRUE(solver->at_commit_frame());
        const std::size_t used = solver->Save(bytes);
        EXPECT_GT(used, 0u);
        auto restarted = std::make_unique<ThermalSolver>(scene);
        EXPECT_TRUE(restarted->Restore(std::span(bytes).first(used)));
        EXPECT_EQ(restarted->FullHash(), solver->FullHash());
        EXPECT_EQ(restarted->topology().revision(), solver->topology().revision());
        EXPECT_EQ(restarted->topology().dead_edge_count(), solver->topology().dead_edge_count());
        solver = std::move(restarted);
      }
      solver->Step(frame < drag.frames(kDt) ? drag.At(frame, kDt) : TipInput{}, kDt);
      hashes->push_back(solver->TickHash());
    }
    return solver->FullHash();
  };
  std::vector<std::uint64_t> first, second, restarted;
  const std::uint64_t a = run(-1, &first), b = run(-1, &second), c = run(200, &restarted);
  EXPECT_EQ(a, b);
  EXPECT_EQ(a, c);
  EXPECT_EQ(first, second);
  EXPECT_EQ(first, restarted);
}

TEST(CutPropertiesTest, BrokenCheckpointsAreRefusedAndLeaveAFreshState) {
  const scene::SceneData data = FlatScene(31, 51, 1e-3f);
  const SceneView scene = data.View();
  ThermalSolver solver(scene);
  RunDrag(Slanted(0.008f), kDt, &solver);
  while (!solver.at_commit_frame()) solver.Step(TipInput{}, kDt);
  std::vector<std::byte> bytes(ThermalSolver::CheckpointCapacity(scene));
  const std::size_t used = solver.Save(bytes);
  const std::uint64_t fresh = ThermalSolver(scene).FullHash();
  for (const std::size_t length : {std::size_t{0}, std::size_t{100}, used / 3, used - 1}) {
    ThermalSolver other(scene);
    EXPECT_FALSE(other.Restore(std::span(bytes).first(length)));
    EXPECT_EQ(other.FullHash(), fresh);
  }
  EXPECT_EQ(solver.Save(std::span(bytes).first(used - 1)), 0u);
  bytes[3] ^= std::byte{1};
  ThermalSolver other(scene);
  EXPECT_FALSE(other.Restore(std::span(bytes).first(used)));
}

TEST(CutPropertiesTest, IdleSolverDoesNothing) {
  const scene::SceneData data = FlatScene(31, 51, 1e-3f);
  ThermalSolver solver(data.View());
  const std::uint64_t before = solver.FullHash();
  for (int n = 0; n < 1000; ++n) {
    solver.Step(TipInput{}, kDt);
    ASSERT_FALSE(solver.stepped());
  }
  EXPECT_EQ(solver.FullHash(), before);
  EXPECT_EQ(solver.topology().revision(), 0u);
}

TEST(CutPropertiesTest, CooledTissueFallsAsleepAndKeepsItsHistory) {
  const scene::SceneData data = FlatScene(31, 51, 1e-3f);
  const SceneView scene = data.View();
  ThermalSolver solver(scene);
  const Drag drag = Slanted(0.008f);
  RunChecked(scene, drag, &solver);
  int frames = 0;
  while (solver.Step(TipInput{}, kDt), solver.stepped()) ASSERT_LT(++frames, 6000);
  EXPECT_TRUE(solver.field().idle());
  EXPECT_GT(MeasureSlit(solver, scene, drag).width_min_m, 4e-4f);
  EXPECT_LE(solver.ledger().ClosureError(0.0), 1e-4);
}

}  // namespace
}  // namespace fulcrum::thermal
