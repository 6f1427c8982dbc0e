// Smaller parts of the thermal solver: tip, damage, protected structures, patches.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <utility>

#include "services/base/core/error.h"
#include "tests/numerics/thermal/flat_scene.h"
#include "thermal_node/coupling/electrode.h"
#include "thermal_node/coupling/film.h"
#include "thermal_node/coupling/patch.h"
#include "thermal_node/coupling/tip_tracker.h"

namespace fulcrum::thermal {
namespace {

TEST(SheetTest, CellsOutsideTheMembraneAreNoTissue) {
  scene::SceneData data = FlatScene(11, 11, 1e-3f);
  for (Vec2f& p : data.membrane_material) p.x() += 0.5f * p.y();  // a sheared sheet
  const Sheet sheet = MakeSheet(data.View());
  EXPECT_TRUE(sheet.OnSheet({0.005f, 0.005f}));
  EXPECT_FALSE(sheet.OnSheet({0.001f, 0.009f}));
  EXPECT_FALSE(sheet.OnSheet({0.014f, 0.001f}));
  EXPECT_FALSE(sheet.OnSheet({NAN, 0.001f}));
  EXPECT_FALSE(sheet.OnSheet({1e9f, 0.001f}));
}

TEST(SheetTest, ASceneWithoutMembraneHasNoCellsAndABadOneIsRefused) {
  scene::SceneData data;
  EXPECT_EQ(MakeSheet(data.View()).tile_count(), 0);
  data.fixed.membrane.rows = data.fixed.membrane.cols = 5;  // Without nodes.
  EXPECT_THROW((void)MakeSheet(data.View()), InputError);
  data = FlatScene(5, 5, 1e-3f);
  data.membrane_material[3].x() = NAN;
  EXPECT_THROW((void)MakeSheet(data.View()), InputError);
  data = FlatScene(5, 5, 1.0f);  // a sheet of 4 m
  EXPECT_THROW((void)MakeSheet(data.View()), InputError);
}

class TipTest : public ::testing::Test {
 protected:
  static constexpr double kFrame_s = 0.01;
  [[nodiscard]] static CauteryContact At(float s, float t, double time_s = 1.0) {
    CauteryContact contact;
    contact.session_time_s = time_s;
    contact.touching = true;
    contact.contact_radius_m = 5e-4f;
    contact.material = {s, t};
    return contact;
  }
  /// The same with a footprint of three by four cells.
  [[nodiscard]] static CauteryContact MetalAt(float s, float t, double time_s = 1.0) {
    CauteryContact contact = At(s, t, time_s);
    contact.footprint = {static_cast<std::int32_t>(1e4f * s) - 1, static_cast<std::int32_t>(1e4f * t) - 2, 3, {}};
    for (int n = 0; n < 12; ++n) contact.footprint.gap.push_back(static_cast<std::uint8_t>(10 * n));
    return contact;
  }
  static constexpr GeneratorDemand kCuts{CauteryMode::kCut, 35};
  [[nodiscard]] TipInput Advance(const CauteryContact& contact, const GeneratorDemand& demand = kCuts) {
    return tip_.Advance(contact, demand, kFrame_s);
  }

