// The paper's model: effects of its rules on the mesh, and robustness against extreme inputs.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <memory>
#include <vector>

#include "tests/numerics/thermal/flat_scene.h"

namespace fulcrum::thermal {
namespace {

constexpr float kDt = 0.01f;
constexpr std::uint32_t kRows = 21, kCols = 41;

scene::SceneData PaperScene() {
  scene::SceneData data = FlatScene(kRows, kCols, 1e-3f);
  data.fixed.thermal.model = ThermalModel::kPaper;
  return data;
}

/// A drag along the middle between two rows, or on a row.
Drag Along(float t_m) {
  Drag drag;
  drag.from = {0.0103f, t_m};
  drag.to = {0.0203f, t_m};
  drag.speed_m_s = 0.01f;
  return drag;
}

float Left(const TopologyBits& bits, std::size_t edge) {
  return 1.0f - kShrinkUnit * static_cast<float>(bits.shrink[edge]);
}

/// Checks all numbers of the state.
void ExpectFinite(const ThermalSolver& solver) {
  for (const Tile* tile : solver.field().Existing()) {
    for (const float h : tile->state.enthalpy) ASSERT_TRUE(std::isfinite(h));
    for (const float w : tile->state.water) ASSERT_TRUE(w == 1.0f || w == 0.0f);
  }
  for (const double joule : {solver.ledger().joule, solver.ledger().Out(), solver.ledger().generator}) {
    ASSERT_TRUE(std::isfinite(joule));
  }
}

TEST(PaperModelTest, CutKillsNodesAndShrinksEdgesOncePerInvalidEnd) {
  const scene::SceneData data = PaperScene();
  const SceneView scene = data.View();
  ThermalSolver solver(scene);
  RunDrag(Along(0.0101f), kDt, &solver);
  for (int n = 0; n < kCommitFrames; ++n) solver.Step(TipInput{}, kDt);
  const TopologyBits& bits = solver.topology().committed();
  EXPECT_GE(solver.topology().dead_node_count(), 9u);
  EXPECT_GT(solver.cut_length_m(), 0.008f);
  EXPECT_GT(solver.figures().highest_C, kBoiling_C);  // without boiling the temperature has no such limit
  constexpr std::array kLeft{1.0f, 0.7f, 0.49f};
  int once = 0, twice = 0;
  for (std::size_t e = 0; e < scene.membrane_rest_length.size(); ++e) {
    if (scene.membrane_rest_length[e] <= 0) continue;
    const std::size_t node = e / 3;
    const std::size_t other = node + std::array<std::size_t, 3>{1, kCols, kCols + 1}[e % 3];
    const int invalid = (TestBit(bits.dead_nodes, node) ? 1 : 0) + (TestBit(bits.dead_nodes, other) ? 1 : 0);
    EXPECT_EQ(TestBit(bits.dead_edges, e), invalid > 0) << e;
    EXPECT_NEAR(Left(bits, e), kLeft[invalid], 1e-6f) << e;
    once += invalid == 1 ? 1 : 0;
    twice += invalid == 2 ? 1 : 0;
  }
  EXPECT_GT(once, 20);
  EXPECT_GT(twice, 5);
  EXPECT_LE(solver.ledger().ClosureError(solver.field().Stored()), 1e-4);
  // No water, no history of damage: the picture shows the present temperature only (eq. 15).
  EXPECT_EQ(solver.ledger().vapour, 0.0);
  for (const Tile* tile : solver.field().Existing()) {
    for (const float omega : tile->state.omega_collagen) ASSERT_EQ(omega, 0.0f);
  }
}

TEST(PaperModelTest, VoltageIsFixedWhateverPowerIsAsked) {
  const scene::SceneData data = PaperScene();
  double delivered[2];
  for (const int n : {0, 1}) {
    ThermalSolver solver(data.View());
    Drag drag = Along(0.0101f);
    drag.power_W = n == 0 ? 5.0f : 100.0f;
    for (int frame = 0; frame < 20; ++frame) solver.Step(drag.At(frame, kDt), kDt);
    EXPECT_EQ(solver.figures().voltage_V, data.fixed.thermal.v_max_V);
    delivered[n] = solver.ledger().generator;
  }
  EXPECT_EQ(delivered[0], delivered[1]);
}

TEST(PaperModelTest, SlitBetweenTwoRowsIsMissedByTheNodeRule) {
  const scene::SceneData data = PaperScene();
  ThermalSolver solver(data.View());
  Tile* tile = solver.mutable_field()->Wake(4, 3);
  // 0.3 mm of hot tissue midway between the rows at cells 100 and 110; it cools before the heat reaches the rows.
  for (int j = 8; j <= 10; ++j) {
    for (int i = 0; i < kTile; ++i) {
      tile->state.enthalpy[j * kTile + i] = 80.0f * solver.field().material().rc_wet;
    }
  }
  Ledger ledger;
  solver.mutable_field()->RefreshTheta(tile, &ledger);
  for (int n = 0; n < 100; ++n) solver.Step(TipInput{}, kDt);
  EXPECT_EQ(solver.topology().dead_node_count(), 0u);
}

TEST(PaperModelTest, StaysFiniteUnderAbsurdInput) {
  scene::SceneData data = PaperScene();
  data.fixed.thermal.v_max_V = 5000;
  data.fixed.thermal.sigma_S_m = 5;
  data.fixed.thermal.perfusion_per_s = 0;
  ThermalSolver solver(data.View());
  std::uint32_t random = 1;
  const auto uniform = [&] { return static_cast<float>((random = random * 1664525u + 1013904223u) >> 8) * 0x1p-24f; };
  TipInput tip;
  tip.active = true;
  tip.mode = CauteryMode::kCut;
  tip.power_W = 400;
  for (int frame = 0; frame < 60; ++frame) {
    tip.path.from = tip.path.to;
    // Jumps over the whole sheet, pauses, and the extreme corner.
    if (frame % 3 == 0) tip.path.to = {0.04f * uniform(), 0.02f * uniform()};
    if (frame % 10 == 0) tip.path.to = {0.04f - 1e-6f, 0.02f - 1e-6f};
    tip.path.radius_m = frame % 2 == 0 ? kContactRadiusMin_m : kContactRadiusMax_m;
    tip.path.tented = frame % 4 == 0;
    if (frame == 30) {
      Tile* tile = solver.mutable_field()->Wake(2, 2);
      tile->state.enthalpy[77] = NAN;
      tile->state.enthalpy[78] = INFINITY;
    }
    solver.Step(tip, frame % 7 == 0 ? 0.1f : kDt);
    ExpectFinite(solver);
    ASSERT_LE(solver.figures().present_C, 3000.0f);  // the limit of the gate
  }
  EXPECT_EQ(solver.field().quarantined(), 2u);
  EXPECT_GT(solver.topology().dead_node_count(), 50u);
}

TEST(PaperModelTest, RestartContinuesBitForBitAndOnlyItsOwnModel) {
  const scene::SceneData data = PaperScene();
  const SceneView scene = data.View();
  const Drag drag = Along(0.0101f);
  std::vector<std::byte> bytes(ThermalSolver::CheckpointCapacity(scene));
  const auto run = [&](int restart_at) {
    auto solver = std::make_unique<ThermalSolver>(scene);
    for (int frame = 0; frame < drag.frames(kDt) + 20; ++frame) {
      if (frame == restart_at) {
        EXPECT_TRUE(solver->at_commit_frame());
        const std::size_t used = solver->Save(bytes);
        EXPECT_GT(used, 0u);
        solver = std::make_unique<ThermalSolver>(scene);
        EXPECT_TRUE(solver->Restore(std::span(bytes).first(used)));
        scene::SceneData other = FlatScene(kRows, kCols, 1e-3f);
        EXPECT_FALSE(ThermalSolver(other.View()).Restore(std::span(bytes).first(used)));
      }
      solver->Step(frame < drag.frames(kDt) ? drag.At(frame, kDt) : TipInput{}, kDt);
    }
    return solver->FullHash();
  };
  EXPECT_EQ(run(-1), run(50));
}

}  // namespace
}  // namespace fulcrum::thermal
