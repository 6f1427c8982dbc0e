// Drags of an energised tip over a sheet: the cut and the energy balance.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <utility>
#include <vector>

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

/// Runs the whole drag; after each commit the topology is checked against the cells.
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
  // The rim is browned … A film of steam heats the tissue under the metal evenly, and that tissue is removed. Beside it
  // remains tissue heated by conduction at the speed of the slit, alpha / v = 0.065 mm at 2 mm/s, of which the hotter
  // half browns.
  EXPECT_GE(slit.brown_m, 3e-5f);
  EXPECT_GE(slit.dead_m, slit.brown_m);
  EXPECT_LE(slit.dead_m, 1.5e-3f);  // … but not far beyond
  EXPECT_LE(slit.warm_m, 3e-3f);
  // The hole reaches half its width beyond both ends of the path.
  const float hole_m = 0.030f + slit.width_mean_m;
  EXPECT_NEAR(solver.cut_length_m(), hole_m, 0.03f * hole_m);
  EXPECT_NEAR(solver.figures().cut_width_p50_m, slit.width_mean_m, 2e-4f);
  EXPECT_GE(solver.figures().cut_width_p95_m, solver.figures().cut_width_p50_m);
  EXPECT_LE(solver.figures().cut_off_way_m, 3e-4f);
  EXPECT_LE(solver.ledger().ClosureError(solver.field().Stored()), 1e-4);
  // 37 to 100 C and all the water: the energy limits the removed volume.
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

/// Footprint of a disc of `radius_m`, `above_m` above the sheet.
Footprint DiscAt(const Vec2f& at, float radius_m, float above_m) {
  constexpr float kCell_m = 1e-4f;
  constexpr int kHalf = 16;
  Footprint print{static_cast<std::int32_t>(std::floor(at.x() / kCell_m)) - kHalf,
                  static_cast<std::int32_t>(std::floor(at.y() / kCell_m)) - kHalf,
                  2 * kHalf + 1,
                  {}};
  for (int j = 0; j <= 2 * kHalf; ++j) {
    for (int i = 0; i <= 2 * kHalf; ++i) {
      const Vec2f centre(static_cast<float>(print.x + i) + 0.5f, static_cast<float>(print.y + j) + 0.5f);
      print.gap.push_back(Footprint::Encode((kCell_m * centre - at).norm() - radius_m + above_m));
    }
  }
  return print;
}

/// The drag of a capsule, expressed by footprints.
TipInput Standing(TipInput input, float above_m = 0) {
  input.path.begin = DiscAt(input.path.from, input.path.radius_m, above_m);
  input.path.end = DiscAt(input.path.to, input.path.radius_m, above_m);
  input.path.displacement = input.path.to - input.path.from;
  return input;
}

TEST(CutPropertiesTest, MetalThatStandsInTheSheetCutsAsADiscDoes) {
  const scene::SceneData data = FlatScene(31, 51, 1e-3f);
  ThermalSolver disc(data.View()), needle(data.View());
  const Drag drag = Slanted(0.004f, 0.010f);
  for (int frame = 0; frame < drag.frames(kDt); ++frame) {
    disc.Step(drag.At(frame, kDt), kDt);
    needle.Step(Standing(drag.At(frame, kDt)), kDt);
  }
  EXPECT_NEAR(needle.ledger().joule, disc.ledger().joule, 0.01 * disc.ledger().joule);
  EXPECT_NEAR(MeasureSlit(needle, data.View(), drag).width_mean_m, MeasureSlit(disc, data.View(), drag).width_mean_m,
              5e-5f);
}

TEST(CutPropertiesTest, MetalThatGoesFarInOneSampleLeavesNothingOut) {
  // 1.2 mm between two footprints of 1 mm: the samples between them were lost.
  const scene::SceneData data = FlatScene(31, 51, 1e-3f);
  ThermalSolver often(data.View()), seldom(data.View());
  const Drag drag = Slanted(0.004f, 0.012f);
  constexpr float kSeldom_s = 0.3f;
  for (int frame = 0; frame < drag.frames(kDt); ++frame) often.Step(Standing(drag.At(frame, kDt)), kDt);
  for (int frame = 0; frame < drag.frames(kSeldom_s); ++frame) {
    seldom.Step(Standing(drag.At(frame, kSeldom_s)), kSeldom_s);
  }
  const SlitFigures whole = MeasureSlit(often, data.View(), drag), swept = MeasureSlit(seldom, data.View(), drag);
  EXPECT_NEAR(swept.width_mean_m, whole.width_mean_m, 2e-4f);
  EXPECT_EQ(seldom.topology().dead_edge_count(), often.topology().dead_edge_count());
}

TEST(CutPropertiesTest, MetalAboveTheSheetTakesNoCurrent) {
  const scene::SceneData data = FlatScene(31, 51, 1e-3f);
  const auto joule = [&](float above_m) {
    ThermalSolver solver(data.View());
    solver.Step(Standing(Slanted(0.004f).At(0, kDt), 5e-4f + above_m), kDt);
    return solver.ledger().joule;
  };
  EXPECT_GT(joule(-5e-5f), 0.01);
  EXPECT_EQ(joule(kFilmReach_m + 1e-5f), 0.0);
}