  Sheet sheet_ = MakeFlatSheet(0.02f, 0.02f, 1e-4f);
  TipTracker tip_{sheet_, 5e-4f};
};

TEST_F(TipTest, PathsOfSuccessiveSamplesJoin) {
  // At 0.25 m/s, which is fast but no jump, and then slower.
  const CauteryContact a = At(0.005f, 0.01f, 1.00), b = At(0.0075f, 0.01f, 1.01), c = At(0.0079f, 0.0102f, 1.03);
  EXPECT_EQ(Advance(a).path.from, a.material);
  const TipInput second = Advance(b);
  EXPECT_EQ(second.path.from, a.material);
  EXPECT_EQ(second.path.to, b.material);
  // If a sample is missing, the path of the next one is twice as long.
  const TipInput third = Advance(c);
  EXPECT_EQ(third.path.from, b.material);
  EXPECT_EQ(third.path.to, c.material);
}

TEST_F(TipTest, ASampleStandsForTheSessionTimeSinceTheLast) {
  EXPECT_FLOAT_EQ(Advance(At(0.005f, 0.01f, 1.00)).duration_s, 0.01f) << "the first sample stands for a frame";
  EXPECT_NEAR(Advance(At(0.005f, 0.01f, 1.02)).duration_s, 0.02f, 1e-6);
  EXPECT_NEAR(Advance(At(0.005f, 0.01f, 1.025)).duration_s, 0.005f, 1e-6);
  EXPECT_FLOAT_EQ(Advance(At(0.005f, 0.01f, 1.025)).duration_s, 0.01f) << "so does a sample that is not later";
  EXPECT_FLOAT_EQ(Advance(At(0.005f, 0.01f, 0.5)).duration_s, 0.01f) << "the session was restarted";
}

TEST_F(TipTest, MetalIsSweptFromSampleToSample) {
  const CauteryContact a = MetalAt(0.005f, 0.010f, 1.00), b = MetalAt(0.0053f, 0.0101f, 1.01);
  EXPECT_EQ(Advance(a).path.begin.x, a.footprint.x) << "at rest in its first sample";
  const TipInput swept = Advance(b);
  EXPECT_EQ(swept.path.begin.x, a.footprint.x);
  EXPECT_EQ(swept.path.end.x, b.footprint.x);
  EXPECT_EQ(swept.path.end.gap, b.footprint.gap);
  EXPECT_EQ(swept.path.displacement, b.material - a.material);
  const TipPath half = PartOf(swept.path, 0.25f, 0.75f), quarter = PartOf(half, 0, 0.5f);
  EXPECT_FLOAT_EQ(quarter.part_from, 0.25f);
  EXPECT_FLOAT_EQ(quarter.part_to, 0.5f);
  EXPECT_EQ(quarter.displacement, swept.path.displacement);
  EXPECT_NEAR(half.to.x(), 0.005225f, 1e-8f);
}

TEST_F(TipTest, JumpStartsANewPath) {
  const CauteryContact a = At(0.005f, 0.01f, 1.00), b = At(0.0085f, 0.01f, 1.01);  // 0.35 m/s
  (void)Advance(a);
  const TipInput jumped = Advance(b);
  EXPECT_EQ(jumped.path.from, b.material);
  EXPECT_TRUE(jumped.active);
}

TEST_F(TipTest, AFootprintThatComesStartsANewPath) {
  (void)Advance(At(0.005f, 0.010f, 1.00));
  const CauteryContact b = MetalAt(0.0051f, 0.010f, 1.01);
  const TipInput came = Advance(b);
  EXPECT_EQ(came.path.from, b.material);
  EXPECT_EQ(came.path.begin.gap, b.footprint.gap);
}

TEST_F(TipTest, LiftedMetalStartsANewPath) {
  (void)Advance(At(0.005f, 0.01f, 1.00));
  CauteryContact lifted = At(0.0052f, 0.01f, 1.01);
  lifted.touching = false;
  EXPECT_FALSE(Advance(lifted).active);
  EXPECT_EQ(Advance(At(0.0054f, 0.01f, 1.02)).path.from.x(), 0.0054f);
}

TEST_F(TipTest, AGapBetweenEnergisedSamplesIsBridged) {
  // Physics was stopped for 0.4 s while the hand moved on at 4 mm/s.
  (void)Advance(At(0.005f, 0.01f, 1.0));
  const TipInput bridged = Advance(At(0.0066f, 0.01f, 1.4));
  EXPECT_TRUE(bridged.active);
  EXPECT_EQ(bridged.path.from.x(), 0.005f);
  EXPECT_NEAR(bridged.duration_s, 0.4f, 1e-6);
  // Longer gaps are not bridged: the path of the metal in them is unknown.
  const TipInput anew = Advance(At(0.0074f, 0.01f, 1.4 + 1.01 * kLongestGap_s));
  EXPECT_EQ(anew.path.from.x(), 0.0074f);
  EXPECT_FLOAT_EQ(anew.duration_s, 0.01f);
}

TEST_F(TipTest, AGapAfterASampleWithoutCurrentBringsACurrentForAFrameOnly) {
  EXPECT_FALSE(Advance(At(0.005f, 0.01f, 1.0), {}).active);
  const TipInput down = Advance(At(0.0052f, 0.01f, 1.8));
  EXPECT_TRUE(down.active);
  EXPECT_FLOAT_EQ(down.duration_s, 0.01f) << "the pedal may have gone down just now";
}

TEST_F(TipTest, SamplesOutOfRangeAreNotAccepted) {
  EXPECT_TRUE(tip_.Accepts(At(0.005f, 0.01f)));
  EXPECT_FALSE(tip_.Accepts(At(0.03f, 0.01f)));
  EXPECT_FALSE(tip_.Accepts(At(NAN, 0.01f)));
  EXPECT_FALSE(tip_.Accepts(At(0.005f, 0.01f, NAN)));
  CauteryContact lifted = At(NAN, NAN);
  lifted.touching = false;
  EXPECT_TRUE(tip_.Accepts(lifted));
}

TEST_F(TipTest, ARestoredTrackerGoesOnWhereTheMetalWas) {
  const CauteryContact a = MetalAt(0.005f, 0.010f, 1.00), b = MetalAt(0.0051f, 0.010f, 1.01);
  (void)Advance(a);
  TipTracker other(sheet_, 5e-4f);
  ASSERT_TRUE(other.Restore(tip_.Save()));
  const TipInput here = Advance(b), there = other.Advance(b, kCuts, kFrame_s);
  EXPECT_EQ(there.path.from, here.path.from);
  EXPECT_EQ(there.path.begin.x, a.footprint.x);
  EXPECT_EQ(there.path.begin.gap, a.footprint.gap);
  EXPECT_EQ(there.duration_s, here.duration_s);
  // A state that no tracker can have had is refused.
  const TipTracker::State good = tip_.Save();
  const auto refused = [&](const auto& change) {
    TipTracker::State state = good;
    change(&state);
    return !other.Restore(state) && other.Save().last_s == 1.01;
  };
  EXPECT_TRUE(refused([](TipTracker::State* s) { s->last_s = NAN; }));
  EXPECT_TRUE(refused([](TipTracker::State* s) { s->at[1] = INFINITY; }));
  EXPECT_TRUE(refused([](TipTracker::State* s) { s->width = 0; }));
  EXPECT_TRUE(refused([](TipTracker::State* s) { s->height = kFootprintCells + 1; }));
  EXPECT_TRUE(refused([](TipTracker::State* s) { s->width = s->height = UINT32_MAX; }));
  EXPECT_TRUE(refused([](TipTracker::State* s) { s->x = INT32_MAX; }));
  EXPECT_TRUE(refused([](TipTracker::State* s) { s->on_path = 2; }));
}

TEST_F(TipTest, AFootprintOfAnotherSizeThanItSaysIsRefused) {
  EXPECT_TRUE(tip_.Accepts(MetalAt(0.005f, 0.010f)));
  const auto refused = [&](const auto& change) {
    CauteryContact contact = MetalAt(0.005f, 0.010f);
    change(&contact.footprint);
    return !tip_.Accepts(contact);
  };
  EXPECT_TRUE(refused([](Footprint* print) { print->gap.pop_back(); }));
  EXPECT_TRUE(refused([](Footprint* print) { print->gap.clear(); }));
  EXPECT_TRUE(refused([](Footprint* print) { print->width = 0; }));
  EXPECT_TRUE(refused([](Footprint* print) { print->width = kFootprintCells + 1; }));
  EXPECT_TRUE(refused([](Footprint* print) { print->x = INT32_MIN; }));
}

constexpr SurfaceMetric kFlat{1, 0, 1};

/// Area under the metal in units of radius squared, by cells of 1 / `fine` of its radius.
double CoveredArea(const Vec2f& a, const Vec2f& b, float fine) {
  const Electrode electrode(kFlat, a, b, fine);
  double sum = 0;
  const Vec2f low = electrode.low(0).array().floor(), high = electrode.high(0);
  for (float y = low.y() + 0.5f; y <= high.y(); y += 1) {
    for (float x = low.x() + 0.5f; x <= high.x(); x += 1) sum += Electrode::Covered(electrode.Gap({x, y}));
  }
  return sum / (fine * fine);
}

TEST(ElectrodeTest, CoverageIsTheAreaOfTheCapsuleAnyWay) {
  const Vec2f middle(0.31f, 0.17f);
  for (const float length : {0.0f, 0.5f, 3.0f}) {
    const double exact = std::numbers::pi + 2.0 * length;
    for (float heading = 0; heading < 3.1f; heading += 0.23f) {
      for (const float fine : {5.0f, 40.0f}) {  // 0.5 mm at cells of 0.1 mm; at cells of an eighth of that
        const Vec2f half = 0.5f * length * fine * Vec2f(std::cos(heading), std::sin(heading));
        EXPECT_NEAR(CoveredArea(middle - half, middle + half, fine) / exact, 1, fine < 10 ? 0.02 : 1e-3)
            << length << " " << heading;
      }
    }
  }
}

TEST(ElectrodeTest, DistanceIsThatOnTheStretchedSheet) {
  // The same capsule in material coordinates that are stretched 2 : 1 and sheared covers the area that the map gives.
  const SurfaceMetric metric{4.0f, 0.6f, 1.5f};
  const Electrode electrode(metric, {-4, -1.5f}, {4, 1.5f}, 12);
  const double length = std::sqrt(metric.ss * 64 + 2 * metric.st * 24 + metric.tt * 9);
  constexpr float kReach = 3;
  const Vec2f low = electrode.low(kReach), high = electrode.high(kReach);
  double sum = 0;
  for (float y = -60.5f; y < 60; y += 1) {
    for (float x = -60.5f; x < 60; x += 1) {
      const float gap = electrode.Gap({x, y});
      sum += Electrode::Covered(gap);
      if (gap >= kReach) continue;
      EXPECT_TRUE(x >= low.x() && y >= low.y() && x <= high.x() && y <= high.y()) << "outside the box of its reach";
    }
  }
  EXPECT_NEAR(sum * metric.area() / (std::numbers::pi * 144 + 2 * 12 * length), 1, 0.02);
}

constexpr float kMillisecond = 1e-3f;

TEST(FilmTest, GrowsWhereTissueBoilsAndOnlyWhereTheWaveformSustainsIt) {
  Interface film;
  film.Follow(0.1f, true, 1e-3f);  // A tenth of the footprint, with 1 ms (DESIGN).
  EXPECT_NEAR(film.film, 1 - std::exp(-1.0f), 1e-5f);
  film.Follow(1, true, 20e-3f);
  EXPECT_NEAR(film.film, 1, 1e-5f);
  Interface partial;
  partial.Follow(0.05f, true, 1);
  EXPECT_NEAR(partial.film, 0.5f, 1e-5f) << "too little tissue boils for a complete film";
  Interface coag;
  coag.Follow(1, false, 1);
  EXPECT_EQ(coag.film, 0.0f);
}

TEST(FilmTest, CollapsesOnceNothingBoilsAndThenBeginsAnew) {
  Interface film{.film = 1, .burning = 0.3f};
  film.Follow(0, true, 5e-3f);
  EXPECT_NEAR(film.film, std::exp(-1.0f), 1e-5f);
  EXPECT_EQ(film.burning, 0.3f) << "a film still exists";
  film.Follow(0, true, 50e-3f);
  EXPECT_LT(film.film, 1e-3f);
  EXPECT_EQ(film.burning, 1.0f);
  Interface split{.film = 1}, whole{.film = 1};
  for (int n = 0; n < 8; ++n) split.Follow(0, true, kMillisecond);
  whole.Follow(0, true, 8 * kMillisecond);
  EXPECT_NEAR(split.film, whole.film, 1e-5f) << "for any steps";
}

TEST(FilmTest, AsManyDischargesBurnAsKeepTheStrikeVoltage) {
  constexpr float kFootprint_m2 = 4e-6f;  // 1 mm by 4 mm
  const Drive drive = MakeDrive(ThermalParams{}, CauteryMode::kCut, 20);
  const auto settled = [&](float power_W) {
    Interface film{.film = 1};
    Drive asked = drive;
    asked.power_W = power_W;
    float voltage = 0;
    for (int n = 0; n < 20; ++n) {
      voltage = RegulatedVoltage(asked, film.burning * kDischarge_S_m2 * kFootprint_m2);
      film.Regulate(voltage);
    }
    return std::pair(voltage, film.burning);
  };
  const auto [voltage, burning] = settled(20);
  EXPECT_NEAR(voltage, 141.0f, 0.5f);  // 200 V peak
  EXPECT_NEAR(burning, 20 / (kStrike_V * kStrike_V * kDischarge_S_m2 * kFootprint_m2), 1e-3f);
  // More power than the whole footprint takes at that voltage raises the voltage; at very low power a few discharges
  // remain.
  EXPECT_GT(settled(60).first, 1.2f * kStrike_V);
  EXPECT_EQ(settled(60).second, 1.0f);
  EXPECT_LT(settled(0.01f).first, kStrike_V);
  EXPECT_GT(settled(0.01f).second, 0.0f);
}

TEST(FilmTest, MetalCoolsOnItsShaft) {
  Interface hook{.hook_theta = 100};
  for (int n = 0; n < 1600; ++n) hook.Cool(0.01f);
  EXPECT_NEAR(hook.hook_theta, 100 * std::exp(-1.0f), 0.1f);  // in 16 s
}

TEST(GeneratorTest, PowerThenVoltageThenCurrentLimits) {
  const Drive drive = MakeDrive(ThermalParams{}, CauteryMode::kCut, 35);
  EXPECT_NEAR(RegulatedVoltage(drive, 1e-3f), std::sqrt(35 / 1e-3f), 0.1f);
  EXPECT_FLOAT_EQ(RegulatedVoltage(drive, 1e-6f), 350.0f);
  EXPECT_FLOAT_EQ(RegulatedVoltage(drive, 10.0f), 0.2f);
  EXPECT_EQ(RegulatedVoltage(drive, 0.0f), 0.0f);
  const Drive coag = MakeDrive(ThermalParams{}, CauteryMode::kCoag, 35);  // on during a quarter of the time
  EXPECT_FLOAT_EQ(coag.v_max_V, 0.5f * drive.v_max_V);
  EXPECT_FLOAT_EQ(coag.i_max_A, 0.5f * drive.i_max_A);
  EXPECT_GT(MakeDrive(ThermalParams{}, CauteryMode::kBlend, 35).remove_theta, drive.remove_theta);
}

TEST(DamageTest, KnownTimesToCellDeath) {
  const DamageRate rate(kCellDeath, 37);
  // Omega = 1 after 510 s at 43 C, 61 s at 50 C, 3.5 s at 60 C, 0.23 s at 70 C (lab values).
  EXPECT_NEAR(1 / rate.At(6), 510, 15);
  EXPECT_NEAR(1 / rate.At(13), 61, 2);
  EXPECT_NEAR(1 / rate.At(23), 3.5, 0.2);
  EXPECT_NEAR(1 / rate.At(33), 0.23, 0.02);
  for (const float theta : {1e3f, 1e9f, INFINITY}) EXPECT_TRUE(std::isfinite(rate.At(theta)));
  EXPECT_EQ(rate.At(-5), rate.At(0));
}

TEST(DamageTest, RateFollowsTheFormula) {
  const DamageRate rate(kCollagen, 37);
  for (double theta = 10; theta < 100; theta += 0.37) {
    const double exact = kCollagen.a_per_s * std::exp(-kCollagen.ea_J_mol / (8.314462618 * (273.15 + 37 + theta)));
    EXPECT_NEAR(rate.At(static_cast<float>(theta)) / exact, 1, 1e-4);  // x of some 130 in float
  }
}

scene::SceneData SceneWithUreter(float depth_m) {
  scene::SceneData data = FlatScene(21, 21, 1e-3f);
  data.protected_structures = {{ProtectedKind::kUreter, 0.002f, depth_m, 0, 2}};
  data.protected_points = {{Vec3f::Zero(), Vec2f(0.002f, 0.01f)}, {Vec3f::Zero(), Vec2f(0.018f, 0.01f)}};
  return data;
}

std::set<ThermalEventKind> EventsOfDwell(float depth_m, int frames) {
  const scene::SceneData data = SceneWithUreter(depth_m);
  ThermalSolver solver(data.View());
  std::set<ThermalEventKind> kinds;
  TipInput tip;
  tip.active = true;
  tip.path.from = tip.path.to = {0.0103f, 0.0101f};
  tip.path.radius_m = 5e-4f;
  tip.mode = CauteryMode::kCoag;
  tip.power_W = 15;
  for (int n = 0; n < frames; ++n) {
    solver.Step(tip, 0.01f);
    for (const SolverEvent& event : solver.events()) kinds.insert(event.kind);
  }
  return kinds;
}

TEST(ProtectedTest, ShallowUreterIsWarnedAndInjuredByALongStay) {
  const auto kinds = EventsOfDwell(3e-4f, 500);
  EXPECT_TRUE(kinds.contains(ThermalEventKind::kUreterWarning));
  EXPECT_TRUE(kinds.contains(ThermalEventKind::kUreterInjury));
  EXPECT_FALSE(kinds.contains(ThermalEventKind::kNerveWarning));
  EXPECT_TRUE(kinds.contains(ThermalEventKind::kContact));
  EXPECT_TRUE(kinds.contains(ThermalEventKind::kSteam));
  EXPECT_TRUE(kinds.contains(ThermalEventKind::kBlanch));
}

TEST(ProtectedTest, DeepUreterIsSafeFromAShortOne) {
  const auto kinds = EventsOfDwell(4e-3f, 200);
  EXPECT_FALSE(kinds.contains(ThermalEventKind::kUreterWarning));
}

TEST(PatchTest, ShowsTemperatureDamageAndHolesInPlace) {
  const scene::SceneData data = FlatScene(41, 41, 1e-3f);
  const SceneView scene = data.View();
  ThermalSolver solver(scene);
  Drag drag;
  drag.from = {0.030f, 0.0102f};
  drag.to = {0.036f, 0.0102f};
  RunDrag(drag, 0.01f, &solver);
  std::vector<std::uint8_t> texels(4 * kPatchTexels * kPatchTexels);
  const PatchPlace place{0, 256, 0};
  const float highest = DrawPatch(solver.field(), scene.membrane.texel_m, place, texels);
  EXPECT_NEAR(highest, 100, 10);
  const auto at = [&](int x, int y) { return &texels[4 * (static_cast<std::size_t>(y) * kPatchTexels + x - 256)]; };
  EXPECT_EQ(at(330, 102)[3], 0);        // in the slit
  EXPECT_EQ(at(330, 160)[3], 255);      // beside it
  EXPECT_EQ(at(330, 160)[1], 0);        // undamaged
  EXPECT_NEAR(at(256, 250)[0], 34, 1);  // 37 C
  int brown = 0;
  for (int y = 80; y < 125; ++y) brown += at(330, y)[3] != 0 && at(330, y)[1] > 128 ? 1 : 0;
  EXPECT_GT(brown, 1);
}

TEST(PatchTest, EachTexelIsThatOfItsCell) {
  // Texels of half a cell, of a cell and of two, over tiles of which one is missing, with cells of every kind.
  HeatField field(MakeFlatSheet(9.6e-3f, 9.6e-3f, 1e-4f), MakeMaterial(ThermalParams{}));
  Ledger ledger;
  std::uint32_t number = 1;
  for (const auto& [tx, ty] : {std::pair{0, 0}, {1, 1}, {2, 1}}) {
    Tile* tile = field.Wake(tx, ty);
    for (int k = 0; k < kTileCells; ++k) {
      number = number * 1664525u + 1013904223u;
      const float part = static_cast<float>(number >> 8u) / 16777216.0f;
      TileState& s = tile->state;
      s.water[k] = 1.0f - part;
      s.enthalpy[k] = (240.0f * part - 60.0f) * field.material().HeatCapacity(s.water[k]);
      s.charred[k] = number % 3 == 0 ? part : 0.0f;
      s.omega_collagen[k] = number % 4 == 0 ? 3.0f * part : number % 4 == 1 ? NAN : 0.0f;
      s.flags[k] = static_cast<std::uint8_t>(number % 7 == 0 ? kRemoved : number % 7 == 1 ? kOutside : 0);
    }
    field.RefreshTheta(tile, &ledger);
  }
  const auto byte = [](float value) { return value > 0.0f ? static_cast<int>(std::min(value + 0.5f, 255.0f)) : 0; };
  const float body = field.material().body_C;
  for (const float texel_m : {5e-5f, 1e-4f, 2e-4f}) {
    std::vector<std::uint8_t> texels(4 * kPatchTexels * kPatchTexels);
    const float highest = DrawPatch(field, texel_m, {0, 0, 0}, texels);
    float warmest = 0;
    for (int n = 0; n < kPatchTexels * kPatchTexels; ++n) {
      const auto cell_of = [&](int texel, int origin) {
        return static_cast<int>(std::floor((static_cast<float>(texel) + 0.5f) * texel_m / 1e-4f)) - origin;
      };
      const int ix = cell_of(n % kPatchTexels, field.sheet().origin_x);
      const int iy = cell_of(n / kPatchTexels, field.sheet().origin_y);
      const Tile* tile = ix < 0 || iy < 0 ? nullptr : field.Find(ix / kTile, iy / kTile);
      std::array<int, 4> expected{byte(2 * (body - 20)), 0, 0, 255};
      if (tile != nullptr) {
        const int k = iy % kTile * kTile + ix % kTile, flags = tile->state.flags[k];
        const float theta = tile->theta[ThetaIndex(ix % kTile, iy % kTile)], omega = tile->state.omega_collagen[k];
        warmest = std::max(warmest, theta);
        expected = {byte((body + theta - 20) * 2), omega > 0.0f ? byte(255 * (1 - std::exp(-omega))) : 0,
                    (flags & kOutside) != 0 ? 0 : byte(128 * (1 - tile->state.water[k]) + 127 * tile->state.charred[k]),
                    (flags & kRemoved) != 0 ? 0 : 255};
      }
      for (std::size_t c = 0; c < 4; ++c) ASSERT_EQ(texels[4 * static_cast<std::size_t>(n) + c], expected[c]) << n;
    }
    EXPECT_EQ(highest, body + warmest);
  }
}

TEST(PatchTest, PlannerSendsWhatChangedOnceAndOnlyThat) {
  const scene::SceneData data = FlatScene(61, 61, 1e-3f);
  const SceneView scene = data.View();
  ThermalSolver solver(scene);
  PatchPlanner planner(solver.field(), scene.membrane.texel_m);
  EXPECT_FALSE(planner.Next(solver.field()));
  EXPECT_FALSE(planner.NextOfHistory());
  Drag drag;
  drag.from = {0.038f, 0.0382f};  // far from the borders of its place: current warms tissue 6 mm away
  drag.to = {0.039f, 0.0382f};
  RunDrag(drag, 0.01f, &solver);
  planner.Note(solver.mutable_field(), false);
  const auto place = planner.Next(solver.field());
  ASSERT_TRUE(place);
  EXPECT_EQ(place->origin_x, 256u);
  EXPECT_EQ(place->origin_y, 256u);
  EXPECT_FALSE(planner.Next(solver.field()));
  planner.Note(solver.mutable_field(), false);
  EXPECT_FALSE(planner.Next(solver.field()));
  EXPECT_TRUE(planner.NextOfHistory());
  planner.Note(solver.mutable_field(), true);
  EXPECT_TRUE(planner.Next(solver.field()));
}

}  // namespace
}  // namespace fulcrum::thermal
