// What single strokes and touches of the hook do: blend opens, coag shrinks all along its way, long heat chars; events
// of a nerve are not those of a ureter; current on a stretched sheet.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <optional>

#include "tests/numerics/thermal/flat_scene.h"
#include "thermal_node/coupling/source_window.h"

namespace fulcrum::thermal {
namespace {

constexpr float kFrame_s = 0.01f;

/// Blend cuts as it is meant to: a stroke of 10 mm at 35 W and 4 mm/s is open over its length.
TEST(Strokes, BlendCuts) {
  const scene::SceneData data = FlatScene(31, 51, 1e-3f);
  ThermalSolver solver(data.View());
  Drag drag;
  drag.from = {0.0103f, 0.0102f};
  drag.to = {0.0203f, 0.0102f};
  drag.speed_m_s = 0.004f;
  drag.mode = CauteryMode::kBlend;
  RunDrag(drag, kFrame_s, &solver);
  for (int n = 0; n < 40; ++n) solver.Step(TipInput{}, kFrame_s);
  EXPECT_GT(solver.cut_length_m(), 0.009f);
  EXPECT_LT(solver.cut_length_m(), 0.012f);
}

/// Each tile is evaluated for its shrinking collagen, so no edge along a coagulated stroke of 62 mm (some 19 tiles) is
/// left as it was.
TEST(Strokes, CoagShrinksTheSheetAllAlongItsWay) {
  constexpr std::uint32_t kCols = 71, kRow = 15;
  const scene::SceneData data = FlatScene(31, kCols, 1e-3f);
  ThermalSolver solver(data.View());
  Drag drag;
  drag.from = {0.004f, 0.0152f};
  drag.to = {0.066f, 0.0152f};
  drag.speed_m_s = 0.008f;
  drag.mode = CauteryMode::kCoag;
  drag.power_W = 30;
  RunDrag(drag, kFrame_s, &solver);
  for (int n = 0; n < 30; ++n) solver.Step(TipInput{}, kFrame_s);
  for (std::uint32_t col = 7; col < 63; ++col) {
    EXPECT_GT(solver.topology().committed().shrink[3 * (kRow * kCols + col)], 0) << "edge from column " << col;
  }
}

/// Events of metal that stands still.
std::map<ThermalEventKind, int> EventsOfDwell(const scene::SceneData& data, float power_W, int frames) {
  ThermalSolver solver(data.View());
  std::map<ThermalEventKind, int> count;
  TipInput tip;
  tip.active = true;
  tip.path.from = tip.path.to = {0.0103f, 0.0101f};
  tip.path.radius_m = 5e-4f;
  tip.mode = CauteryMode::kCoag;
  tip.power_W = power_W;
  for (int n = 0; n < frames; ++n) {
    solver.Step(tip, kFrame_s);
    for (const SolverEvent& event : solver.events()) ++count[event.kind];
  }
  return count;
}

TEST(Strokes, AStructureIsCalledWhatItIs) {
  for (const ProtectedKind kind : {ProtectedKind::kUreter, ProtectedKind::kNerve}) {
    const bool nerve = kind == ProtectedKind::kNerve;
    scene::SceneData data = FlatScene(21, 21, 1e-3f);
    data.protected_structures = {{kind, 0.002f, 3e-4f, 0, 2}};
    data.protected_points = {{Vec3f::Zero(), Vec2f(0.002f, 0.01f)}, {Vec3f::Zero(), Vec2f(0.018f, 0.01f)}};
    auto count = EventsOfDwell(data, 15, 500);
    EXPECT_EQ(count[ThermalEventKind::kNerveWarning] > 0, nerve);
    EXPECT_EQ(count[ThermalEventKind::kNerveInjury] > 0, nerve);
    EXPECT_EQ(count[ThermalEventKind::kUreterWarning] > 0, !nerve);
    EXPECT_EQ(count[ThermalEventKind::kUreterInjury] > 0, !nerve);
  }
}

TEST(Strokes, ALongDwellOfCoagCharsOnce) {
  auto count = EventsOfDwell(FlatScene(21, 21, 1e-3f), 30, 500);
  EXPECT_EQ(count[ThermalEventKind::kChar], 1);
}

/// A disc of metal of 0.5 mm radius on a sheet whose rest shape is 25.6 mm square, flattened with its sides shortened
/// by `stretch`: the tissue and its current are the same.
struct DiscOnSheet {
  explicit DiscOnSheet(const Vec2f& stretch, float cell_m = 1e-4f, bool tented = true) : stretch_(stretch) {
    const Vec2f sides = 0.0256f * stretch.cwiseInverse();
    Sheet sheet = MakeFlatSheet(sides.x(), sides.y(), cell_m);
    SetMetric(&sheet, [&](const Vec2f&) {
      return SurfaceMetric{stretch.x() * stretch.x(), 0, stretch.y() * stretch.y()};
    });
    ThermalParams params;
    params.cell_m = cell_m;
    field.emplace(sheet, MakeMaterial(params));
    SourceWindow window(field->material(), field->sheet());
    middle_ = 0.5f * sides;
    TipPath path;
    path.from = path.to = middle_;
    path.radius_m = 5e-4f;
    path.tented = tented;
    const Drive drive{.power_W = 0.5f, .v_max_V = 350, .i_max_A = 2, .remove_theta = 1e3f, .arc_m = 0};
    window.Run(&*field, path, drive, 1e-3f, &ledger_);
    window.DepositFar(&*field, false, &ledger_);
    conductance_S = static_cast<double>(window.stats().current_A / window.stats().voltage_V);
  }
  /// Warming at a place relative to the middle, in metres of the rest shape, from the four cells around it.
  [[nodiscard]] double Around(float ds, float dt) const {
    double sum = 0;
    for (const auto& [i, j] : {std::pair{-1, -1}, {-1, 1}, {1, -1}, {1, 1}}) {
      const Vec2f off(5e-5f * static_cast<float>(i), 5e-5f * static_cast<float>(j));
      const CellIndex cell = field->sheet().CellOf(middle_ + Vec2f(ds, dt).cwiseQuotient(stretch_) + off);
      const Tile* const tile = field->Find(cell.ix / kTile, cell.iy / kTile);
      sum +=
          tile == nullptr ? 0 : 0.25 * static_cast<double>(tile->theta[ThetaIndex(cell.ix % kTile, cell.iy % kTile)]);
    }
    return sum;
  }
  std::optional<HeatField> field;
  double conductance_S = 0;

