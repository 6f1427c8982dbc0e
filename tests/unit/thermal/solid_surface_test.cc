// Burns on the surface of a solid: size, energy, charts, checkpoint.
#include "thermal_node/coupling/solid_surface.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <utility>
#include <vector>

namespace fulcrum::thermal {
namespace {

constexpr float kDt = 0.01f;

/// A plate of 30 x 20 mm in the plane z = 0, and a wall of 30 x 20 mm that rises from its far side.
class SolidSurfaceTest : public testing::Test {
 protected:
  SolidSurfaceTest() {
    constexpr Index kColumns = 12, kRows = 8;
    const auto add = [&](const Vec3f& corner, const Vec3f& u, const Vec3f& v) {
      const auto first = static_cast<Index>(vertices_.size());
      for (Index r = 0; r <= kRows; ++r) {
        for (Index c = 0; c <= kColumns; ++c) {
          vertices_.push_back(corner + u * (static_cast<float>(c) / kColumns) + v * (static_cast<float>(r) / kRows));
        }
      }
      for (Index r = 0; r < kRows; ++r) {
        for (Index c = 0; c < kColumns; ++c) {
          const Index a = first + r * (kColumns + 1) + c, b = a + kColumns + 1;
          triangles_.push_back({a, a + 1, b + 1});
          triangles_.push_back({a, b + 1, b});
        }
      }
    };
    add({0, 0, 0}, {0.03f, 0, 0}, {0, 0.02f, 0});
    add({0, 0.02f, 0}, {0.03f, 0, 0}, {0, 0, 0.02f});
    scene_.rest_position = vertices_;
    scene_.tube_surface = triangles_;
    charts_ = MakeSolidCharts(scene_);
  }

  /// The sample of a disc of metal at a point of the plate.
  [[nodiscard]] TipInput At(const Vec3f& p, CauteryMode mode, float power_W, const Vec3f& step = Vec3f::Zero()) const {
    TipInput tip;
    tip.active = power_W > 0;
    tip.touching = true;
    tip.path.from = charts_.charts[0].Material(p);
    tip.path.to = charts_.charts[0].Material(p + step);
    tip.path.radius_m = 5e-4f;
    tip.mode = mode;
    tip.power_W = power_W;
    return tip;
  }
  /// Number of cells of a chart for which count(state, cell) is true.
  template <class Count>
  [[nodiscard]] int CellsOf(const SolidSurface& solids, const SolidChart& chart, const Count& count) const {
    int cells = 0;
    for (const Tile* tile : solids.field().Existing()) {
      for (int k = 0; k < kTileCells; ++k) {
        const int x = tile->tx * kTile + k % kTile, y = tile->ty * kTile + k / kTile;
        const bool inside = x >= chart.x && x < chart.x + chart.width && y >= chart.y && y < chart.y + chart.height;
        cells += inside && count(tile->state, k) ? 1 : 0;
      }
    }
    return cells;
  }

