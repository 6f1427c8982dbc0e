// Heat, water, damage and depth in absolute figures from literature, not from the constants of the code: a constant
// that is changed by mistake is noticed.
#include <gtest/gtest.h>

#include <cmath>
#include <tuple>
#include <vector>

#include "tests/numerics/thermal/flat_scene.h"
#include "tests/numerics/thermal/heat_cases.h"
#include "thermal_node/coupling/film.h"
#include "thermal_node/coupling/generator.h"
#include "thermal_node/damage/arrhenius.h"
#include "thermal_node/heat/heat_field.h"
#include "thermal_node/protected/protected_structures.h"

namespace fulcrum::thermal {
namespace {

/// Collagen denatures after 115 s at 65 C, 24 s at 70 C and 1.1 s at 80 C (Pearce and Thomsen 1995, A = 1.606e45 1/s,
/// Ea = 306 kJ/mol).
TEST(ThermalAnchors, TimesToTheDenaturationOfCollagen) {
  const DamageRate rate(kCollagen, 37);
  EXPECT_NEAR(1 / rate.At(28), 115.4, 3);
  EXPECT_NEAR(1 / rate.At(33), 23.6, 0.6);
  EXPECT_NEAR(1 / rate.At(43), 1.13, 0.03);
}

/// A second at 80 C in a tile: collagen by the above, cell death at its limit, no char in wet tissue.
TEST(ThermalAnchors, ASecondAtEightyDegrees) {
  HeatField field(MakeFlatSheet(3.2e-3f, 3.2e-3f, 1e-4f), MakeMaterial(ThermalParams{}));
  Fill(&field, [](double, double) { return 43.0; });
  Tile* const tile = field.Find(0, 0);
  const DamageModel damage(37);
  for (int n = 0; n < 100; ++n) ASSERT_TRUE(damage.Update(tile, 0.01f));
  EXPECT_NEAR(tile->state.omega_collagen[500], 0.8825, 0.02);
  EXPECT_GT(tile->state.omega_cell[500], 10);
  EXPECT_EQ(tile->state.charred[500], 0);
}

/// Char begins at 180 C and grows by 0.05 per kelvin and second (DESIGN, assumed): 100 K above, half in 0.1 s.
TEST(ThermalAnchors, ATenthOfASecondAt280DegreesCharsDryTissueByHalf) {
  HeatField field(MakeFlatSheet(3.2e-3f, 3.2e-3f, 1e-4f), MakeMaterial(ThermalParams{}));
  Tile* const tile = field.Wake(0, 0);
  tile->state.water.fill(0);
  for (float& h : tile->state.enthalpy) h = 243 * field.material().HeatCapacity(0);
  Ledger ledger;
  field.RefreshTheta(tile, &ledger);
  const DamageModel damage(37);
  for (int n = 0; n < 10; ++n) ASSERT_TRUE(damage.Update(tile, 0.01f));
  EXPECT_NEAR(tile->state.charred[500], 0.5, 0.005);
}

/// Blend is on during 64 % of the time: 0.8 of the generator's 350 V rms over the period. It bursts dry tissue above
/// 130 C and is a waveform that sparks across steam; coag does neither.
TEST(ThermalAnchors, BlendIsAnInterruptedCut) {
  const Drive blend = MakeDrive(ThermalParams{}, CauteryMode::kBlend, 35);
  EXPECT_NEAR(blend.v_max_V, 280, 0.5);
  EXPECT_NEAR(blend.remove_theta, 93, 0.1);
  EXPECT_TRUE(blend.discharges);
  EXPECT_FALSE(MakeDrive(ThermalParams{}, CauteryMode::kCoag, 35).discharges);
}

/// 200 V peak is the least voltage of an arc to tissue (manual of the Erbe VIO). 10 mm of steel wire 1 mm thick, of
/// 7900 kg/m^3 and 500 J/kgK.
TEST(ThermalAnchors, FilmAndHook) {
  EXPECT_NEAR(kStrike_V * std::sqrt(2.0), 200, 1);
  EXPECT_NEAR(kHookHeatCapacity_J_K, 7900 * 500 * 0.25 * 3.14159 * 1e-6 * 0.01, 0.002);
  EXPECT_LT(kTissueShare + kMetalShare, 1) << "the plume takes a part";
}

/// Serosa is 70 % water: 0.7 * 1050 kg/m^3 * 2.257 MJ/kg. Heat capacity of soft tissue 3.4 kJ/kgK.
TEST(ThermalAnchors, HeatToDryAMillimetreCubed) {
  const Material material = MakeMaterial(ThermalParams{});
  EXPECT_NEAR(material.latent / (0.7 * 1050 * 2.257e6), 1, 0.05);
  EXPECT_NEAR(material.BoilingEnthalpy(1) / (1050 * 3400 * 63.0), 1, 0.02);
  EXPECT_NEAR((material.BoilingEnthalpy(1) + material.latent) * 1e-9, 1.83, 0.05) << "J/mm^3";
}

/// A sheet of 0.3 mm with 25 W/m^2K above and 350 below cools with a time constant of 1050 * 3400 * 0.3 mm / 375 W/m^2K
/// = 2.9 s; without its faces by perfusion alone, 0.002/s of blood with 4.0 MJ/m^3K, in 446 s.
TEST(ThermalAnchors, CoolsThroughItsFacesAndByPerfusion) {
  const auto left_after = [](const ThermalParams& params, double seconds) {
    HeatField field(MakeFlatSheet(3.2e-3f, 3.2e-3f, 1e-4f), MakeMaterial(params));
    Fill(&field, [](double, double) { return 20.0; });
    Ledger ledger;
    for (int n = 0; n < std::lround(100 * seconds); ++n) field.Diffuse(0.01f, &ledger);
    const Tile* const tile = field.Find(0, 0);
    return static_cast<double>(tile->theta[ThetaIndex(16, 16)]) / 20;
  };
  EXPECT_NEAR(left_after(ThermalParams{}, 2), std::exp(-2 / 2.84), 0.01);
  ThermalParams insulated;
  insulated.h_top_W_m2K = insulated.h_below_W_m2K = 0;
  EXPECT_NEAR(left_after(insulated, 30), std::exp(-30 / 446.0), 0.002);
}

/// Lifted off the fat by the tool the same sheet has 25 W/m^2K above and 20 below, and blood: 22.6 s.
TEST(ThermalAnchors, CoolsSlowlyWhereItIsTented) {
  HeatField field(MakeFlatSheet(3.2e-3f, 3.2e-3f, 1e-4f), MakeMaterial(ThermalParams{}));
  Fill(&field, [](double, double) { return 20.0; });
  Tile* const tile = field.Find(0, 0);
  tile->state.tented = 1;
  Ledger ledger;
  for (int n = 0; n < 200; ++n) field.Diffuse(0.01f, &ledger);
  const double loss_W_m3K = (25 + 20) / 3e-4 + 0.002 * 4.0e6;
  EXPECT_NEAR(static_cast<double>(tile->theta[ThetaIndex(16, 16)]) / 20, std::exp(-2 * loss_W_m3K / (1050 * 3400)),
              0.01);
}

/// Heat reaches a structure at 1 mm through fat (9.8e-8 m^2/s) with a time constant of 5.1 s, and 83 % of it
/// (attenuation over 5.4 mm); at 3 mm with 46 s, and 57 %.
TEST(ThermalAnchors, AStructureWarmsByItsDepth) {
  for (const auto& [depth_m, time_s, share] : {std::tuple(1e-3f, 5.1, 0.83), std::tuple(3e-3f, 45.9, 0.574)}) {
    scene::SceneData data = FlatScene(21, 21, 1e-3f);
    data.protected_structures = {{ProtectedKind::kUreter, 0.002f, depth_m, 0, 2}};
    data.protected_points = {{Vec3f::Zero(), Vec2f(0.002f, 0.01f)}, {Vec3f::Zero(), Vec2f(0.018f, 0.01f)}};
    const SceneView scene = data.View();
    HeatField field(MakeSheet(scene), MakeMaterial(scene.thermal));
    Fill(&field, [](double, double) { return 5.0; });
    ProtectedStructures structures(scene, field);
    std::vector<ProtectedAlarm> alarms;
    const DamageRate cell_death(kCellDeath, 37);
    for (int n = 0; n < 100; ++n) {
      structures.Update(field, nullptr, cell_death, static_cast<float>(time_s / 100), &alarms);
    }
    const ProtectedSample& middle = structures.samples()[structures.samples().size() / 2];
    EXPECT_NEAR(middle.theta, share * 5 * (1 - std::exp(-1.0)), 0.1) << depth_m;
  }
}

/// The solver looks at the structures once in several frames; they get all of the time between.
TEST(ThermalAnchors, AStructureWarmsAsFastInTheSolver) {
  scene::SceneData data = FlatScene(21, 21, 1e-3f);
  data.fixed.thermal.h_top_W_m2K = data.fixed.thermal.h_below_W_m2K = data.fixed.thermal.perfusion_per_s = 0;
  data.protected_structures = {{ProtectedKind::kUreter, 0.002f, 1e-3f, 0, 2}};
  data.protected_points = {{Vec3f::Zero(), Vec2f(0.002f, 0.01f)}, {Vec3f::Zero(), Vec2f(0.018f, 0.01f)}};
  ThermalSolver solver(data.View());
  Fill(solver.mutable_field(), [](double, double) { return 5.0; });
  for (int n = 0; n < 510; ++n) solver.Step(TipInput{}, 0.01f);
  const auto samples = solver.protected_structures().samples();
  EXPECT_NEAR(samples[samples.size() / 2].theta, 0.83 * 5 * (1 - std::exp(-1.0)), 0.1);
}

}  // namespace
}  // namespace fulcrum::thermal