 private:
  Vec2f stretch_;
  Vec2f middle_ = Vec2f::Zero();
  Ledger ledger_;
};

TEST(StretchedSheet, CurrentSpreadsAlikeInAllDirectionsOfTheRestShape) {
  for (const float stretch : {1.0f, 2.0f}) {
    const DiscOnSheet disc(Vec2f(stretch, 1));
    constexpr float kBeside_m = 2e-3f;
    ASSERT_GT(disc.Around(0, kBeside_m), 0);
    EXPECT_NEAR(disc.Around(kBeside_m, 0) / disc.Around(0, kBeside_m), 1, 0.1) << stretch;
  }
}

/// At 5 mm both places are beyond the window; one is 7.1 mm away in material space, the other 3.6.
TEST(StretchedSheet, HeatBeyondTheWindowIsAlikeInAllDirectionsOfTheRestShape) {
  for (const bool tented : {true, false}) {
    const DiscOnSheet disc(Vec2f(0.7f, 1.4f), 1e-4f, tented);
    constexpr float kBeside_m = 5e-3f;
    ASSERT_GT(disc.Around(0, kBeside_m), 0);
    EXPECT_NEAR(disc.Around(kBeside_m, 0) / disc.Around(0, kBeside_m), 1, 0.3) << tented;
  }
}

/// Cells that are 0.2 mm wide, and 0.2 or 0.1 mm long, on the rest shape.
TEST(StretchedSheet, MetalMeetsTheSameConductance) {
  for (const bool tented : {true, false}) {
    const DiscOnSheet coarse(Vec2f(1, 1), 2e-4f, tented), fine(Vec2f(1, 1), 1e-4f, tented);
    const DiscOnSheet both(Vec2f(2, 2), 1e-4f, tented), one(Vec2f(2, 1), 1e-4f, tented);
    EXPECT_NEAR(both.conductance_S / coarse.conductance_S, 1, 0.03) << tented;
    EXPECT_NEAR(one.conductance_S / fine.conductance_S, 1, 0.04) << tented;
  }
}

}  // namespace
}  // namespace fulcrum::thermal
