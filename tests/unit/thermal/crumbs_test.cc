// Pieces of sheet that a cut has separated.
#include "thermal_node/topology/crumbs.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tests/numerics/thermal/flat_scene.h"

namespace fulcrum::thermal {
namespace {

constexpr float kCell_m = 1e-4f;
constexpr CellIndex kMiddle{155, 105};

class CrumbsTest : public ::testing::Test {
 protected:
  CrumbsTest() : data_(FlatScene(21, 31, 1e-3f)), field_(MakeSheet(data_.View()), MakeMaterial(ThermalParams{})) {}

  void Remove(CellIndex cell) {
    double heat = 0;
    field_.TakeOut(field_.Wake(cell.ix / kTile, cell.iy / kTile), Place(cell), kRemoved, &heat);
    changed_.Add(cell);
  }
  /// A slit of two cells around a square of tissue.
  void CutAround(CellIndex middle, int half_cells) {
    for (int dy = -half_cells - 2; dy <= half_cells + 2; ++dy) {
      for (int dx = -half_cells - 2; dx <= half_cells + 2; ++dx) {
        if (std::max(std::abs(dx), std::abs(dy)) > half_cells) Remove({middle.ix + dx, middle.iy + dy});
      }
    }
  }
  [[nodiscard]] bool Removed(CellIndex cell) const {
    const Tile* tile = field_.Find(cell.ix / kTile, cell.iy / kTile);
    return tile != nullptr && (tile->state.flags[Place(cell)] & kRemoved) != 0;
  }
  [[nodiscard]] int CountRemoved() const {
    int count = 0;
    for (int iy = 0; iy < field_.sheet().ny; ++iy) {
      for (int ix = 0; ix < field_.sheet().nx; ++ix) count += Removed({ix, iy}) ? 1 : 0;
    }
    return count;
  }
  static int Place(CellIndex cell) { return (cell.iy % kTile) * kTile + cell.ix % kTile; }

  scene::SceneData data_;
  HeatField field_;
  Crumbs crumbs_;
  RemovedBox changed_;
  Ledger ledger_;
};

TEST_F(CrumbsTest, APieceThatIsCutFreeGoesWithItsHeatBooked) {
  CutAround(kMiddle, 8);  // 17 x 17 cells: 2.9 mm^2
  Tile* tile = field_.Wake(kMiddle.ix / kTile, kMiddle.iy / kTile);
  tile->state.enthalpy[Place(kMiddle)] = 20.0f * field_.material().HeatCapacity(1.0f);
  const double held = static_cast<double>(tile->state.enthalpy[Place(kMiddle)]) * tile->Volume(Place(kMiddle));
  const int before = CountRemoved();
  const RemovedBox removed = crumbs_.TakeOut(&field_, changed_, &ledger_);
  EXPECT_EQ(removed.low.ix, kMiddle.ix - 8);
  EXPECT_EQ(removed.low.iy, kMiddle.iy - 8);
  EXPECT_EQ(removed.high.ix, kMiddle.ix + 8);
  EXPECT_EQ(removed.high.iy, kMiddle.iy + 8);
  EXPECT_EQ(CountRemoved(), before + 17 * 17) << "its cells and no others";
  EXPECT_NEAR(ledger_.debris, held, 1e-6 * held);
  EXPECT_NEAR(crumbs_.area_m2(), 17 * 17 * kCell_m * kCell_m, 1e-9);
  EXPECT_TRUE(crumbs_.TakeOut(&field_, changed_, &ledger_).empty()) << "once";
}

TEST_F(CrumbsTest, APieceOfFiveSquareMillimetresStays) {
  CutAround(kMiddle, 11);  // 23 x 23 cells: 5.3 mm^2
  EXPECT_TRUE(crumbs_.TakeOut(&field_, changed_, &ledger_).empty());
  EXPECT_FALSE(Removed(kMiddle));
  EXPECT_EQ(crumbs_.area_m2(), 0.0);
  EXPECT_EQ(ledger_.debris, 0.0);
}

TEST_F(CrumbsTest, WhatHangsOnByOneFaceStaysAndByACornerGoes) {
  CutAround(kMiddle, 5);
  const CellIndex inner{kMiddle.ix + 6, kMiddle.iy}, outer{kMiddle.ix + 7, kMiddle.iy};
  for (const CellIndex cell : {inner, outer}) {  // a bridge across the slit, one cell wide
    Tile* tile = field_.Wake(cell.ix / kTile, cell.iy / kTile);
    std::uint8_t& flags = tile->state.flags[Place(cell)];
    flags = static_cast<std::uint8_t>(flags & ~kRemoved);
  }
  EXPECT_TRUE(crumbs_.TakeOut(&field_, changed_, &ledger_).empty());
  Remove(outer);
  // The rest of the bridge belongs to the piece and does not touch the sheet.
  EXPECT_FALSE(crumbs_.TakeOut(&field_, changed_, &ledger_).empty());
  EXPECT_TRUE(Removed(kMiddle));
  EXPECT_TRUE(Removed(inner));
}

TEST_F(CrumbsTest, EachOfSeveralIsJudgedForItself) {
  const CellIndex small{60, 60}, large{200, 100};
  CutAround(small, 3);
  CutAround(large, 12);
  EXPECT_FALSE(crumbs_.TakeOut(&field_, changed_, &ledger_).empty());
  EXPECT_TRUE(Removed(small));
  EXPECT_FALSE(Removed(large));
  EXPECT_NEAR(crumbs_.area_m2(), 7 * 7 * kCell_m * kCell_m, 1e-10);
}

TEST_F(CrumbsTest, NothingIsTakenWhereNothingWasCut) {
  EXPECT_TRUE(crumbs_.TakeOut(&field_, changed_, &ledger_).empty());
  // A piece that was separated elsewhere remains until something changes there.
  CutAround(kMiddle, 4);
  RemovedBox elsewhere;
  elsewhere.Add(CellIndex{20, 20});
  EXPECT_TRUE(crumbs_.TakeOut(&field_, elsewhere, &ledger_).empty());
  EXPECT_FALSE(Removed(kMiddle));
}

TEST_F(CrumbsTest, AHoleAtTheBorderOfTheSheetLeavesTheSheet) {
  for (int iy = 0; iy < 6; ++iy) {
    for (int ix = 0; ix < 6; ++ix) Remove({ix, iy});
  }
  EXPECT_TRUE(crumbs_.TakeOut(&field_, changed_, &ledger_).empty());
}

}  // namespace
}  // namespace fulcrum::thermal