TEST(CutPropertiesTest, SamplesOfOneFrameAddUp) {
  const scene::SceneData data = FlatScene(31, 51, 1e-3f);
  const Drag drag = Slanted(0.006f, 0.012f);
  ThermalSolver one(data.View()), three(data.View());
  for (int frame = 0; frame < drag.frames(kDt); ++frame) {
    const TipInput whole = drag.At(frame, kDt);
    one.Step(whole, kDt);
    std::vector<TipInput> parts;
    for (const auto& [from, to] : {std::pair(0.0f, 0.2f), std::pair(0.2f, 0.5f), std::pair(0.5f, 1.0f)}) {
      TipInput part = whole;
      part.path = PartOf(whole.path, from, to);
      part.duration_s = (to - from) * kDt;
      parts.push_back(part);
    }
    three.Step(parts, kDt);
  }
  EXPECT_NEAR(three.ledger().joule, one.ledger().joule, 0.01 * one.ledger().joule);
  EXPECT_NEAR(three.figures().power_W, one.figures().power_W, 0.1f * one.figures().power_W);
}

TEST(CutPropertiesTest, AFilmCarriesTheCurrentOfACutAndCollapsesAfterIt) {
  const scene::SceneData data = FlatScene(31, 51, 1e-3f);
  ThermalSolver solver(data.View());
  const Drag drag = Slanted(0.004f, 0.010f);
  RunDrag(drag, kDt, &solver);
  EXPECT_GT(solver.source()->interface().film, 0.9f);
  const Ledger& ledger = solver.ledger();
  // A quarter of the heat of discharges does not reach the tissue; most of the current flows through discharges.
  EXPECT_GT(ledger.film, 0.15 * ledger.generator);
  EXPECT_LT(ledger.film, 0.25 * ledger.generator);
  EXPECT_NEAR(ledger.plume / ledger.film, 1 - kMetalShare / (1 - kTissueShare), 1e-5);
  EXPECT_LE(ledger.joule + ledger.film, 1.001 * ledger.generator);
  // Heat of the metal: its share of the discharges less the loss to the shaft in these seconds.
  const double got_K = (ledger.film - ledger.plume - ledger.hook) / static_cast<double>(kHookHeatCapacity_J_K);
  EXPECT_LT(solver.source()->interface().hook_theta, got_K);
  EXPECT_GT(solver.source()->interface().hook_theta, std::exp(-2.5 / kHookCools_s) * got_K);
  TipInput resting = drag.At(drag.frames(kDt) - 1, kDt);
  resting.path.from = resting.path.to += Vec2f(0.002f, 0);  // where there is tissue
  resting.active = false;
  resting.touching = true;
  resting.power_W = 0;
  const double before = ledger.hook;
  for (int n = 0; n < 10; ++n) solver.Step(resting, kDt);
  EXPECT_LT(solver.source()->interface().film, 1e-4f);
  EXPECT_NE(ledger.hook, before) << "metal that rests on tissue exchanges heat with it";
  EXPECT_LE(ledger.ClosureError(solver.field().Stored()), 1e-4);
}

TEST(CutPropertiesTest, CoagulationHasNoFilm) {
  const scene::SceneData data = FlatScene(31, 51, 1e-3f);
  ThermalSolver solver(data.View());
  Drag drag = Slanted(0.004f, 0.010f);
  drag.mode = CauteryMode::kCoag;
  RunDrag(drag, kDt, &solver);
  EXPECT_GT(solver.ledger().vapour, 0.0);
  EXPECT_EQ(solver.ledger().film, 0.0);
  EXPECT_EQ(solver.source()->interface().film, 0.0f);
}

TEST(CutPropertiesTest, ACrumbBetweenTwoCutsGoes) {
  const scene::SceneData data = FlatScene(31, 51, 1e-3f);
  const SceneView scene = data.View();
  ThermalSolver solver(scene);
  TopologyValidator validator(scene, solver.field().sheet());
  // Around a square of 2.5 mm, along its sides: the rest of it within the slit is some 1.2 mm wide.
  const Vec2f corners[] = {{0.020f, 0.012f}, {0.0225f, 0.012f}, {0.0225f, 0.0145f}, {0.020f, 0.0145f}};
  for (int side = 0; side < 4; ++side) {
    const Drag drag{.from = corners[side], .to = corners[(side + 1) % 4], .speed_m_s = 0.005f};
    RunDrag(drag, kDt, &solver);
  }
  while (!solver.at_commit_frame()) solver.Step(TipInput{}, kDt);
  EXPECT_EQ(validator.Check(solver), "");
  const CellIndex middle = solver.field().sheet().CellOf({0.02125f, 0.01325f});
  EXPECT_TRUE(IsRemoved(solver.field(), middle));
  EXPECT_GT(solver.figures().debris_m2, 0.0f);
  EXPECT_LT(solver.figures().debris_m2, kCrumb_m2);
  EXPECT_GT(solver.ledger().debris, 0.0);
  EXPECT_LE(solver.ledger().ClosureError(solver.field().Stored()), 1e-4);
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
  EXPECT_NEAR(solver.cut_length_m(), once, 5e-4f);
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
