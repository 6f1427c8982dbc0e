// Extreme inputs of the solver: steps from a millisecond to ten seconds, jumps of a million in conductivity, riddled
// tissue, collapsed maps, strong sources and sinks, sheets of one cell, and values that are not numbers.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "services/base/core/error.h"
#include "tests/numerics/thermal/flat_scene.h"
#include "tests/numerics/thermal/heat_cases.h"
#include "thermal_node/coupling/tip_tracker.h"

namespace fulcrum::thermal {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();
constexpr float kHot =
    60;  ///< Highest temperature at the start [K]: below boiling, so that nothing but conduction acts.
/// Rounding of a step in float, relative to kHot; a method that overshoots does so by per cent and more.
constexpr float kRounding = 1e-5f;
const std::vector<float> kAllSteps = {1e-3f, 1e-2f, 1e-1f, 1.0f, 10.0f};

/// Multiples of the default tissue's values.
struct Tissue {
  float k_wet = 1, k_dry = 1;
  float sink_per_s = 0;  ///< Replaces the default losses, in units of the heat capacity of wet tissue.
  bool patchy = false;   ///< Each cell randomly wet or dry; otherwise wet.
  float holes = 0;       ///< Fraction of the cells.
};

Material MakeTissue(const Tissue& tissue) {
  Material m = MakeMaterial(ThermalParams{});
  m.k_wet *= tissue.k_wet;
  m.k_dry *= tissue.k_dry;
  if (tissue.sink_per_s > 0) m.loss_resting = m.loss_tented = tissue.sink_per_s * m.rc_wet;
  return m;
}

/// Random temperatures of 0 or kHot, water and holes.
void Scatter(const Tissue& tissue, HeatField* field) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> uniform(0, 1);
  Ledger ledger;
  double removed = 0;
  Fill(field, [](double, double) { return 0.0; });
  for (Tile* tile : field->awake()) {
    for (int k = 0; k < kTileCells; ++k) {
      if ((tile->state.flags[k] & kNoTissue) != 0) continue;
      if (uniform(random) < tissue.holes) {
        field->TakeOut(tile, k, kRemoved, &removed);
        continue;
      }
      if (tissue.patchy) tile->state.water[k] = uniform(random) < 0.5f ? 0.0f : 1.0f;
      const float theta = uniform(random) < 0.5f ? kHot : 0.0f;
      tile->state.enthalpy[k] = theta * field->material().HeatCapacity(tile->state.water[k]);
    }
    field->RefreshTheta(tile, &ledger);
  }
}

void ExpectMaximumPrinciple(const HeatField& field) {
  for (const Tile* tile : field.awake()) {
    for (int k = 0; k < kTileCells; ++k) {
      const float theta = tile->theta[ThetaIndex(k % kTile, k / kTile)];
      ASSERT_GE(theta, -kRounding * kHot);  // false for NaN
      ASSERT_LE(theta, kHot * (1 + kRounding));
      if ((tile->state.flags[k] & kNoTissue) != 0) {
        ASSERT_EQ(tile->state.enthalpy[k], 0.0f);
      }
    }
  }
  EXPECT_EQ(field.quarantined(), 0u);
}

void RunSteps(const Sheet& sheet, const Tissue& tissue, const std::vector<float>& steps) {
  for (const float dt : steps) {
    SCOPED_TRACE("dt " + std::to_string(dt) + " s");
    HeatField field(sheet, MakeTissue(tissue));
    Scatter(tissue, &field);
    Ledger ledger;
    for (int n = 0; n < 3; ++n) {
      field.Diffuse(dt, &ledger);
      ExpectMaximumPrinciple(field);
      if (::testing::Test::HasFatalFailure()) return;
    }
    EXPECT_TRUE(std::isfinite(ledger.Out()));
  }
}

Sheet Small() { return MakeFlatSheet(4e-3f, 3e-3f, 1e-4f); }

TEST(StabilityTest, HolesAndJumpsOfConductivity) {
  RunSteps(Small(), {.holes = 0.45f}, kAllSteps);
  RunSteps(Small(), {.k_dry = 1e-6f, .patchy = true}, kAllSteps);
  RunSteps(Small(), {.k_dry = 1e-6f, .patchy = true, .holes = 0.45f}, kAllSteps);
}

