// A burn that is interrupted anywhere and continues from its checkpoint ends with equal bits.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include "tests/numerics/thermal/flat_scene.h"
#include "tests/numerics/thermal/topology_validator.h"

namespace fulcrum::thermal {
namespace {

constexpr float kDt = 0.01f;

struct Burn {
  CauteryMode mode;
  bool tented;
};

class RestartTest : public ::testing::TestWithParam<Burn> {
 protected:
  [[nodiscard]] Drag MakeDrag() const {
    Drag drag;
    drag.from = {0.0053f, 0.0051f};
    drag.to = drag.from + 0.006f * Vec2f(std::cos(0.7f), std::sin(0.7f));
    drag.speed_m_s = 0.006f;
    drag.mode = GetParam().mode;
    drag.tented = GetParam().tented;
    return drag;
  }
  /// One frame: 100 of burning, then cooling.
  void Step(int frame, ThermalSolver* solver) const {
    const Drag drag = MakeDrag();
    solver->Step(frame < drag.frames(kDt) ? drag.At(frame, kDt) : TipInput{}, kDt);
  }

  static constexpr int kFrames = 130;
  const scene::SceneData data_ = FlatScene(16, 16, 1e-3f);
  const SceneView scene_ = data_.View();
};

TEST_P(RestartTest, AnyFrameWithNothingStagedGivesTheSameBits) {
  std::vector<std::uint64_t> hashes;
  std::vector<std::vector<std::byte>> checkpoints;
  std::vector<std::byte> slot(ThermalSolver::CheckpointCapacity(scene_));
  ThermalSolver whole(scene_);
  TopologyValidator validator(scene_, whole.field().sheet());
  int refused = 0;
  for (int frame = 0; frame < kFrames; ++frame) {
    Step(frame, &whole);
    hashes.push_back(whole.FullHash());
    const std::size_t bytes = whole.Save(slot);
    // No checkpoint exists while tissue was cut since the last commit and its edges are not in the committed topology.
    EXPECT_EQ(bytes == 0, whole.topology().staged());
    EXPECT_FALSE(whole.at_commit_frame() && bytes == 0);
    refused += bytes == 0 ? 1 : 0;
    checkpoints.emplace_back(slot.begin(), slot.begin() + static_cast<std::ptrdiff_t>(bytes));
    ASSERT_EQ(validator.Check(whole), "");
  }
  if (GetParam().mode == CauteryMode::kCut) {
    EXPECT_GT(refused, 10);
  }
  for (const int stop : {0, 7, 23, 39, 49, 64, 74, 89, 99, 101, 119}) {
    if (checkpoints[stop].empty()) continue;
    ThermalSolver restarted(scene_);
    ASSERT_TRUE(restarted.Restore(checkpoints[stop]));
    ASSERT_EQ(restarted.FullHash(), hashes[stop]);
    for (int frame = stop + 1; frame < kFrames; ++frame) {
      Step(frame, &restarted);
      ASSERT_EQ(restarted.FullHash(), hashes[frame]) << "stopped after " << stop << ", frame " << frame;
    }
    EXPECT_EQ(restarted.topology().revision(), whole.topology().revision());
    EXPECT_EQ(restarted.topology().committed().dead_edges, whole.topology().committed().dead_edges);
    EXPECT_EQ(restarted.cut_length_m(), whole.cut_length_m());
    EXPECT_EQ(restarted.ledger().generator, whole.ledger().generator);
  }
}

INSTANTIATE_TEST_SUITE_P(Burns, RestartTest,
                         ::testing::Values(Burn{CauteryMode::kCut, false}, Burn{CauteryMode::kCoag, true}));

/// A warm column beneath keeps a tile awake that is nearly cold itself, here because its warm cells are cut away. A
/// tile that falls asleep loses its heat.
TEST(RestartVolumeTest, AnyFrameGivesTheSameBitsWhereATileIsHeldAwakeFromBeneath) {
  scene::SceneData data = FlatScene(21, 21, 1e-3f);
  data.fixed.thermal.volume = 1;
  const SceneView scene = data.View();
  // Hot metal in the middle of a tile; the tiles beside it stay cold.
  TipInput hot;
  hot.touching = true;
  hot.path.from = hot.path.to = {0.0112f, 0.0112f};
  hot.path.radius_m = 5e-4f;
  constexpr int kFrames = 80, kCutAway = 40;
  std::vector<std::byte> slot(ThermalSolver::CheckpointCapacity(scene));
  ThermalSolver whole(scene);
  whole.source()->SetInterface({0, 1, 300});
  std::unique_ptr<ThermalSolver> restarted;  // From the checkpoint of the frame before.
  int held = 0;
  for (int frame = 0; frame < kFrames; ++frame) {
    if (frame == kCutAway) {
      const CellIndex middle = whole.field().sheet().CellOf(hot.path.to);
      Tile* tile = whole.mutable_field()->Wake(middle.ix / kTile, middle.iy / kTile);
      double heat = 0;
      for (int k = 0; k < kTileCells; ++k) {
        const bool warm = tile->theta[ThetaIndex(k % kTile, k / kTile)] > 0.5f * kSleepTheta;
        if (warm) whole.mutable_field()->TakeOut(tile, k, kRemoved, &heat);
      }
      restarted.reset();
    }
    const TipInput tip = frame < kCutAway ? hot : TipInput{};
    whole.Step(tip, kDt);
    if (restarted != nullptr) {
      restarted->Step(tip, kDt);
      ASSERT_EQ(restarted->FullHash(), whole.FullHash()) << "frame " << frame;
    }
    const std::vector<const Tile*> tiles = whole.field().Existing();
    held += std::any_of(tiles.begin(), tiles.end(),
                        [](const Tile* tile) { return tile->held && tile->theta_max < kSleepTheta; })
                ? 1
                : 0;
    const std::size_t bytes = whole.Save(slot);
    restarted.reset();
    if (bytes == 0) continue;
    restarted = std::make_unique<ThermalSolver>(scene);
    ASSERT_TRUE(restarted->Restore(std::span(slot).first(bytes)));
  }
  EXPECT_GT(held, 10) << "the case occurs";
}

TEST(RestartEventTest, AStrokeThatGoesOnIsReportedOnce) {
  const scene::SceneData data = FlatScene(16, 16, 1e-3f);
  const SceneView scene = data.View();
  Drag drag;
  drag.from = {0.0053f, 0.0051f};
  drag.to = {0.0113f, 0.0051f};
  drag.speed_m_s = 0.006f;
  std::vector<std::byte> slot(ThermalSolver::CheckpointCapacity(scene));
  ThermalSolver whole(scene), restarted(scene);
  for (int frame = 0; frame < 50; ++frame) whole.Step(drag.At(frame, kDt), kDt);
  const std::size_t bytes = whole.Save(slot);
  ASSERT_GT(bytes, 0u);
  ASSERT_TRUE(restarted.Restore(std::span(slot).first(bytes)));
  for (int frame = 50; frame < 80; ++frame) {
    // No sample has arrived in the first frames; later the hook has gone.
    const std::span<const TipInput> none;
    const TipInput tip = drag.At(frame, kDt), lifted;
    const auto tips = frame < 52 ? none : std::span(frame < 70 ? &tip : &lifted, 1);
    whole.Step(tips, kDt);
    restarted.Step(tips, kDt);
    ASSERT_EQ(restarted.events().size(), whole.events().size()) << "frame " << frame;
    for (std::size_t i = 0; i < whole.events().size(); ++i) {
      const SolverEvent &a = whole.events()[i], &b = restarted.events()[i];
      EXPECT_EQ(a.kind, b.kind);
      EXPECT_EQ(a.material, b.material);
      EXPECT_NE(a.kind, ThermalEventKind::kContact) << "frame " << frame;
      EXPECT_LT(std::abs(a.material.y() - drag.to.y()), 1e-3f) << "frame " << frame;
    }
  }
}

TEST(RestartRefusalTest, ValuesThatTheSolverCannotHaveWrittenAreRefused) {
  const scene::SceneData data = FlatScene(16, 16, 1e-3f);
  const SceneView scene = data.View();
  ThermalSolver solver(scene);
  Drag drag;
  drag.from = {0.0053f, 0.0051f};
  drag.to = {0.0083f, 0.0051f};
  RunDrag(drag, kDt, &solver);
  while (!solver.at_commit_frame()) solver.Step(TipInput{}, kDt);
  std::vector<std::byte> bytes(ThermalSolver::CheckpointCapacity(scene));
  // Altered in memory and then saved, like a flipped bit in a cell.
  const auto refuses = [&](auto* value, auto bad) {
    const auto good = std::exchange(*value, bad);
    const std::size_t used = solver.Save(bytes);
    ThermalSolver other(scene);
    const bool refused = used > 0 && !other.Restore(std::span(bytes).first(used));
    *value = good;
    return refused && other.FullHash() == ThermalSolver(scene).FullHash();
  };
  TileState& s = solver.mutable_field()->Wake(1, 1)->state;
  EXPECT_FALSE(refuses(&s.water[7], s.water[7]));
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  for (float* value : {&s.enthalpy[7], &s.water[7], &s.omega_cell[7], &s.omega_collagen[7], &s.charred[7]}) {
    EXPECT_TRUE(refuses(value, kNan));
    EXPECT_TRUE(refuses(value, 1e30f));
  }
  EXPECT_TRUE(refuses(&s.water[7], -0.1f));
  EXPECT_TRUE(refuses(&s.flags[7], static_cast<std::uint8_t>(kOutside)));
  EXPECT_TRUE(refuses(&s.awake, std::uint8_t{2}));
}

}  // namespace
}  // namespace fulcrum::thermal
