#include "render_node/geometry/membrane_mesh.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "render_node/geometry/fat_layer.h"
#include "services/base/core/sheets.h"
#include "services/scene/builder/build.h"
#include "tests/support/several_solids.h"
#include "tests/support/whole_topology.h"
#include "tests/unit/render/interleaved.h"

namespace fulcrum::render {
namespace {

class MembraneMeshTest : public testing::Test {
 protected:
  MembraneMeshTest() : data_(scene::BuildProcedural(scene::Small())), view_(data_.View()), mesh_(view_) {
    topology_ = WholeTopology(view_);
  }

  Index Node(std::uint32_t row, std::uint32_t col) const { return row * view_.membrane.cols + col; }

  /// Cuts all edges between column `col` and `col + 1` from row `first` to row `last`: a straight slit along t.
  /// Removes the nodes of rows 24 to 34 in columns 6 to 12.
  void RemovePatch() {
    for (std::uint32_t row = 24; row <= 34; ++row) {
      for (std::uint32_t col = 6; col <= 12; ++col) SetBit(topology_.dead_nodes, Node(row, col));
    }
    ASSERT_TRUE(mesh_.SetTopology(topology_));
  }

  void CutBetweenColumns(std::uint32_t col, std::uint32_t first, std::uint32_t last) {
    for (std::uint32_t row = first; row <= last; ++row) {
      SetBit(topology_.dead_edges, 3 * std::size_t{Node(row, col)} + 0);
      if (row < last) {
        SetBit(topology_.dead_edges, 3 * std::size_t{Node(row, col)} + 2);
      }
    }
  }