TEST(StabilityTest, ConductivityAThousandTimesTissueBesideAThousandthOfIt) {
  RunSteps(Small(), {.k_wet = 1e3f, .k_dry = 1e-3f, .patchy = true, .holes = 0.45f}, {1e-3f, 1e-2f, 1e-1f});
}

TEST(StabilityTest, FierceSink) { RunSteps(Small(), {.sink_per_s = 1e6f, .patchy = true, .holes = 0.45f}, {1e-3f}); }

TEST(StabilityTest, StiffTissueAndLongSteps) {
  RunSteps(Small(), {.k_wet = 1e3f, .k_dry = 1e-3f, .patchy = true, .holes = 0.45f}, kAllSteps);
  RunSteps(Small(), {.k_wet = 1e6f, .patchy = true, .holes = 0.45f}, kAllSteps);
  RunSteps(Small(), {.sink_per_s = 1e6f, .patchy = true, .holes = 0.45f}, kAllSteps);
  RunSteps(MakeFlatSheet(1e-4f, 1e-4f, 1e-4f), {.sink_per_s = 1e6f}, kAllSteps);
}

TEST(StabilityTest, SheetOfOneCell) {
  RunSteps(MakeFlatSheet(1e-4f, 1e-4f, 1e-4f), {}, kAllSteps);
  RunSteps(MakeFlatSheet(1e-4f, 3.3e-3f, 1e-4f), {.holes = 0.45f}, kAllSteps);
  // A burn on it, in all modes.
  for (const CauteryMode mode : {CauteryMode::kCut, CauteryMode::kCoag, CauteryMode::kBlend}) {
    const scene::SceneData data = FlatScene(2, 2, 1e-4f);
    ThermalSolver solver(data.View());
    ASSERT_EQ(solver.field().sheet().nx * solver.field().sheet().ny, 1);
    TipInput tip;
    tip.active = true;
    tip.path.from = tip.path.to = {5e-5f, 5e-5f};
    tip.path.radius_m = 5e-4f;
    tip.mode = mode;
    tip.power_W = 35;
    for (const float dt : kAllSteps) {
      solver.Step(tip, dt);
      ASSERT_TRUE(std::isfinite(solver.ledger().joule + solver.figures().present_C));
      ASSERT_LE(solver.ledger().ClosureError(solver.field().Stored()), 1e-4);
    }
    EXPECT_EQ(solver.field().quarantined(), 0u);
  }
}

/// An invalid map between material and rest shape: refused with one clear line, or harmless.
void RunMap(const std::string& what, const std::function<void(Vec3f*)>& spoil) {
  SCOPED_TRACE(what);
  scene::SceneData data = FlatScene(5, 5, 1e-3f);
  for (Vec3f& p : data.rest_position) spoil(&p);
  try {
    RunSteps(MakeSheet(data.View()), {.holes = 0.2f}, {1e-3f, 1e-1f, 10.0f});
  } catch (const InputError&) {
  }
}

TEST(StabilityTest, CollapsedMetric) {
  RunMap("a point", [](Vec3f* p) { p->setZero(); });
  RunMap("a line", [](Vec3f* p) { p->y() = 0; });
  RunMap("a million times", [](Vec3f* p) { *p *= 1e6f; });
  RunMap("a millionth", [](Vec3f* p) { *p *= 1e-6f; });
  RunMap("sheared", [](Vec3f* p) { p->x() += 5 * p->y(); });
  RunMap("folded", [](Vec3f* p) { p->x() = std::abs(p->x() - 0.002f); });
  RunMap("infinite", [](Vec3f* p) { *p *= 1e38f; });
}

TEST(StabilityTest, MapOfNoNumber) {
  RunMap("one node", [](Vec3f* p) {
    if (p->x() == 0.002f && p->y() == 0.002f) p->z() = kNan;
  });
}