  std::vector<Vec3f> vertices_;
  std::vector<Triangle> triangles_;
  TissueScene scene_;
  SolidCharts charts_;
  Interface hook_;
};

TEST_F(SolidSurfaceTest, CostsNothingUntilItIsHeated) {
  SolidSurface solids(scene_);
  EXPECT_FALSE(solids.Step({}, kDt, &hook_));
  const TipInput cold = At({0.01f, 0.01f, 0}, CauteryMode::kOff, 0);
  EXPECT_FALSE(solids.Step(std::span(&cold, 1), kDt, &hook_));
  EXPECT_TRUE(solids.field().Existing().empty());
  EXPECT_EQ(solids.TickHash(), 0u);
}

/// A disc of radius a on a half space of conductivity sigma conducts 4 sigma a.
TEST_F(SolidSurfaceTest, ColdTissueConductsAsAHalfSpace) {
  for (const float radius_m : {5e-4f, 1e-3f, 1.5e-3f}) {
    SolidSurface solids(scene_);
    TipInput tip = At({0.015f, 0.01f, 0}, CauteryMode::kCoag, 0.01f);
    tip.path.radius_m = radius_m;
    ASSERT_TRUE(solids.Step(std::span(&tip, 1), kDt, &hook_));
    const float conductance_S = solids.power_W() / (solids.voltage_V() * solids.voltage_V());
    EXPECT_NEAR(conductance_S / (4 * scene_.thermal.sigma_S_m * radius_m), 1.0f, 0.08f) << radius_m;
  }
}

TEST_F(SolidSurfaceTest, CoagulationBlanchesMillimetresAndOpensNothing) {
  SolidSurface solids(scene_);
  const TipInput tip = At({0.012f, 0.01f, 0}, CauteryMode::kCoag, 30);
  float last_mm2 = 0;
  int reports = 0;
  for (int frame = 1; frame <= 200; ++frame) {
    ASSERT_TRUE(solids.Step(std::span(&tip, 1), kDt, &hook_));
    reports += static_cast<int>(solids.burns().size());
    EXPECT_GE(1e6f * solids.dead_m2(), last_mm2);
    last_mm2 = 1e6f * solids.dead_m2();
  }
  // Two seconds: more than the metal covers, less than a disc of 8 mm.
  EXPECT_GT(last_mm2, 2.0f);
  EXPECT_LT(last_mm2, 50.0f);
  EXPECT_GT(reports, 1);
  EXPECT_GT(solids.highest_C(), 90.0f);
  EXPECT_LT(solids.ledger().ClosureError(solids.field().Stored()), 1e-3);
  const auto removed = [](const TileState& s, int k) { return (s.flags[k] & kRemoved) != 0; };
  EXPECT_EQ(CellsOf(solids, charts_.charts[0], removed), 0);
  EXPECT_GT(solids.power_W(), 0.0f);
  EXPECT_LE(solids.power_W(), 30.1f);
}

TEST_F(SolidSurfaceTest, TheGeneratorsFiguresEndWithTheSamples) {
  SolidSurface solids(scene_);
  const TipInput tip = At({0.012f, 0.01f, 0}, CauteryMode::kCoag, 30);
  for (int frame = 0; frame < 10; ++frame) ASSERT_TRUE(solids.Step(std::span(&tip, 1), kDt, &hook_));
  ASSERT_GT(solids.power_W(), 1.0f);
  for (int frame = 0; frame < 5; ++frame) ASSERT_TRUE(solids.Step({}, kDt, &hook_));
  EXPECT_EQ(solids.set_power_W(), 30.0f) << "a gap of 50 ms between two samples";
  for (int frame = 0; frame < 10; ++frame) ASSERT_TRUE(solids.Step({}, kDt, &hook_)) << "still warm";
  EXPECT_EQ(solids.power_W(), 0.0f);
  EXPECT_EQ(solids.set_power_W(), 0.0f);
  EXPECT_EQ(solids.voltage_V(), 0.0f);
}

TEST_F(SolidSurfaceTest, CutLeavesAPitAsWideAsTheMetal) {
  SolidSurface solids(scene_);
  const Vec3f step(4e-3f * kDt, 0, 0);
  for (int frame = 0; frame < 250; ++frame) {
    const TipInput tip = At(Vec3f(0.008f, 0.01f, 0) + static_cast<float>(frame) * step, CauteryMode::kCut, 35, step);
    solids.Step(std::span(&tip, 1), kDt, &hook_);
  }
  const auto removed = [](const TileState& s, int k) { return (s.flags[k] & kRemoved) != 0; };
  const float area_mm2 = 0.04f * static_cast<float>(CellsOf(solids, charts_.charts[0], removed));
  EXPECT_GT(area_mm2, 10.0f * 0.6f);
  EXPECT_LT(area_mm2, 11.0f * 2.4f);
  EXPECT_LT(solids.ledger().ClosureError(solids.field().Stored()), 1e-3);
  EXPECT_GT(hook_.hook_theta, 5.0f);
}

TEST_F(SolidSurfaceTest, HeatStaysInItsChart) {
  ASSERT_EQ(charts_.charts.size(), 2u);
  SolidSurface solids(scene_);
  const TipInput tip = At({0.012f, 0.0195f, 0}, CauteryMode::kCoag, 40);
  for (int frame = 0; frame < 100; ++frame) solids.Step(std::span(&tip, 1), kDt, &hook_);
  const auto hurt = [](const TileState& s, int k) { return s.omega_cell[k] > 0; };
  EXPECT_GT(CellsOf(solids, charts_.charts[0], hurt), 50);
  EXPECT_EQ(CellsOf(solids, charts_.charts[1], hurt), 0);
}

TEST_F(SolidSurfaceTest, HotMetalScorchesWithoutCurrent) {
  SolidSurface solids(scene_);
  hook_.hook_theta = 300;
  const TipInput tip = At({0.012f, 0.01f, 0}, CauteryMode::kOff, 0);
  for (int frame = 0; frame < 100; ++frame) solids.Step(std::span(&tip, 1), kDt, &hook_);
  EXPECT_GT(1e6f * solids.dead_m2(), 0.3f);
  // What the metal has lost is in the tissue.
  EXPECT_LT(hook_.hook_theta, 299.0f);
  const auto lost_J = static_cast<double>(kHookHeatCapacity_J_K * (300 - hook_.hook_theta));
  EXPECT_NEAR(solids.ledger().hook, lost_J, 1e-3 * lost_J);
  EXPECT_EQ(solids.power_W(), 0.0f);
}

TEST_F(SolidSurfaceTest, ComesToRest) {
  SolidSurface solids(scene_);
  const TipInput tip = At({0.012f, 0.01f, 0}, CauteryMode::kCoag, 30);
  for (int frame = 0; frame < 50; ++frame) solids.Step(std::span(&tip, 1), kDt, &hook_);
  int frames = 0;
  while (solids.Step({}, kDt, &hook_) && frames < 6000) ++frames;
  EXPECT_LT(frames, 6000);
  EXPECT_GT(frames, 100);
}

TEST_F(SolidSurfaceTest, ContinuesFromACheckpointBitForBit) {
  SolidSurface solids(scene_);
  const TipInput tip = At({0.012f, 0.01f, 0}, CauteryMode::kBlend, 30);
  for (int frame = 0; frame < 73; ++frame) solids.Step(std::span(&tip, 1), kDt, &hook_);
  std::vector<std::byte> bytes(SolidSurface::CheckpointCapacity());
  bytes.resize(solids.Save(bytes));
  ASSERT_GT(bytes.size(), 1000u);
  SolidSurface again(scene_);
  ASSERT_TRUE(again.Restore(bytes));
  Interface hook = hook_;
  for (int frame = 0; frame < 40; ++frame) {
    solids.Step(std::span(&tip, 1), kDt, &hook_);
    again.Step(std::span(&tip, 1), kDt, &hook);
    ASSERT_EQ(solids.TickHash(), again.TickHash()) << frame;
  }
  // Damaged ones are refused as a whole.
  for (std::size_t at = 0; at < bytes.size(); at += bytes.size() / 61) {
    std::vector<std::byte> cut(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(at));
    SolidSurface fresh(scene_);
    EXPECT_FALSE(fresh.Restore(cut));
    EXPECT_EQ(fresh.TickHash(), 0u);
    EXPECT_TRUE(fresh.field().Existing().empty());
  }
  std::vector<std::byte> untouched(SolidSurface::CheckpointCapacity());
  untouched.resize(SolidSurface(scene_).Save(untouched));
  EXPECT_LT(untouched.size(), 400u);
  SolidSurface fresh(scene_);
  EXPECT_TRUE(fresh.Restore(untouched));
  // The last word but one says which solids were warned of: none may be beyond the last one.
  const std::size_t warned_at = untouched.size() - 2 * sizeof(std::uint32_t);
  for (const auto& [solid, is_valid] : {std::pair{kMaxSolids - 1, true}, {kMaxSolids, false}, {Index{31}, false}}) {
    const std::uint32_t warned = 1u << solid;
    std::memcpy(&untouched[warned_at], &warned, sizeof(warned));
    EXPECT_EQ(fresh.Restore(untouched), is_valid) << solid;
  }
}

TEST_F(SolidSurfaceTest, OnlyOfWhatWasHeatedIsWarned) {
  // Warm from the start.
  scene_.thermal.body_temperature_C = 46;
  SolidSurface solids(scene_);
  const TipInput tip = At({0.012f, 0.01f, 0}, CauteryMode::kCoag, 30);
  std::vector<SolidWarning> warnings;
  for (int frame = 0; frame < 30; ++frame) {
    solids.Step(std::span(&tip, 1), kDt, &hook_);
    warnings.insert(warnings.end(), solids.warnings().begin(), solids.warnings().end());
  }
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_EQ(warnings[0].solid, 0u);
  EXPECT_TRUE(solids.warned(0));
  EXPECT_FALSE(solids.warned(1));
}

TEST_F(SolidSurfaceTest, BadValuesDoNotSpread) {
  SolidSurface solids(scene_);
  const TipInput tip = At({0.012f, 0.01f, 0}, CauteryMode::kCoag, 30);
  for (int frame = 0; frame < 20; ++frame) solids.Step(std::span(&tip, 1), kDt, &hook_);
  Tile* tile = solids.mutable_field()->awake()[0];
  tile->state.omega_cell[500] = NAN;
  tile->state.enthalpy[501] = INFINITY;
  tile->state.water[502] = -3;
  for (int frame = 0; frame < 20; ++frame) solids.Step(std::span(&tip, 1), kDt, &hook_);
  EXPECT_GE(solids.field().quarantined(), 1u);
  EXPECT_LE(solids.field().quarantined(), 3u);
  EXPECT_TRUE(std::isfinite(solids.field().Stored()));
}

}  // namespace
}  // namespace fulcrum::thermal