  const scene::SceneData data_;
  const SceneView view_;
  MembraneMesh mesh_;
  TopologyState topology_;
  // Far above the middle of the sheet.
  const Vec3f eye_ = view_.rest_position[view_.membrane.first + view_.membrane.node_count() / 2] + Vec3f(0, 0, 10);
};

TEST_F(MembraneMeshTest, WithoutCutsEveryTriangleIsWhole) {
  EXPECT_EQ(mesh_.whole_triangles(), view_.membrane.triangle_count());
  EXPECT_EQ(mesh_.triangles().size(), mesh_.whole_triangles());
}

TEST_F(MembraneMeshTest, EachTriangleOverTheSlitIsDrawnOncePerSide) {
  CutBetweenColumns(8, 20, 30);
  ASSERT_TRUE(mesh_.SetTopology(topology_));
  // Ten cells of two triangles; each has two dead edges.
  EXPECT_EQ(mesh_.whole_triangles(), view_.membrane.triangle_count() - 20);
  EXPECT_EQ(mesh_.triangles().size(), mesh_.whole_triangles() + 40);
  for (const Triangle& t : mesh_.triangles().subspan(mesh_.whole_triangles())) {
    const int owned =
        static_cast<int>(std::count_if(t.begin(), t.end(), [&](Index k) { return mesh_.sides()[k] > 0; }));
    EXPECT_TRUE(owned == 1 || owned == 2);
  }
}

TEST_F(MembraneMeshTest, AClosedSlitLeavesTheSheetWhereItWas) {
  CutBetweenColumns(8, 20, 30);
  ASSERT_TRUE(mesh_.SetTopology(topology_));
  mesh_.Update(Interleaved(view_.rest_position));
  for (const Triangle& t : mesh_.triangles().subspan(mesh_.whole_triangles())) {
    for (const Index k : t) {
      const auto same = std::find(view_.membrane_material.begin(), view_.membrane_material.end(), mesh_.materials()[k]);
      const auto node = static_cast<std::size_t>(same - view_.membrane_material.begin());
      // A ghost vertex continues the sheet along its tangent: the difference is the curvature over one cell of 2 mm.
      EXPECT_LT((mesh_.positions()[k] - view_.rest_position[view_.membrane.first + node]).norm(), 5e-4f);
    }
  }
}

TEST_F(MembraneMeshTest, AnOpenSlitDoesNotStretchItsEdges) {
  CutBetweenColumns(8, 20, 30);
  ASSERT_TRUE(mesh_.SetTopology(topology_));
  std::vector<Vec3f> particles(view_.rest_position.begin(), view_.rest_position.end());
  constexpr float kOpening_m = 0.010f;
  for (std::uint32_t row = 0; row < view_.membrane.rows; ++row) {
    for (std::uint32_t col = 9; col < view_.membrane.cols; ++col) {
      particles[view_.membrane.first + Node(row, col)].x() += kOpening_m;
    }
  }
  mesh_.Update(Interleaved(particles));
  for (const Triangle& t : mesh_.triangles().subspan(mesh_.whole_triangles())) {
    for (int k = 0; k < 3; ++k) {
      const Index a = t[k], b = t[(k + 1) % 3];
      const float drawn = (mesh_.positions()[a] - mesh_.positions()[b]).norm();
      const float material = (mesh_.materials()[a] - mesh_.materials()[b]).norm();
      EXPECT_LT(drawn, 1.5f * material) << "an edge of " << material << " m bridges the slit";
    }
  }
}

TEST_F(MembraneMeshTest, ADeadNodeIsNeverDrawnAndAWildOneDoesNoHarm) {
  const Index dead = Node(25, 8);
  SetBit(topology_.dead_nodes, dead);
  ASSERT_TRUE(mesh_.SetTopology(topology_));
  std::vector<Vec3f> particles(view_.rest_position.begin(), view_.rest_position.end());
  particles[view_.membrane.first + dead] = Vec3f(5, 5, 5);
  mesh_.Update(Interleaved(particles));
  for (const Triangle& t : mesh_.triangles().first(mesh_.whole_triangles())) {
    EXPECT_EQ(std::count(t.begin(), t.end(), dead), 0);
  }
  for (const Vec3f& p : mesh_.positions()) {
    EXPECT_LT(p.norm(), 0.2f);
  }
}

TEST_F(MembraneMeshTest, ACrumbIsNotDrawnButAFlapIs) {
  // A square of nine nodes that nothing binds is separated by cutting every edge that leaves it.
  const auto inside = [](std::uint32_t row, std::uint32_t col) {
    return row >= 20 && row < 23 && col >= 8 && col < 11;
  };
  constexpr std::uint32_t kSteps[3][2] = {{0, 1}, {1, 0}, {1, 1}};
  for (std::uint32_t row = 0; row + 1 < view_.membrane.rows; ++row) {
    for (std::uint32_t col = 0; col + 1 < view_.membrane.cols; ++col) {
      for (std::size_t d = 0; d < 3; ++d) {
        if (inside(row, col) != inside(row + kSteps[d][0], col + kSteps[d][1])) {
          SetBit(topology_.dead_edges, 3 * std::size_t{Node(row, col)} + d);
        }
      }
    }
  }
  scene::SceneData data = data_;
  std::erase_if(data.bindings, [&](const Binding& binding) {
    const Index node = binding.membrane - view_.membrane.first;
    return inside(node / view_.membrane.cols, node % view_.membrane.cols);
  });
  MembraneMesh mesh(data.View());
  ASSERT_TRUE(mesh.SetTopology(topology_));
  for (std::uint32_t row = 20; row < 23; ++row) {
    for (std::uint32_t col = 8; col < 11; ++col) {
      EXPECT_TRUE(mesh.node_gone(Node(row, col)));
    }
  }
  EXPECT_FALSE(mesh.node_gone(Node(19, 8)));
  EXPECT_FALSE(mesh.node_gone(Node(40, 12)));
}

TEST_F(MembraneMeshTest, AnIslandThatIsBoundIsDrawnAsPhysicsComputesIt) {
  const auto inside = [](Index row, Index col) { return row >= 20 && row < 26 && col >= 8 && col < 14; };
  constexpr std::uint32_t kSteps[3][2] = {{0, 1}, {1, 0}, {1, 1}};
  for (Index row = 0; row + 1 < view_.membrane.rows; ++row) {
    for (Index col = 0; col + 1 < view_.membrane.cols; ++col) {
      for (std::size_t d = 0; d < 3; ++d) {
        if (inside(row, col) != inside(row + kSteps[d][0], col + kSteps[d][1])) {
          SetBit(topology_.dead_edges, 3 * std::size_t{Node(row, col)} + d);
        }
      }
    }
  }
  ASSERT_TRUE(std::ranges::any_of(view_.bindings, [&](const Binding& b) {
    const Index node = b.membrane - view_.membrane.first;
    return inside(node / view_.membrane.cols, node % view_.membrane.cols);
  }));
  ASSERT_TRUE(mesh_.SetTopology(topology_));
  for (Index row = 20; row < 26; ++row) {
    for (Index col = 8; col < 14; ++col) EXPECT_FALSE(mesh_.node_gone(Node(row, col)));
  }
}

TEST_F(MembraneMeshTest, RefusesTheTopologyOfAnotherGrid) {
  topology_.rows += 1;
  EXPECT_FALSE(mesh_.SetTopology(topology_));
  topology_.rows -= 1;
  topology_.dead_edges.pop_back();
  EXPECT_FALSE(mesh_.SetTopology(topology_));
  EXPECT_EQ(mesh_.whole_triangles(), view_.membrane.triangle_count());
}

TEST_F(MembraneMeshTest, FatLiesBetweenMembraneAndTubeAndFollowsALittleIntoATent) {
  FatLayer fat(view_, 2);
  const std::vector<float> rest = Interleaved(view_.rest_position);
  mesh_.Update(rest);
  fat.Update(rest, mesh_, eye_);
  const std::vector<Vec3f> at_rest(fat.positions().begin(), fat.positions().end());
  for (const Vec3f& p : at_rest) {
    float to_membrane = 1;
    for (const Vec3f& m : mesh_.positions()) {
      to_membrane = std::min(to_membrane, (m - p).norm());
    }
    EXPECT_GT(to_membrane, 2e-4f);
    EXPECT_LT(to_membrane, 3e-3f);
  }
  constexpr float kLift_m = 0.010f;
  std::vector<Vec3f> particles(view_.rest_position.begin(), view_.rest_position.end());
  for (Index node = 0; node < view_.membrane.node_count(); ++node) {
    particles[view_.membrane.first + node].z() += kLift_m;
  }
  const std::vector<float> lifted = Interleaved(particles);
  mesh_.Update(lifted);
  fat.Update(lifted, mesh_, eye_);
  for (std::size_t k = 0; k < at_rest.size(); ++k) {
    const float rise = fat.positions()[k].z() - at_rest[k].z();
    EXPECT_GT(rise, 0);
    EXPECT_LT(rise, 0.0021f) << "a tent is hollow";
  }
}

TEST_F(MembraneMeshTest, BaredFatStaysOnTheTubeWhileTheSlitOpens) {
  constexpr std::uint32_t kCol = 8, kFirst = 16, kLast = 40;
  FatLayer fat(view_, 2);
  std::vector<Vec3f> particles(view_.rest_position.begin(), view_.rest_position.end());
  mesh_.Update(Interleaved(particles));
  fat.Update(Interleaved(particles), mesh_, eye_);
  EXPECT_EQ(std::count(fat.bared().begin(), fat.bared().end(), 0.0f), std::ssize(fat.bared())) << "an intact sheet";
  const std::vector<Vec3f> at_rest(fat.positions().begin(), fat.positions().end());

  CutBetweenColumns(kCol, kFirst, kLast);
  ASSERT_TRUE(mesh_.SetTopology(topology_));
  // Each side is drawn aside, along the sheet, by up to 6 mm in the middle of the slit.
  constexpr float kAside_m = 0.006f, kReach_m = 0.016f;
  const auto node_at = [&](Index node) -> Vec3f& { return particles[view_.membrane.first + node]; };
  const Vec2f middle = view_.membrane_material[Node((kFirst + kLast) / 2, kCol)];
  const Vec3f right = (node_at(Node(28, kCol + 1)) - node_at(Node(28, kCol))).normalized();
  for (Index node = 0; node < view_.membrane.node_count(); ++node) {
    const Vec2f from = view_.membrane_material[node] - middle;
    const float near =
        std::max(0.0f, 1 - std::abs(from.x()) / kReach_m) * std::max(0.0f, 1 - std::abs(from.y()) / 0.024f);
    node_at(node) += (node % view_.membrane.cols <= kCol ? -near : near) * kAside_m * right;
  }
  mesh_.Update(Interleaved(particles));
  fat.FindCuts(mesh_);
  fat.Update(Interleaved(particles), mesh_, eye_);
  int bared = 0;
  for (std::size_t k = 0; k < at_rest.size(); ++k) {
    const Vec2f from = fat.materials()[k] - middle;
    bared += fat.bared()[k] == 1 ? 1 : 0;
    if (std::abs(from.x()) < 0.003f && std::abs(from.y()) < 0.008f) {
      EXPECT_EQ(fat.bared()[k], 1) << "in the opening";
      EXPECT_LT((fat.positions()[k] - at_rest[k]).norm(), 1e-6f) << "on the tube, which has not moved";
    }
    if (std::abs(from.x()) > 0.018f || std::abs(from.y()) > 0.040f) {
      EXPECT_EQ(fat.bared()[k], 0) << "beneath the sheet";
    }
    EXPECT_LT((fat.positions()[k] - at_rest[k]).norm(), 0.0021f) << "does not follow the rims";
  }
  EXPECT_GE(bared, 4);
}

TEST_F(MembraneMeshTest, FatIsBaredWhereTheSheetIsRemoved) {
  FatLayer fat(view_, 2);
  ASSERT_NO_FATAL_FAILURE(RemovePatch());
  mesh_.Update(Interleaved(view_.rest_position));
  fat.FindCuts(mesh_);
  fat.Update(Interleaved(view_.rest_position), mesh_, eye_);
  const Vec2f low = view_.membrane_material[Node(24, 6)], high = view_.membrane_material[Node(34, 12)];
  const Vec2f beyond = 3 * (view_.membrane_material[Node(26, 8)] - view_.membrane_material[Node(24, 6)]);
  int inside = 0;
  for (std::size_t k = 0; k < fat.bared().size(); ++k) {
    const Vec2f& m = fat.materials()[k];
    if ((m.array() >= low.array()).all() && (m.array() <= high.array()).all()) {
      EXPECT_EQ(fat.bared()[k], 1);
      ++inside;
    } else if ((m.array() < (low - beyond).array()).any() || (m.array() > (high + beyond).array()).any()) {
      EXPECT_EQ(fat.bared()[k], 0);
    }
  }
  EXPECT_GT(inside, 10);
}

TEST_F(MembraneMeshTest, FatIsBaredWhereTheEyeSeesItThroughALiftedOpening) {
  FatLayer fat(view_, 2);
  ASSERT_NO_FATAL_FAILURE(RemovePatch());
  constexpr float kLift_m = 0.010f;
  std::vector<Vec3f> particles(view_.rest_position.begin(), view_.rest_position.end());
  for (Index node = 0; node < view_.membrane.node_count(); ++node)
    particles[view_.membrane.first + node].z() += kLift_m;
  mesh_.Update(Interleaved(particles));
  fat.FindCuts(mesh_);
  const auto middle_seen_from = [&](const Vec3f& eye) {
    fat.Update(Interleaved(particles), mesh_, eye);
    Vec3f sum = Vec3f::Zero();
    float all = 0;
    for (std::size_t k = 0; k < fat.bared().size(); ++k) {
      sum += fat.bared()[k] * fat.positions()[k];
      all += fat.bared()[k];
    }
    return Vec3f(sum / all);
  };
  // From 45 degrees the opening is seen as far aside as it stands above the fat; bared is also what lies under it.
  const Vec3f above = middle_seen_from(eye_);
  const std::vector<Vec3f> positions(fat.positions().begin(), fat.positions().end());
  const Vec3f aside = middle_seen_from(eye_ + Vec3f(0, 10, 0));
  EXPECT_TRUE(std::ranges::equal(fat.positions(), positions)) << "tissue does not move with the eye";
  EXPECT_GT(above.y() - aside.y(), 0.4f * kLift_m);
  EXPECT_LT(above.y() - aside.y(), 1.2f * kLift_m);
}

TEST_F(MembraneMeshTest, AMembraneThatIsPressedDownPressesTheFat) {
  FatLayer fat(view_, 2);
  std::vector<Vec3f> particles(view_.rest_position.begin(), view_.rest_position.end());
  const auto lowest_below = [&] {
    mesh_.Update(Interleaved(particles));
    fat.Update(Interleaved(particles), mesh_, eye_);
    float lowest = 1;
    for (std::uint32_t row = 0; row < view_.membrane.rows; row += 2) {
      const std::size_t fat_cols = fat.positions().size() / ((view_.membrane.rows + 2) / 2);
      const std::size_t k = row / 2 * fat_cols + fat_cols / 2;
      const auto same = std::find(view_.membrane_material.begin(), view_.membrane_material.end(), fat.materials()[k]);
      const auto node = static_cast<std::size_t>(same - view_.membrane_material.begin());
      lowest = std::min(lowest, mesh_.positions()[node].z() - fat.positions()[k].z());
    }
    return lowest;
  };
  const float before = lowest_below();
  EXPECT_GT(before, 0);
  for (Index node = 0; node < view_.membrane.node_count(); ++node)
    particles[view_.membrane.first + node].z() -= 0.0005f;
  EXPECT_GT(lowest_below(), 0.3f * before) << "it does not poke through";
}

/// A small band that only bindings hold is no crumb.
TEST(SeveralSheets, ABandThatIsBoundIsDrawn) {
  scene::SceneData data = SeveralSolids(Vec3f::Zero(), true, true);
  const SheetPart veil = data.sheets[1];
  for (std::uint32_t r = veil.first_row; r < veil.first_row + veil.rows; ++r) {
    for (std::uint32_t c = 0; c < veil.cols; ++c) {
      data.inverse_mass[data.fixed.membrane.first + r * data.fixed.membrane.cols + c] = 1e4f;
    }
  }
  std::erase_if(data.bindings, [&](const Binding& b) {
    return b.membrane >= data.fixed.membrane.first + veil.first_row * data.fixed.membrane.cols;
  });
  // All but two columns are cut off.
  const SceneView scene = data.View();
  TopologyState topology = WholeTopology(scene);
  for (std::uint32_t r = veil.first_row; r < veil.first_row + veil.rows; ++r) {
    for (std::uint32_t c = 0; c + 2 < veil.cols; ++c) SetBit(topology.dead_nodes, r * scene.membrane.cols + c + 2);
    if (r >= veil.first_row + 12) {
      for (std::uint32_t c = 0; c < 2; ++c) SetBit(topology.dead_nodes, r * scene.membrane.cols + c);
    }
  }
  const Index node = veil.first_row * scene.membrane.cols;
  MembraneMesh loose(scene);
  ASSERT_TRUE(loose.SetTopology(topology));
  EXPECT_TRUE(loose.node_gone(node));
  Binding binding = data.bindings[0];
  binding.membrane = scene.membrane.first + node;
  data.bindings.push_back(binding);
  MembraneMesh bound(data.View());
  ASSERT_TRUE(bound.SetTopology(topology));
  EXPECT_FALSE(bound.node_gone(node));
}

TEST(SeveralSheets, AreDrawnApart) {
  const scene::SceneData alone = SeveralSolids(Vec3f::Zero(), true);
  const SceneView alone_scene = alone.View();
  const scene::SceneData data = SeveralSolids(Vec3f::Zero(), true, true);
  const SceneView scene = data.View();
  ASSERT_EQ(scene.sheets.size(), 2u);
  MembraneMesh mesh(scene);
  std::size_t triangles = 0;
  for (const SheetPart& sheet : scene.sheets) triangles += 2u * (sheet.rows - 1) * (sheet.cols - 1);
  EXPECT_EQ(mesh.whole_triangles(), triangles);
  EXPECT_EQ(mesh.triangles().size(), triangles);
  const auto sheet_of = [&](Index vertex) { return vertex / scene.membrane.cols >= scene.sheets[1].first_row ? 1 : 0; };
  const std::vector<std::uint8_t> absent = AbsentNodes(scene);
  for (const Triangle& t : mesh.triangles()) {
    EXPECT_EQ(sheet_of(t[0]), sheet_of(t[1]));
    EXPECT_EQ(sheet_of(t[0]), sheet_of(t[2]));
    for (const Index vertex : t) EXPECT_EQ(absent[vertex], 0);
  }
  std::vector<float> xyz;
  for (const Vec3f& p : scene.rest_position) xyz.insert(xyz.end(), p.data(), p.data() + 3);
  mesh.Update(xyz);
  // A slit along the second sheet's rim: the ghosts continue it, and do not reach for the other one.
  TopologyState topology = WholeTopology(scene);
  for (std::uint32_t c = 0; c < scene.sheets[1].cols; ++c) {
    for (const std::size_t d : {1u, 2u}) {
      SetBit(topology.dead_edges, 3 * std::size_t{scene.sheets[1].first_row * scene.membrane.cols + c} + d);
    }
  }
  ASSERT_TRUE(mesh.SetTopology(topology));
  mesh.Update(xyz);
  EXPECT_GT(mesh.triangles().size(), mesh.whole_triangles());
  for (const Triangle& t : mesh.triangles().subspan(mesh.whole_triangles())) {
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_LT((mesh.positions()[t[k]] - mesh.positions()[t[(k + 1) % 3]]).norm(), 0.02f);
    }
  }
  // No fat below what covers no organ.
  const FatLayer fat(scene, 2);
  EXPECT_EQ(fat.triangles().size(), FatLayer(alone_scene, 2).triangles().size());
  EXPECT_FALSE(fat.triangles().empty());
}

}  // namespace
}  // namespace fulcrum::render
