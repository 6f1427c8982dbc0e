// Edges and nodes of the mesh against holes in the cells.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/numerics/thermal/flat_scene.h"
#include "tests/numerics/thermal/heat_cases.h"
#include "tests/support/several_solids.h"
#include "thermal_node/topology/mesh_topology.h"

namespace fulcrum::thermal {
namespace {

constexpr float kCell = 1e-4f;
constexpr std::uint32_t kRows = 21, kCols = 31;

class TopologyTest : public ::testing::Test {
 protected:
  TopologyTest()
      : data_(FlatScene(kRows, kCols, 1e-3f)),
        scene_(data_.View()),
        field_(MakeSheet(scene_), MakeMaterial(scene_.thermal)),
        topology_(scene_, field_.sheet()) {}

  /// Removes the cells [x0, x1] x [y0, y1] and updates the topology.
  void Remove(int x0, int y0, int x1, int y1) {
    double heat = 0;
    for (int y = y0; y <= y1; ++y) {
      for (int x = x0; x <= x1; ++x) {
        field_.TakeOut(field_.Wake(x / kTile, y / kTile), (y % kTile) * kTile + x % kTile, kRemoved, &heat);
      }
    }
    topology_.StageCut(field_, {x0, y0}, {x1, y1});
  }
  [[nodiscard]] bool EdgeDead(std::uint32_t row, std::uint32_t col, std::uint32_t direction) const {
    return TestBit(topology_.committed().dead_edges, 3 * (row * kCols + col) + direction);
  }
  [[nodiscard]] bool NodeDead(std::uint32_t row, std::uint32_t col) const {
    return TestBit(topology_.committed().dead_nodes, row * kCols + col);
  }

