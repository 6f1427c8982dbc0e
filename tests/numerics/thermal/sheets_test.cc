// Sheets with their own thickness, conductivities and support, in one scene.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "services/base/core/error.h"
#include "tests/numerics/thermal/flat_sheets.h"
#include "tests/numerics/thermal/heat_cases.h"
#include "tests/numerics/thermal/topology_validator.h"
#include "thermal_node/coupling/band_field.h"
#include "thermal_node/heat/sheet_materials.h"

namespace fulcrum::thermal {
namespace {

constexpr float kDt = 0.01f;
constexpr float kPlace_m = 0.0256f;  ///< Of a second sheet in the atlas.
constexpr SheetHeat kThin{1.5e-4f, 0, 0}, kFat{6e-4f, 0, 0};

ThermalParams Lossless() {
  ThermalParams params;
  params.h_top_W_m2K = params.h_below_W_m2K = params.h_tented_W_m2K = params.perfusion_per_s = 0;
  return params;
}

/// Two sheets of 16 x 16 mm in places of their own.
scene::SceneData Two(const FlatSheet& first, const FlatSheet& second, const ThermalParams& params = {}) {
  std::array<FlatSheet, 2> sheets{first, second};
  for (FlatSheet& sheet : sheets) sheet.rows = sheet.cols = 17;
  sheets[1].x_m = kPlace_m;
  scene::SceneData data = FlatSheets(sheets, 1e-3f);
  data.fixed.thermal = params;
  return data;
}
/// The field of a scene; it refers to nothing of it.
HeatField FieldOf(const scene::SceneData& data) {
  const SceneView scene = data.View();
  return {MakeSheet(scene), MakeMaterials(scene, scene.thermal, MakeMaterial)};
}
bool IsOnSecond(double x) { return x > 0.02; }

struct Sums {
  double first = 0, second = 0;
};
/// Heat [J] of either sheet.
Sums HeatOf(const HeatField& field) {
  Sums sums;
  for (const Tile* tile : field.awake()) {
    const Vec2f at = field.sheet().CentreOf({tile->tx * kTile, tile->ty * kTile});
    (IsOnSecond(static_cast<double>(at.x())) ? sums.second : sums.first) += tile->Heat();
  }
  return sums;
}

Drag Across(float x_m, float length_m = 0.008f, float speed_m_s = 0.006f) {
  Drag drag;
  drag.from = {x_m + 0.00403f, 0.00807f};
  drag.to = drag.from + Vec2f(length_m, 0);
  drag.speed_m_s = speed_m_s;
  return drag;
}

TEST(SheetsTest, TwiceTheThicknessTakesTwiceTheHeat) {
  const scene::SceneData data = Two({.heat = {3e-4f, 0, 0}}, {.heat = {6e-4f, 0, 0}}, Lossless());
  HeatField field = FieldOf(data);
  ASSERT_EQ(field.materials().size(), 2u);
  Fill(&field, [](double, double) { return 40.0; });
  const Sums before = HeatOf(field);
  const double per_area = static_cast<double>(field.material().rc_wet) * 40 * 3e-4;
  EXPECT_NEAR(before.first, per_area * 0.016 * 0.016, 0.01 * before.first);
  EXPECT_NEAR(before.second, 2 * before.first, 1e-6 * before.second);
  Ledger ledger;
  for (int n = 0; n < 50; ++n) field.Diffuse(kDt, &ledger);
  EXPECT_NEAR(HeatOf(field).second, before.second, 1e-6 * before.second);
}

/// A hot hook gives the same power to both, so the thick one warms half as fast.
TEST(SheetsTest, AHotHookWarmsTheThickOneHalfAsFast) {
  const scene::SceneData data = Two({.heat = {3e-4f, 0, 0}}, {.heat = {6e-4f, 0, 0}}, Lossless());
  std::array<float, 2> hottest{};
  for (int n = 0; n < 2; ++n) {
    ThermalSolver solver(data.View());
    Interface hook;
    hook.hook_theta = 50;
    solver.source()->SetInterface(hook);
    TipInput tip;
    tip.touching = true;
    tip.path.from = tip.path.to = {0.00803f + (n == 1 ? kPlace_m : 0), 0.00807f};
    tip.path.radius_m = 5e-4f;
    solver.Step(tip, 1e-3f);
    hottest[static_cast<std::size_t>(n)] = solver.field().MaxTheta();
  }
  EXPECT_GT(hottest[0], 0.5f);
  EXPECT_NEAR(hottest[1] / hottest[0], 0.5f, 0.01f);
}

/// Between a column held at 40 K and one at 0 K flows k d w / L of it, with the k and d of each.
TEST(SheetsTest, ConductSteadilyByTheirOwnConductivityAndThickness) {
  struct Case {
    SheetHeat heat;
    bool second;
  };
  const SheetHeat thin{1.5e-4f, 0.9f, 0}, fat{6e-4f, 0.3f, 0};
  std::array<FlatSheet, 2> sheets{FlatSheet{.rows = 5, .cols = 9, .heat = thin},
                                  FlatSheet{.rows = 5, .cols = 9, .x_m = kPlace_m, .heat = fat}};
  scene::SceneData data = FlatSheets(sheets, 1e-3f);  // 8 x 4 mm
  data.fixed.thermal = Lossless();
  for (const Case& one : {Case{thin, false}, Case{fat, true}}) {
    HeatField field = FieldOf(data);
    const Sheet& sheet = field.sheet();
    const float rc = field.material().rc_wet;
    const int hot = sheet.CellOf({one.second ? kPlace_m : 0.0f, 0}).ix + 20, cold = hot + 20;
    Ledger ledger;
    /// Sets the cells up to `hot` and from `cold` on; returns the heat that the cold ones had taken [J].
    const auto hold = [&] {
      double taken = 0;
      for (int iy = 0; iy < sheet.ny; ++iy) {
        for (int ix = one.second ? hot - 20 : 0; ix < (one.second ? sheet.nx : cold + 40); ++ix) {
          Tile* tile = field.Wake(ix / kTile, iy / kTile);
          const int k = iy % kTile * kTile + ix % kTile;
          if ((ix > hot && ix < cold) || (tile->state.flags[k] & kNoTissue) != 0) continue;
          if (ix >= cold) taken += static_cast<double>(tile->state.enthalpy[k]) * tile->Volume(k);
          tile->state.enthalpy[k] = ix <= hot ? 40 * rc : 0;
        }
      }
      for (Tile* tile : field.awake()) field.RefreshTheta(tile, &ledger);
      return taken;
    };
    double taken = 0;
    for (int n = 0; n < 6000; ++n) {
      (void)hold();
      field.Diffuse(kDt, &ledger);
      if (n >= 5000) taken += hold();
    }
    const auto k = static_cast<double>(one.heat.conductivity_W_mK), d = static_cast<double>(one.heat.thickness_m);
    const double expected = k * d * 4e-3 * 40 / 2e-3;  // between the middles of the cells that are held
    EXPECT_NEAR(taken / (1000 * kDt), expected, 0.01 * expected) << k;
  }
}

TEST(SheetsTest, ABandHasTheResistanceOfAStrip) {
  const ThermalParams params;
  for (const SheetHeat& heat : {SheetHeat{3e-4f, 0, 0}, SheetHeat{6e-4f, 0, 0}, SheetHeat{3e-4f, 0, 0.7f}}) {
    for (const float at_m : {0.012f, 0.006f, 0.002f}) {
      const double measured = BandResistance(params, heat, 0.003f, 0.024f, at_m, 5e-4f);
      const double exact = StripResistance(params, heat, 0.003, 0.024, static_cast<double>(at_m), 5e-4);
      EXPECT_NEAR(measured, exact, 0.03 * exact) << heat.thickness_m << " " << heat.sigma_S_m << " " << at_m;
    }
  }
  const double thin = BandResistance(params, {3e-4f, 0, 0}, 0.003f, 0.024f, 0.012f, 5e-4f);
  EXPECT_NEAR(BandResistance(params, {6e-4f, 0, 0}, 0.003f, 0.024f, 0.012f, 5e-4f) / thin, 0.5, 0.02);
}

/// All that enters a band heats it: nothing leaks, and what flows beyond the window is put along the strip.
TEST(SheetsTest, TheWholeBandTakesThePower) {
  const scene::SceneData data = OneSheet({.rows = 49, .cols = 17, .over = kNoIndex}, 5e-4f);  // 8 x 24 mm
  HeatField field = FieldOf(data);
  SourceWindow window(field.materials(), field.sheet());
  TipPath path;
  path.from = path.to = {0.004f, 0.010f};
  path.radius_m = 5e-4f;
  Ledger ledger;
  window.Run(&field, path, {.power_W = 1, .v_max_V = 350, .i_max_A = 2, .remove_theta = 1e3f, .arc_m = 0}, 1e-3f,
             &ledger);
  const double within = ledger.joule;
  window.DepositFar(&field, false, &ledger);
  EXPECT_GT(ledger.joule, 1.2 * within) << "a strip's resistance beyond the window is no trifle";
  EXPECT_NEAR(ledger.joule, ledger.generator, 0.02 * ledger.generator);
  EXPECT_EQ(window.stats().leak_J, 0);
  // Up to the ends, evenly beyond a width of the metal.
  double near = 0, far = 0;
  int of_near = 0, of_far = 0;
  ForCells(field, [&](double theta, double, double y) {
    if (y > 0.018 && y < 0.020) near += theta, ++of_near;
    if (y > 0.021 && y < 0.023) far += theta, ++of_far;
  });
  EXPECT_GT(far, 0);
  EXPECT_NEAR(far / of_far, near / of_near, 0.1 * near / of_near);
}

/// The field of a strip against differences: it solves the equation, and its sides and ends are as they should be.
TEST(SheetsTest, TheFieldOfABandIsHarmonic) {
  const Band band{.low = {0.001f, 0.002f}, .size = {0.015f, 0.025f}};
  const Vec2f metal(0.005f, 0.010f);
  const BandField field(band, metal);
  for (const Vec2f& at : {Vec2f(0.0125f, 0.014f), Vec2f(0.003f, 0.020f), Vec2f(0.009f, 0.004f)}) {
    // V from its slopes: d(ln V)/dn; the divergence of the gradient, which is V times the slopes, must vanish.
    const float h = 2e-4f;
    const auto slope = [&](const Vec2f& p, const Vec2f& n) {
      return static_cast<double>(field.SlopeAt(p, n) - field.SlopeAt(p, -n));
    };
    const Vec2f ex = Vec2f::UnitX(), ey = Vec2f::UnitY();
    // grad V / V = -g; div grad V / V = |g|^2 - div g = 0.
    const double gx = slope(at, ex), gy = slope(at, ey);
    const double div =
        (slope(at + h * ex, ex) - slope(at - h * ex, ex) + slope(at + h * ey, ey) - slope(at - h * ey, ey)) /
        (2 * static_cast<double>(h));
    EXPECT_NEAR(div, gx * gx + gy * gy, 0.01 * (std::abs(div) + gx * gx + gy * gy));
    EXPECT_GT(field.DensityAt(at), 0.0f);
  }
  EXPECT_LT(field.SlopeAt({0.001f, 0.018f}, -Vec2f::UnitX()), 1e-3f) << "a free side";
  EXPECT_GT(field.SlopeAt({0.008f, 0.0265f}, Vec2f::UnitY()), 1000.0f) << "V falls to 0 at the end";
  EXPECT_EQ(field.DensityAt({0.0005f, 0.010f}), 0) << "beside the band";
}

TEST(SheetsTest, AFreeBandKeepsHeatLonger) {
  ThermalParams params;
  params.perfusion_per_s = 0;
  params.h_tented_W_m2K = params.h_top_W_m2K;
  const scene::SceneData data = Two({.over = kNoIndex}, {.over = 0}, params);
  HeatField field = FieldOf(data);
  ASSERT_TRUE(field.materials()[0].spanned);
  ASSERT_FALSE(field.materials()[1].spanned);
  Fill(&field, [](double, double) { return 20.0; });
  Ledger ledger;
  for (int n = 0; n < 300; ++n) field.Diffuse(kDt, &ledger);
  const double rc_d = static_cast<double>(field.material().rc_wet) * 3e-4;
  const double free = 20 * std::exp(-3.0 * 2 * 25 / rc_d), on_fat = 20 * std::exp(-3.0 * (25 + 350) / rc_d);
  ForCells(field,
           [&](double theta, double x, double) { ASSERT_NEAR(theta, IsOnSecond(x) ? on_fat : free, 2e-3 * free); });
}

/// Time until the hook that stands still opens the sheet, at a power that does not reach the generator's limits.
int FramesToOpen(const SheetHeat& heat) {
  ThermalParams params;
  const scene::SceneData data = Two({.heat = heat}, {.over = kNoIndex}, params);
  ThermalSolver solver(data.View());
  TipInput tip = Across(0).At(0, kDt);
  tip.path.to = tip.path.from = {0.00803f, 0.00807f};
  tip.power_W = 3;
  tip.mode = CauteryMode::kCut;
  constexpr float kShort = 1e-3f;
  for (int n = 0; n < 20000; ++n) {
    solver.Step(tip, kShort);
    if (solver.source_stats().removed_cells > 0) return n;
  }
  return -1;
}

/// The heat of a sheet goes with its thickness, and so does the time to boil it at one power; what conduction and the
/// leak to the fat take makes the thick one slower still.
TEST(SheetsTest, TimeToOpenGrowsWithTheThickness) {
  const int thin = FramesToOpen(kThin), usual = FramesToOpen({3e-4f, 0, 0}), fat = FramesToOpen(kFat);
  ASSERT_GT(thin, 0);
  EXPECT_GT(usual, 1.6 * thin);
  EXPECT_GT(fat, 1.6 * usual);
  EXPECT_LT(usual, 3.0 * thin);
}

struct Burnt {
  scene::SceneData data;
  SceneView scene;
  std::vector<Drag> drags;
  /// First one sheet, then the other, then they cool.
  void Step(int frame, ThermalSolver* solver) const {
    const int first = drags[0].frames(kDt), second = drags[1].frames(kDt);
    if (frame < first) return solver->Step(drags[0].At(frame, kDt), kDt);
    if (frame < first + second) return solver->Step(drags[1].At(frame - first, kDt), kDt);
    solver->Step(TipInput{}, kDt);
  }
  [[nodiscard]] int frames() const { return drags[0].frames(kDt) + drags[1].frames(kDt) + 40; }
};

/// A thin sheet on fat and a thick band, cut in turn.
class TwoBurnt : public testing::TestWithParam<bool> {
 protected:
  TwoBurnt() {
    ThermalParams params;
    params.volume = GetParam() ? 1 : 0;
    burnt_.data = Two({.over = 0, .heat = kThin}, {.over = kNoIndex, .heat = kFat}, params);
    burnt_.scene = burnt_.data.View();
    burnt_.drags = {Across(0, 0.005f), Across(kPlace_m, 0.005f, 0.004f)};
    burnt_.drags[1].tented = true;
  }
  Burnt burnt_;
};

TEST_P(TwoBurnt, KeepTheEnergyAndAMeshThatAgreesWithTheCells) {
  ThermalSolver solver(burnt_.scene);
  TopologyValidator validator(burnt_.scene, solver.field().sheet());
  for (int frame = 0; frame < burnt_.frames(); ++frame) {
    burnt_.Step(frame, &solver);
    ASSERT_EQ(validator.Check(solver), "") << frame;
    ASSERT_LT(solver.ledger().ClosureError(solver.field().Stored()), 1e-4) << frame;
    if (solver.volume() != nullptr) {
      ASSERT_LT(solver.volume()->ledger().ClosureError(solver.volume()->Stored()), 1e-3) << frame;
    }
  }
  EXPECT_GT(solver.cut_length_m(), 0.006f) << "both are cut";
  EXPECT_EQ(solver.field().quarantined(), 0u);
}

TEST_P(TwoBurnt, GoOnFromACheckpointWithTheSameBits) {
  std::vector<std::byte> slot(ThermalSolver::CheckpointCapacity(burnt_.scene));
  ThermalSolver whole(burnt_.scene), again(burnt_.scene);
  std::size_t size = 0;
  const int middle = burnt_.frames() / 2;
  for (int frame = 0; frame < burnt_.frames(); ++frame) {
    burnt_.Step(frame, &whole);
    burnt_.Step(frame, &again);
    ASSERT_EQ(again.FullHash(), whole.FullHash()) << "twice the same, frame " << frame;
    if (frame >= middle && size == 0 && (size = whole.Save(slot)) > 0) {
      ThermalSolver restored(burnt_.scene);
      ASSERT_TRUE(restored.Restore(std::span(slot).first(size)));
      for (int rest = frame + 1; rest < burnt_.frames(); ++rest) burnt_.Step(rest, &restored);
      slot.resize(sizeof(std::uint64_t));
      const std::uint64_t end = restored.FullHash();
      std::memcpy(slot.data(), &end, sizeof(end));
    }
  }
  ASSERT_GT(size, 0u);
  std::uint64_t end = 0;
  std::memcpy(&end, slot.data(), sizeof(end));
  EXPECT_EQ(end, whole.FullHash());
}

INSTANTIATE_TEST_SUITE_P(Sheets, TwoBurnt, testing::Values(false, true),
                         [](const auto& with) { return with.param ? "WithVolume" : "Sheets"; });

/// The two are nearer than a tile in this atlas; the burn at the border of one must not reach the other.
TEST(SheetsTest, NeitherHeatNorCurrentPassesToAnother) {
  std::array<FlatSheet, 2> sheets{FlatSheet{.rows = 17, .cols = 23, .heat = kThin},
                                  FlatSheet{.rows = 17, .cols = 17, .x_m = 0.02245f, .heat = kFat}};
  const scene::SceneData both = FlatSheets(sheets, 1e-3f), alone = OneSheet(sheets[0], 1e-3f);
  ThermalSolver solver(both.View()), one(alone.View());
  Drag drag;
  drag.from = {0.02103f, 0.00503f};
  drag.to = {0.02163f, 0.01003f};
  drag.speed_m_s = 0.005f;
  for (int frame = 0; frame < drag.frames(kDt) + 200; ++frame) {
    const TipInput tip = frame < drag.frames(kDt) ? drag.At(frame, kDt) : TipInput{};
    solver.Step(tip, kDt);
    one.Step(tip, kDt);
  }
  EXPECT_GT(solver.cut_length_m(), 0.003f);
  for (const Tile* tile : solver.field().Existing()) {
    EXPECT_LT(tile->tx, 7) << "a tile of the other sheet was touched";
  }
  EXPECT_NEAR(solver.ledger().joule, one.ledger().joule, 1e-3 * one.ledger().joule);
  EXPECT_EQ(solver.cut_length_m(), one.cut_length_m());
}

TEST(SheetsTest, ThoseOfOneKindShareAMaterialAndBandsDoNot) {
  const std::array<FlatSheet, 4> sheets{
      FlatSheet{.rows = 5, .cols = 5}, FlatSheet{.rows = 5, .cols = 5, .x_m = kPlace_m, .over = kNoIndex},
      FlatSheet{.rows = 5, .cols = 5, .x_m = 2 * kPlace_m},
      FlatSheet{.rows = 5, .cols = 5, .x_m = 3 * kPlace_m, .over = kNoIndex, .heat = {0, 0, 0.2f}}};
  const scene::SceneData data = FlatSheets(sheets, 1e-3f);
  EXPECT_EQ(MaterialOfSheets(data.View()), (std::vector<std::uint8_t>{0, 1, 0, 2}));
  const HeatField field = FieldOf(data);
  EXPECT_EQ(field.materials()[2].sigma, 0.2f);
  EXPECT_EQ(field.materials()[2].leak_S_m2, 0);
  EXPECT_GT(field.materials()[0].leak_S_m2, 0);
  ASSERT_EQ(field.sheet().bands.size(), 2u);
  EXPECT_NEAR(field.sheet().bands[0].low.x(), kPlace_m, 1e-6f);
  EXPECT_NEAR(field.sheet().bands[0].size.y(), 4e-3f, 1e-6f);
  EXPECT_EQ(field.sheet().bands[0].ends.size(), 80u) << "forty cells at each end";
}

TEST(SheetsTest, BadOnesAreRefused) {
  const auto refusal = [](const std::function<void(scene::SceneData*)>& change) -> std::string {
    scene::SceneData data = Two({.over = 0}, {.over = 0, .heat = kFat});
    change(&data);
    try {
      const ThermalSolver solver(data.View());
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(refusal([](scene::SceneData*) {}), "");
  EXPECT_NE(refusal([](scene::SceneData* d) {
              d->sheets[1].thickness_m = 0.3f;
            }).find("sheet 'sheet 2': thermal.thickness_mm is 300"),
            std::string::npos);
  EXPECT_NE(refusal([](scene::SceneData* d) { d->sheets[1].sigma_S_m = 50; }).find("thermal.sigma_S_m is 50"),
            std::string::npos);
  EXPECT_NE(refusal([](scene::SceneData* d) {
              d->fixed.thermal.cell_m = 1e-3f;
            }).find("sheet 'sheet 2' shares a tile of 32 cells"),
            std::string::npos);
}

}  // namespace
}  // namespace fulcrum::thermal