TEST(StabilityTest, HeatingByABillionKelvinPerSecond) {
  // For a microsecond: everything boils, dries, and is heated only by the remaining heat. For a millisecond: a million
  // kelvin is not a valid temperature; the cells are quarantined and counted.
  for (const float dt : {1e-6f, 1e-3f}) {
    SCOPED_TRACE("dt " + std::to_string(dt) + " s");
    const Material material = MakeMaterial(ThermalParams{});
    HeatField field(Small(), material);
    Fill(&field, [](double, double) { return 0.0; });
    Ledger ledger;
    Tile* tile = field.Find(0, 0);
    const float heat = 1e9f * dt * material.rc_wet;
    double put = 0;
    std::uint64_t heated = 0;
    for (int k = 0; k < kTileCells; k += 7) {
      if ((tile->state.flags[k] & kNoTissue) != 0) continue;
      tile->state.enthalpy[k] += heat;
      put += heat;
      ++heated;
    }
    field.RefreshTheta(tile, &ledger);
    field.Boil(tile, &ledger);
    const double volume = static_cast<double>(material.cell_m) * material.cell_m * material.thickness_m;
    for (int n = 0; n < 10; ++n) field.Diffuse(0.01f, &ledger);
    EXPECT_EQ(field.quarantined(), dt > 1e-4f ? heated : 0u);
    EXPECT_NEAR(field.Stored() + ledger.Out(), put * volume, 1e-5 * put * volume);
    for (const Tile* t : field.awake()) {
      ASSERT_GE(t->theta_min, 0.0f);
      ASSERT_LE(t->theta_max, 1e9f * dt);
    }
  }
}

TEST(StabilityTest, LongFramesWithTheCurrentOn) {
  const scene::SceneData data = FlatScene(9, 9, 1e-3f);
  for (const bool moving : {false, true}) {
    for (const float dt : kAllSteps) {
      SCOPED_TRACE("dt " + std::to_string(dt) + " s");
      ThermalSolver solver(data.View());
      TipInput tip;
      tip.active = true;
      tip.path.from = {0.002f, 0.004f};
      tip.path.to = moving ? Vec2f(0.006f, 0.0043f) : tip.path.from;
      tip.path.radius_m = 5e-4f;
      tip.mode = CauteryMode::kCut;
      tip.power_W = 35;
      for (int n = 0; n < 3; ++n) {
        solver.Step(tip, dt);
        ASSERT_LE(solver.ledger().ClosureError(solver.field().Stored()), 1e-4);
        ASSERT_LE(solver.ledger().generator, 35.0 * dt * (n + 1) * 1.001);
        // A cut leaves nothing hotter than boiling: dry tissue is removed at once.
        ASSERT_LE(solver.field().MaxTheta(), solver.field().material().theta_boil * 1.001f);
      }
      EXPECT_EQ(solver.field().quarantined(), 0u);
    }
  }
}

/// One stored value of a cell.
using Value = CellArray<float> TileState::*;

struct Fault {
  std::string name;
  Value value;
  float bad;
};

class BadCellTest : public ::testing::TestWithParam<Fault> {};

/// Spoils a cell beside the path of a cut, within reach of its heat.
TEST_P(BadCellTest, IsQuarantinedCountedAndAlone) {
  const Fault fault = GetParam();
  const scene::SceneData data = FlatScene(11, 16, 1e-3f);
  Drag drag;
  drag.from = {0.0031f, 0.0051f};
  drag.to = {0.0111f, 0.0051f};
  const auto run = [&](bool spoil) {
    auto solver = std::make_unique<ThermalSolver>(data.View());
    const CellIndex cell = solver->field().sheet().CellOf({0.0072f, 0.0060f});
    for (int frame = 0; frame < drag.frames(0.01f); ++frame) {
      solver->Step(drag.At(frame, 0.01f), 0.01f);
      if (!spoil || frame != 80) continue;
      Tile* tile = solver->mutable_field()->Wake(cell.ix / kTile, cell.iy / kTile);
      (tile->state.*fault.value)[(cell.iy % kTile) * kTile + cell.ix % kTile] = fault.bad;
    }
    for (int n = 0; n < kCommitFrames; ++n) solver->Step(TipInput{}, 0.01f);
    return solver;
  };
  const auto healthy = run(false), spoilt = run(true);
  EXPECT_EQ(spoilt->field().quarantined(), 1u);
  // All other values are numbers, and far from the cell they differ only by the effect of its absence.
  const CellIndex cell = spoilt->field().sheet().CellOf({0.0072f, 0.0060f});
  for (const Tile* tile : spoilt->field().Existing()) {
    const Tile* other = healthy->field().Find(tile->tx, tile->ty);
    for (int k = 0; k < kTileCells; ++k) {
      const int ix = tile->tx * kTile + k % kTile, iy = tile->ty * kTile + k / kTile;
      const bool it = ix == cell.ix && iy == cell.iy;
      EXPECT_EQ((tile->state.flags[k] & kQuarantined) != 0, it);
      if (it) continue;
      const TileState& s = tile->state;
      ASSERT_TRUE(std::isfinite(s.enthalpy[k] + s.water[k] + s.omega_cell[k] + s.omega_collagen[k] + s.charred[k]));
      if (std::max(std::abs(ix - cell.ix), std::abs(iy - cell.iy)) > 15 && other != nullptr) {
        ASSERT_NEAR(tile->theta[ThetaIndex(k % kTile, k / kTile)], other->theta[ThetaIndex(k % kTile, k / kTile)],
                    1.0f);
      }
    }
  }
  EXPECT_TRUE(std::isfinite(spoilt->ledger().Out() + spoilt->ledger().joule));
  EXPECT_EQ(spoilt->topology().dead_edge_count(), healthy->topology().dead_edge_count());
}

