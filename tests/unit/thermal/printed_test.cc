// Model paper as printed: a test for each row of the paper that concerns heat and topology
// (deploy/docs/measurements/paper). The numbers are the paper's, not those of the code.
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "tests/numerics/thermal/flat_scene.h"
#include "thermal_node/paper/paper_model.h"

namespace fulcrum::thermal {
namespace {

constexpr double kRhoC_J_m3K = 3e6 * 0.3, kDiffusivity_m2_s = 0.512 / kRhoC_J_m3K;
constexpr float kDt = 0.01f;

ThermalParams Printed() {
  ThermalParams params;
  params.model = ThermalModel::kPaper;
  params.as = PaperForm::kPrinted;
  return params;
}

scene::SceneData PrintedScene(std::uint32_t rows, std::uint32_t cols) {
  scene::SceneData data = FlatScene(rows, cols, 1e-3f);
  data.fixed.thermal = Printed();
  return data;
}

/// Sets every cell of a flat sheet to the temperature above the body's that `theta` gives for its centre.
template <class Theta>
void Warm(const Theta& theta, HeatField* field, Ledger* ledger) {
  for (int iy = 0; iy < field->sheet().ny; ++iy) {
    for (int ix = 0; ix < field->sheet().nx; ++ix) {
      Tile* tile = field->Wake(ix / kTile, iy / kTile);
      tile->state.enthalpy[iy % kTile * kTile + ix % kTile] =
          static_cast<float>(kRhoC_J_m3K) * theta(field->sheet().CentreOf({ix, iy}));
    }
  }
  for (Tile* tile : field->awake()) field->RefreshTheta(tile, ledger);
}

float ThetaAt(const HeatField& field, CellIndex at) {
  return field.Find(at.ix / kTile, at.iy / kTile)->theta[ThetaIndex(at.ix % kTile, at.iy % kTile)];
}

/// A step of temperature: (1 + erf(x / (2 sqrt(alpha t)))) / 2.
TEST(PaperTable2, ConductivityDensityAndHeatCapacityGiveTheDiffusivity) {
  HeatField field(MakeFlatSheet(12.8e-3f, 3.2e-3f, 1e-4f), MakePaperMaterial(Printed()));
  Ledger ledger;
  Warm([](const Vec2f& p) { return p.x() > 6.4e-3f ? 10.0f : 0.0f; }, &field, &ledger);
  for (int n = 0; n < 100; ++n) field.Diffuse(kDt, &ledger);
  for (const int ix : {56, 60, 68, 72}) {
    const double x = 1e-4 * (ix + 0.5) - 6.4e-3;
    EXPECT_NEAR(ThetaAt(field, {ix, 16}), 5 * (1 + std::erf(x / (2 * std::sqrt(kDiffusivity_m2_s)))), 0.01);
  }
}

/// Of equal potentials the power is proportional to sigma: 0.9 S/m here, the scene's value with the corrections.
TEST(PaperTable2AndEquation12, JouleHeatIsThatOfTheElectricalConductivity) {
  double joule[2];
  for (const int n : {0, 1}) {
    scene::SceneData data = PrintedScene(21, 41);
    data.fixed.thermal.sigma_S_m = 0.35f;
    data.fixed.thermal.as = n == 0 ? PaperForm::kCorrected : PaperForm::kPrinted;
    const SceneView scene = data.View();
    HeatField field(MakeSheet(scene), MakePaperMaterial(scene.thermal));
    PaperModel model(scene, field.sheet());
    Ledger ledger;
    model.Heat(&field, {{0.02f, 0.01f}, 5e-4f, 10.0f, false}, 1e-3f, &ledger);
    joule[n] = ledger.joule;
  }
  EXPECT_GT(joule[0], 0);
  EXPECT_NEAR(joule[1] / joule[0], 0.9 / 0.35, 1e-3);
}

/// Eq. 10 has perfusion and metabolism, eq. 11, which the paper runs, has neither: the heat of the sheet stays.
TEST(PaperEquations10And11, OnlyConductionActs) {
  ThermalParams params = Printed();
  params.perfusion_per_s = 0.1f;
  params.h_top_W_m2K = params.h_below_W_m2K = 1000;
  HeatField field(MakeFlatSheet(6.4e-3f, 6.4e-3f, 1e-4f), MakePaperMaterial(params));
  Ledger ledger;
  Warm([](const Vec2f& p) { return p.x() > 2e-3f ? 20.0f : 5.0f; }, &field, &ledger);
  const double before = field.Stored();
  for (int n = 0; n < 200; ++n) field.Diffuse(kDt, &ledger);
  EXPECT_NEAR(field.Stored() / before, 1, 1e-5);
  EXPECT_EQ(ledger.lost, 0);
}

/// sigma is that of the membrane everywhere: a hole changes neither current nor potential.
TEST(PaperEquation13, HolesConduct) {
  double joule[2];
  for (const int n : {0, 1}) {
    const scene::SceneData data = PrintedScene(21, 41);
    const SceneView scene = data.View();
    HeatField field(MakeSheet(scene), MakePaperMaterial(scene.thermal));
    PaperModel model(scene, field.sheet());
    Ledger ledger;
    for (int ix = 205; n == 1 && ix < 210; ++ix) {
      for (int iy = 80; iy < 120; ++iy) {
        field.TakeOut(field.Wake(ix / kTile, iy / kTile), iy % kTile * kTile + ix % kTile, kRemoved, &ledger.removed);
      }
    }
    for (int frame = 0; frame < 5; ++frame) {
      model.Heat(&field, {{0.02f, 0.01f}, 5e-4f, 10.0f, false}, 1e-3f, &ledger);
    }
    joule[n] = ledger.generator;
  }
  EXPECT_NEAR(joule[1] / joule[0], 1, 1e-6);
}

/// h theta through the border's faces and nowhere else.
TEST(PaperEquation14, HeatLeavesThroughTheBorderAlone) {
  scene::SceneData data = PrintedScene(7, 13);
  data.fixed.thermal.h_top_W_m2K = 40;
  const SceneView scene = data.View();
  HeatField field(MakeSheet(scene), MakePaperMaterial(scene.thermal));
  const PaperModel model(scene, field.sheet());
  Ledger ledger;
  Warm([](const Vec2f&) { return 10.0f; }, &field, &ledger);
  model.CoolBorder(&field, kDt, &ledger);
  const double thickness_m = static_cast<double>(scene.thermal.thickness_m);
  const double border_m2 = 2e-4 * (field.sheet().nx + field.sheet().ny) * thickness_m;
  EXPECT_NEAR(ledger.lost, 40 * 10 * border_m2 * static_cast<double>(kDt), 0.01 * ledger.lost);
  EXPECT_FLOAT_EQ(ThetaAt(field, {20, 20}), 10);
  EXPECT_LT(ThetaAt(field, {0, 20}), 9.99f);
}

float Left(const TopologyBits& bits, std::size_t edge) {
  return 1.0f - kShrinkUnit * static_cast<float>(bits.shrink[edge]);
}

/// Section 6, Figs. 14 and 17: an edge at one invalid node lives on at 0.7 of its rest length; it is deleted when both
/// its ends are invalid.
TEST(PaperTopology, AnEdgeGoesWhenBothItsEndsAreInvalid) {
  constexpr std::uint32_t kRows = 9, kCols = 9;
  const scene::SceneData data = PrintedScene(kRows, kCols);
  const SceneView scene = data.View();
  HeatField field(MakeSheet(scene), MakePaperMaterial(scene.thermal));
  MeshTopology topology(scene, field.sheet());
  PaperModel model(scene, field.sheet());
  Ledger ledger;
  // Just above the threshold at the nodes (4, 4) and (4, 5), just below it at (4, 3).
  for (const auto& [col, celsius] : {std::pair{3, 99.5f}, {4, 100.5f}, {5, 100.5f}}) {
    const int ix = 10 * col, iy = 40;
    field.Wake(ix / kTile, iy / kTile)->state.enthalpy[iy % kTile * kTile + ix % kTile] =
        static_cast<float>(kRhoC_J_m3K) * (celsius - 37);
  }
  for (Tile* tile : field.awake()) field.RefreshTheta(tile, &ledger);
  (void)model.RemoveNodes(&field, &topology, &ledger);
  ASSERT_TRUE(topology.Commit());
  const TopologyBits& bits = topology.committed();
  const std::size_t left = 4 * kCols + 4, right = left + 1;
  EXPECT_TRUE(TestBit(bits.dead_edges, 3 * left)) << "between the two";
  EXPECT_FALSE(TestBit(bits.dead_nodes, left));
  EXPECT_EQ(topology.dead_edge_count(), 1u);
  int shortened = 0;
  for (std::size_t edge = 0; edge < 3 * kRows * kCols; ++edge) {
    if (edge == 3 * left || Left(bits, edge) == 1.0f) continue;
    EXPECT_NEAR(Left(bits, edge), 0.7f, 0.002f) << edge;
    ++shortened;
  }
  EXPECT_EQ(shortened, 10) << "five at either node";
  // Then the four neighbours of the left one: nothing holds it any more.
  for (const std::size_t node : {left - 1, left - kCols, left + kCols, left - kCols - 1, left + kCols + 1}) {
    const int ix = 10 * static_cast<int>(node % kCols), iy = 10 * static_cast<int>(node / kCols);
    field.Wake(ix / kTile, iy / kTile)->state.enthalpy[iy % kTile * kTile + ix % kTile] =
        static_cast<float>(kRhoC_J_m3K) * 70;
  }
  for (Tile* tile : field.awake()) field.RefreshTheta(tile, &ledger);
  (void)model.RemoveNodes(&field, &topology, &ledger);
  topology.Commit();
  EXPECT_TRUE(TestBit(topology.committed().dead_nodes, left));
  EXPECT_FALSE(TestBit(topology.committed().dead_nodes, right));
}

/// A whole stroke: the sheet opens, everything stays finite, heat is accounted for, and a checkpoint goes on.
TEST(PaperAsPrinted, AStrokeOpensTheSheet) {
  const scene::SceneData data = PrintedScene(21, 41);
  ThermalSolver solver(data.View());
  Drag drag;
  drag.from = {0.0103f, 0.0101f};
  drag.to = {0.0203f, 0.0101f};
  drag.speed_m_s = 0.01f;
  RunDrag(drag, kDt, &solver);
  for (int n = 0; n < kCommitFrames; ++n) solver.Step(TipInput{}, kDt);
  EXPECT_GT(solver.topology().dead_edge_count(), 8u);
  EXPECT_LE(solver.ledger().ClosureError(solver.field().Stored()), 1e-4);
}

}  // namespace
}  // namespace fulcrum::thermal