  scene::SceneData data_;
  SceneView scene_;
  HeatField field_;
  MeshTopology topology_;
};

TEST_F(TopologyTest, SlitOfOneCellBetweenTheRowsCutsWhatCrossesIt) {
  // Rows lie at cells 50 and 60; the slit at 55 touches no node.
  Remove(42, 55, 258, 55);
  EXPECT_TRUE(topology_.Commit());
  for (std::uint32_t col = 5; col < 25; ++col) {
    EXPECT_TRUE(EdgeDead(5, col, 1)) << col;   // to the next row
    EXPECT_TRUE(EdgeDead(5, col, 2)) << col;   // diagonal
    EXPECT_FALSE(EdgeDead(5, col, 0)) << col;  // along the slit
    EXPECT_FALSE(EdgeDead(6, col, 0)) << col;
    EXPECT_FALSE(NodeDead(5, col));
  }
  EXPECT_FALSE(EdgeDead(4, 15, 1));
  EXPECT_FALSE(EdgeDead(6, 15, 1));
  EXPECT_EQ(topology_.dead_node_count(), 0u);
}

TEST_F(TopologyTest, DiagonalSlitOfTouchingCornersCutsToo) {
  double heat = 0;
  for (int n = 40; n < 160; ++n) {
    field_.TakeOut(field_.Wake(n / kTile, n / kTile), (n % kTile) * kTile + n % kTile, kRemoved, &heat);
  }
  topology_.StageCut(field_, {40, 40}, {159, 159});
  topology_.Commit();
  // Direction 1 from (r, c) with c = r leads away from the diagonal; from (r, r+1) it crosses it at (r+1, r+1): both
  // ends of these edges lie on the slit. The edge from (r, c+1) down to (r+1, c+1) ends on it.
  for (std::uint32_t r = 5; r < 15; ++r) {
    EXPECT_TRUE(NodeDead(r, r));
    EXPECT_TRUE(EdgeDead(r, r, 0));
    EXPECT_TRUE(EdgeDead(r, r, 2));
  }
  EXPECT_FALSE(EdgeDead(5, 8, 1));
}

TEST_F(TopologyTest, PinHoleInAStrandDoesNotCutIt) {
  Remove(55, 50, 55, 50);  // on the segment from (5,5) to (5,6)
  EXPECT_FALSE(topology_.Commit());
  EXPECT_EQ(topology_.revision(), 0u);
  EXPECT_FALSE(EdgeDead(5, 5, 0));
}

TEST_F(TopologyTest, NodeDiesWithItsCellOrWithItsLastEdge) {
  Remove(50, 50, 50, 50);
  topology_.Commit();
  EXPECT_TRUE(NodeDead(5, 5));
  EXPECT_TRUE(EdgeDead(5, 5, 0) && EdgeDead(5, 5, 1) && EdgeDead(5, 5, 2));
  EXPECT_TRUE(EdgeDead(5, 4, 0) && EdgeDead(4, 5, 1) && EdgeDead(4, 4, 2));
  EXPECT_FALSE(NodeDead(5, 6));
  // A ring of removed cells around node (10, 10), whose own cell stays.
  Remove(96, 96, 104, 97);
  Remove(96, 103, 104, 104);
  Remove(96, 98, 97, 102);
  Remove(103, 98, 104, 102);
  topology_.Commit();
  EXPECT_TRUE(NodeDead(10, 10));
}

TEST_F(TopologyTest, NothingShowsBeforeCommitAndRevisionsCountCommits) {
  Remove(42, 55, 258, 55);
  EXPECT_TRUE(topology_.staged());
  EXPECT_FALSE(EdgeDead(5, 10, 1));
  EXPECT_TRUE(topology_.Commit());
  EXPECT_EQ(topology_.revision(), 1u);
  EXPECT_TRUE(EdgeDead(5, 10, 1));
  EXPECT_FALSE(topology_.Commit());
  EXPECT_EQ(topology_.revision(), 1u);
}

TEST_F(TopologyTest, ShrinkIsTakenOnceFromTheRestLength) {
  Tile* tile = field_.Wake(3, 3);
  for (int ty = 2; ty <= 4; ++ty) {
    for (int tx = 2; tx <= 4; ++tx) field_.Wake(tx, ty)->state.omega_collagen.fill(1.0f);
  }
  // Node (11, 11) is inside tile (3, 3); both ends of its edge are damaged, which must count once.
  const std::size_t edge = 3 * (11 * kCols + 11);
  const float expected = scene_.thermal.shrink_max * (1 - std::exp(-1.0f));
  for (int n = 0; n < 3; ++n) {
    topology_.StageShrink(field_, *tile);
    topology_.Commit();
    const float lost = static_cast<float>(topology_.committed().shrink[edge]) * kShrinkUnit;
    EXPECT_NEAR(lost, expected, kShrinkStep * kShrinkUnit);
    EXPECT_LE(lost, expected);
  }
  EXPECT_EQ(topology_.revision(), 1u);
}

TEST_F(TopologyTest, CellsBeyondTheBorderAreNoBridge) {
  // A sheared sheet, whose left border crosses the bands of its edges. All tissue of one row of cells is removed.
  scene::SceneData data = FlatScene(kRows, kCols, 1e-3f);
  for (Vec2f& p : data.membrane_material) p.x() += 0.5f * p.y();
  const SceneView scene = data.View();
  HeatField field(MakeSheet(scene), MakeMaterial(scene.thermal));
  MeshTopology topology(scene, field.sheet());
  double heat = 0;
  for (int x = 0; x < field.sheet().nx; ++x) {
    if (field.sheet().IsOutside(x, 55)) continue;
    field.TakeOut(field.Wake(x / kTile, 55 / kTile), (55 % kTile) * kTile + x % kTile, kRemoved, &heat);
  }
  topology.StageCut(field, {0, 55}, {field.sheet().nx - 1, 55});
  topology.Commit();
  for (std::uint32_t col = 0; col < kCols; ++col) {
    EXPECT_TRUE(TestBit(topology.committed().dead_edges, 3 * (5 * kCols + col) + 1)) << col;
    EXPECT_FALSE(TestBit(topology.committed().dead_edges, 3 * (4 * kCols + col) + 1)) << col;
  }
}

TEST_F(TopologyTest, StrandsThatTheCellsDoNotResolveAreNotSeveredByWhatHappensBesideThem) {
  // At an acute corner the border strands cross cells whose centres lie beyond the sheet.
  scene::SceneData data = FlatScene(6, 6, 1e-3f);
  for (Vec2f& p : data.membrane_material) p.x() += 8.0f * p.y();
  const SceneView scene = data.View();
  HeatField field(MakeSheet(scene), MakeMaterial(scene.thermal));
  MeshTopology topology(scene, field.sheet());
  topology.StageCut(field, {0, 0}, {field.sheet().nx - 1, field.sheet().ny - 1});
  EXPECT_FALSE(topology.Commit());
}

TEST_F(TopologyTest, BadDamageInACellIsNotSeenInTheMesh) {
  Tile* tile = field_.Wake(3, 3);
  tile->state.omega_collagen.fill(0.2f);
  tile->state.omega_collagen[14 * kTile + 16] = NAN;  // on the edge from (11, 11) to (11, 12)
  topology_.StageShrink(field_, *tile);
  topology_.Commit();
  const float lost = static_cast<float>(topology_.committed().shrink[3 * (11 * kCols + 11)]) * kShrinkUnit;
  EXPECT_NEAR(lost, 0.9f * scene_.thermal.shrink_max * (1 - std::exp(-0.2f)), kShrinkStep * kShrinkUnit);
}

TEST_F(TopologyTest, ArraysThatDoNotFitTheMeshAreToldApart) {
  Remove(42, 55, 150, 55);
  Remove(50, 70, 50, 70);  // a node
  topology_.Commit();
  const TopologyBits good = topology_.committed();
  EXPECT_TRUE(topology_.Fits(good));
  const auto fits = [&](const auto& spoil) {
    TopologyBits bad = good;
    spoil(&bad);
    return topology_.Fits(bad);
  };
  EXPECT_FALSE(fits([](TopologyBits* b) { b->shrink.pop_back(); }));
  EXPECT_FALSE(fits([](TopologyBits* b) { SetBit(b->dead_nodes, kRows * kCols); }));      // beyond the mesh
  EXPECT_FALSE(fits([](TopologyBits* b) { SetBit(b->dead_edges, 3 * (kCols - 1)); }));    // does not exist
  EXPECT_FALSE(fits([](TopologyBits* b) { b->shrink[3 * (kCols - 1)] = kShrinkStep; }));  // neither
  EXPECT_FALSE(fits([](TopologyBits* b) { SetBit(b->dead_nodes, 10 * kCols + 20); }));    // has live edges
}

TEST_F(TopologyTest, RestoredTopologyGoesOn) {
  Remove(42, 55, 150, 55);
  topology_.Commit();
  MeshTopology other(scene_, field_.sheet());
  other.Restore(topology_.revision(), topology_.committed());
  EXPECT_EQ(other.dead_edge_count(), topology_.dead_edge_count());
  double heat = 0;
  for (int x = 151; x < 258; ++x) {
    field_.TakeOut(field_.Wake(x / kTile, 55 / kTile), (55 % kTile) * kTile + x % kTile, kRemoved, &heat);
  }
  other.StageCut(field_, {151, 55}, {257, 55});
  EXPECT_TRUE(other.Commit());
  EXPECT_EQ(other.revision(), topology_.revision() + 1);
  EXPECT_GT(other.dead_edge_count(), topology_.dead_edge_count());
}

/// Cells of a second sheet lie apart from those of the first: heat stays in it, and a hole cuts its edges only.
TEST(SeveralSheets, HaveFieldsOfTheirOwn) {
  const scene::SceneData data = SeveralSolids(Vec3f::Zero(), true, true);
  const SceneView scene = data.View();
  const SheetPart& veil = scene.sheets[1];
  const Index cols = scene.membrane.cols, middle = (veil.first_row + veil.rows / 2) * cols + veil.cols / 2;
  Vec2f low = Vec2f::Constant(1), high = -low;
  for (std::uint32_t r = 0; r < veil.rows; ++r) {
    for (std::uint32_t c = 0; c < veil.cols; ++c) {
      const Vec2f& m = scene.membrane_material[(veil.first_row + r) * cols + c];
      low = low.cwiseMin(m);
      high = high.cwiseMax(m);
    }
  }
  const auto of_veil = [&](double x, double y) {
    const Vec2f p(static_cast<float>(x), static_cast<float>(y));
    return (p.array() >= low.array()).all() && (p.array() <= high.array()).all();
  };
  HeatField field(MakeSheet(scene), MakeMaterial(scene.thermal));
  std::size_t cells = 0;
  Fill(&field, [&](double x, double y) {
    cells += of_veil(x, y) ? 1 : 0;
    return of_veil(x, y) ? 40.0 : 0.0;
  });
  const float area = (high - low).prod() / (scene.thermal.cell_m * scene.thermal.cell_m);
  EXPECT_NEAR(static_cast<float>(cells), area, 0.03f * area);
  Ledger ledger;
  for (int n = 0; n < 50; ++n) field.Diffuse(0.01f, &ledger);
  ForCells(field, [&](double theta, double x, double y) {
    if (!of_veil(x, y)) {
      ASSERT_EQ(theta, 0) << x << " " << y;
    }
  });
  MeshTopology topology(scene, field.sheet());
  const CellIndex at = field.sheet().CellOf(scene.membrane_material[middle]);
  double heat = 0;
  for (int y = at.iy - 10; y <= at.iy + 10; ++y) {
    for (int x = at.ix - 10; x <= at.ix + 10; ++x) {
      field.TakeOut(field.Wake(x / kTile, y / kTile), (y % kTile) * kTile + x % kTile, kRemoved, &heat);
    }
  }
  topology.StageCut(field, {at.ix - 10, at.iy - 10}, {at.ix + 10, at.iy + 10});
  EXPECT_TRUE(topology.Commit());
  EXPECT_TRUE(TestBit(topology.committed().dead_nodes, middle));
  for (Index edge = 0; edge < 3 * scene.membrane.node_count(); ++edge) {
    const bool is_dead = TestBit(topology.committed().dead_edges, edge);
    EXPECT_TRUE(!is_dead || edge / 3 / cols >= veil.first_row) << edge;
  }
}

}  // namespace
}  // namespace fulcrum::thermal
