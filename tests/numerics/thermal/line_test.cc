// Straight cuts at any angle, place and speed: the membrane is open along the whole path of the tip, and the mesh
// connects nothing that the cells do not.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "tests/numerics/thermal/flat_scene.h"
#include "tests/numerics/thermal/topology_validator.h"

namespace fulcrum::thermal {
namespace {

constexpr float kDt = 0.01f;
constexpr int kNodes = 10;
constexpr float kSpacing_m = 1e-3f;
constexpr float kNear_m = 1e-4f, kFar_m = kSpacing_m * (kNodes - 1) - kNear_m;  ///< Ends of the path, at the borders.
constexpr float kFastestCut_m_s = 0.008f;

/// Pieces of tissue that are connected over faces of cells: a number per cell, -1 where there is no tissue.
class Pieces {
 public:
  explicit Pieces(const HeatField& field) : sheet_(field.sheet()) {
    const auto cells = static_cast<std::size_t>(sheet_.nx) * sheet_.ny;
    piece_.assign(cells, kUnknown);
    for (int iy = 0; iy < sheet_.ny; ++iy) {
      for (int ix = 0; ix < sheet_.nx; ++ix) {
        if (IsRemoved(field, {ix, iy}) || sheet_.IsOutside(ix, iy)) At({ix, iy}) = kNone;
      }
    }
    for (std::size_t k = 0; k < cells; ++k) {
      if (piece_[k] == kUnknown) Flood({static_cast<int>(k) % sheet_.nx, static_cast<int>(k) / sheet_.nx}, count_++);
    }
  }
  [[nodiscard]] int Of(const Vec2f& material) {
    CellIndex cell = sheet_.CellOf(material);
    cell = {std::min(cell.ix, sheet_.nx - 1), std::min(cell.iy, sheet_.ny - 1)};
    return At(cell);
  }

 private:
  static constexpr int kUnknown = -2, kNone = -1;
  int& At(CellIndex cell) { return piece_[static_cast<std::size_t>(cell.iy) * sheet_.nx + cell.ix]; }
  void Flood(CellIndex from, int piece) {
    std::vector<CellIndex> stack{from};
    At(from) = piece;
    while (!stack.empty()) {
      const CellIndex c = stack.back();
      stack.pop_back();
      for (const CellIndex next : {CellIndex{c.ix + 1, c.iy}, CellIndex{c.ix - 1, c.iy}, CellIndex{c.ix, c.iy + 1},
                                   CellIndex{c.ix, c.iy - 1}}) {
        if (!sheet_.Contains(next) || At(next) != kUnknown) continue;
        At(next) = piece;
        stack.push_back(next);
      }
    }
  }

  const Sheet& sheet_;
  std::vector<int> piece_;
  int count_ = 0;
};

/// Live edges whose ends lie in different pieces of tissue, or in none.
int FalseBridges(const SceneView& scene, const ThermalSolver& solver) {
  Pieces pieces(solver.field());
  int bridges = 0;
  for (std::size_t e = 0; e < scene.membrane_rest_length.size(); ++e) {
    if (scene.membrane_rest_length[e] <= 0 || TestBit(solver.topology().committed().dead_edges, e)) continue;
    const std::size_t node = e / 3;
    const std::size_t other = e % 3 == 0 ? node + 1 : (e % 3 == 1 ? node + kNodes : node + kNodes + 1);
    const int a = pieces.Of(scene.membrane_material[node]), b = pieces.Of(scene.membrane_material[other]);
    bridges += a < 0 || a != b ? 1 : 0;
  }
  return bridges;
}

class LineTest : public ::testing::Test {
 protected:
  /// Cuts from `from` to `to` at 35 W, held still at both ends until the tissue there is removed. A tip faster than
  /// kFastestCut_m_s leaves tissue at this power, but the mesh must still agree with the cells.
  void Cut(const Vec2f& from, const Vec2f& to, float speed_m_s) {
    SCOPED_TRACE("from " + std::to_string(1e3f * from.x()) + ", " + std::to_string(1e3f * from.y()) + " to " +
                 std::to_string(1e3f * to.x()) + ", " + std::to_string(1e3f * to.y()) + " mm at " +
                 std::to_string(1e3f * speed_m_s) + " mm/s");
    ThermalSolver solver(scene_);
    TopologyValidator validator(scene_, solver.field().sheet());
    Drag drag;
    drag.from = from;
    drag.to = to;
    drag.speed_m_s = speed_m_s;
    Hold(drag.At(0, kDt), from, &solver);
    for (int frame = 0; frame < drag.frames(kDt); ++frame) solver.Step(drag.At(frame, kDt), kDt);
    Hold(drag.At(0, kDt), to, &solver);
    while (!solver.at_commit_frame()) solver.Step(TipInput{}, kDt);
    EXPECT_EQ(validator.Check(solver), "");
    EXPECT_EQ(FalseBridges(scene_, solver), 0);
    if (speed_m_s > kFastestCut_m_s) return;
    // Open at every station of the path, in the mesh, too; two sides without a connection.
    const SlitFigures slit = MeasureSlit(solver, scene_, drag);
    EXPECT_GE(slit.width_min_m, 5e-4f);
    EXPECT_EQ(slit.surviving_crossings, 0);
    Pieces pieces(solver.field());
    const Vec2f along = (to - from).normalized(), across = 0.002f * Vec2f(-along.y(), along.x());
    const int left = pieces.Of(0.5f * (from + to) + across), right = pieces.Of(0.5f * (from + to) - across);
    EXPECT_GE(std::min(left, right), 0);
    EXPECT_NE(left, right);
  }

  static void Hold(TipInput tip, const Vec2f& at, ThermalSolver* solver) {
    tip.path.from = tip.path.to = at;
    for (int frame = 0; frame < 10; ++frame) solver->Step(tip, kDt);
  }

  const scene::SceneData data_ = FlatScene(kNodes, kNodes, kSpacing_m);
  const SceneView scene_ = data_.View();
};

TEST_F(LineTest, AlongRowsAcrossRowsAndDiagonal) {
  for (const float speed : {0.003f, 0.006f, 0.03f}) {
    for (const float at : {0.004f, 0.0045f}) {  // on a row, between two
      Cut({kNear_m, at}, {kFar_m, at}, speed);
      Cut({at, kNear_m}, {at, kFar_m}, speed);
      const float shift = at - 0.004f;
      Cut({kNear_m, kNear_m + shift}, {kFar_m - shift, kFar_m}, speed);
      Cut({kNear_m, kFar_m - shift}, {kFar_m - shift, kNear_m}, speed);
    }
  }
}

TEST_F(LineTest, TwoHundredRandomLinesLeaveNoBridge) {
  std::mt19937 random(11);
  std::uniform_real_distribution<float> uniform(0, 1);
  for (int line = 0; line < 200; ++line) {
    // Between opposite borders, so that the chord is long and two pieces result.
    const float a = std::lerp(kNear_m, kFar_m, 0.2f + 0.6f * uniform(random));
    const float b = std::lerp(kNear_m, kFar_m, 0.2f + 0.6f * uniform(random));
    const bool level = uniform(random) < 0.5f;
    // 4 … 8 mm/s, every fourth line up to 60.
    const float speed =
        line % 4 == 3 ? 0.01f * std::pow(6.0f, uniform(random)) : std::lerp(0.004f, 0.008f, uniform(random));
    level ? Cut({kNear_m, a}, {kFar_m, b}, speed) : Cut({a, kNear_m}, {b, kFar_m}, speed);
    if (HasFailure()) return;
  }
}

}  // namespace
}  // namespace fulcrum::thermal