INSTANTIATE_TEST_SUITE_P(Faults, BadCellTest,
                         ::testing::Values(Fault{"EnthalpyNan", &TileState::enthalpy, kNan},
                                           Fault{"EnthalpyInf", &TileState::enthalpy, kInf},
                                           Fault{"EnthalpyHuge", &TileState::enthalpy, -1e30f},
                                           Fault{"WaterNan", &TileState::water, kNan},

                                           Fault{"DeathNan", &TileState::omega_cell, kNan},
                                           Fault{"CollagenNan", &TileState::omega_collagen, kNan},
                                           Fault{"CollagenInf", &TileState::omega_collagen, kInf},
                                           Fault{"CharNan", &TileState::charred, kNan}),
                         [](const ::testing::TestParamInfo<Fault>& fault) { return fault.param.name; });

// theta = H / rc is 0 for infinite water.
INSTANTIATE_TEST_SUITE_P(Water, BadCellTest, ::testing::Values(Fault{"WaterInf", &TileState::water, kInf}));

TEST(StabilityTest, FieldOfNoNumbersIsTakenOutAndItsNeighboursLive) {
  HeatField field(MakeFlatSheet(9.6e-3f, 9.6e-3f, 1e-4f), MakeMaterial(ThermalParams{}));
  Fill(&field, [](double, double) { return 40.0; });
  Ledger ledger;
  Tile* tile = field.Find(1, 1);
  tile->state.enthalpy.fill(kNan);
  tile->state.water.fill(kNan);
  field.RefreshTheta(tile, &ledger);
  for (int n = 0; n < 20; ++n) field.Diffuse(0.01f, &ledger);
  EXPECT_EQ(field.quarantined(), static_cast<std::uint64_t>(kTileCells));
  ForCells(field, [&](double theta, double, double) {
    ASSERT_GT(theta, 0.0);
    ASSERT_LE(theta, 40.0);
  });
}

TEST(StabilityTest, MessageOfNoNumbersIsRefused) {
  const Sheet sheet = Small();
  const TipTracker tip(sheet, 5e-4f);
  CauteryContact good;
  good.touching = true;
  good.contact_radius_m = 5e-4f;
  good.material = {0.002f, 0.0015f};
  ASSERT_TRUE(tip.Accepts(good));
  for (const float bad : {kNan, kInf, -kInf, 1e30f, -1e30f}) {
    for (const auto& spoil : std::vector<std::function<void(CauteryContact*)>>{
             [&](CauteryContact* c) { c->material.x() = bad; }, [&](CauteryContact* c) { c->material.y() = bad; },
             [&](CauteryContact* c) { c->contact_radius_m = -std::abs(bad); }}) {
      CauteryContact contact = good;
      spoil(&contact);
      EXPECT_FALSE(tip.Accepts(contact)) << bad;
    }
  }
}

}  // namespace
}  // namespace fulcrum::thermal
