// Omissions that do not change the picture: field of view, coarse divisions of the sheet, quality.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include "render_node/geometry/field_of_view.h"
#include "render_node/geometry/quality.h"
#include "render_node/geometry/sheet_detail.h"
#include "services/base/core/error.h"
#include "services/scene/builder/build.h"
#include "tests/support/whole_topology.h"

namespace fulcrum::render {
namespace {

class DetailTest : public testing::Test {
 protected:
  DetailTest() : data_(scene::BuildProcedural(scene::Small())), view_(data_.View()) {
    for (const Vec3f& p : view_.rest_position) {
      xyz_.insert(xyz_.end(), {p.x(), p.y(), p.z()});
    }
  }

  std::vector<Triangle> Choose(const MembraneMesh& mesh, float pixels_per_rad = 500) {
    return Runs(
               mesh, [](std::size_t) { return false; }, pixels_per_rad)
        .triangles;
  }

  template <class Untouched>
  SheetRuns Runs(const MembraneMesh& mesh, const Untouched& untouched, float pixels_per_rad = 500) {
    std::vector<std::uint8_t> blocks(std::size_t{mesh.block_rows()} * mesh.block_cols());
    for (std::size_t k = 0; k < blocks.size(); ++k) blocks[k] = untouched(k) ? 1 : 0;
    SheetRuns runs;
    SheetDetail(view_.membrane).Choose(mesh, view_.render.scope_tip_W, pixels_per_rad, blocks, &runs);
    return runs;
  }

  [[nodiscard]] TopologyState CutInTheMiddle() const {
    TopologyState topology = WholeTopology(view_);
    const Index node = view_.membrane.rows / 2 * view_.membrane.cols + view_.membrane.cols / 2;
    SetBit(topology.dead_edges, 3 * std::size_t{node});
    SetBit(topology.dead_edges, 3 * std::size_t{node} + 2);
    return topology;
  }

  /// The block of the grid that contains a triangle.
  static std::size_t BlockOf(const MembraneMesh& mesh, const Triangle& t, Index cols) {
    Index row = t[0] / cols, col = t[0] % cols;
    for (const Index node : t) row = std::min(row, node / cols), col = std::min(col, node % cols);
    return std::size_t{row / MembraneMesh::kBlockRows} * mesh.block_cols() + col / MembraneMesh::kBlockCols;
  }

  const scene::SceneData data_;
  const SceneView view_;
  std::vector<float> xyz_;
};

TEST_F(DetailTest, NoTriangleInTheFieldIsLeftOut) {
  RenderParams close = view_.render;
  close.fov_deg = 25;
  const Laparoscope scope = MakeLaparoscope(close);
  FieldOfView field({&scope, 1});
  MembraneMesh mesh(view_);
  mesh.Update(xyz_);
  std::vector<Triangle> seen;
  EXPECT_TRUE(field.Find(mesh.positions(), mesh.triangles(), Sides::kBoth, &seen));
  EXPECT_FALSE(field.Find(mesh.positions(), mesh.triangles(), Sides::kBoth, &seen)) << "nothing has moved";
  EXPECT_LT(seen.size(), mesh.triangles().size());
  std::sort(seen.begin(), seen.end());
  for (const Triangle& t : mesh.triangles()) {
    for (const Index corner : t) {
      const Eigen::Vector4f clip = scope.projection * scope.view * mesh.positions()[corner].homogeneous();
      const Vec2f pixel = (clip.head<2>() / clip.w()).cwiseProduct(scope.picture_centre);
      if (clip.w() > 0 && pixel.norm() < scope.circle_radius && pixel.cwiseAbs().y() < scope.picture_centre.y()) {
        EXPECT_TRUE(std::binary_search(seen.begin(), seen.end(), t));
        break;
      }
    }
  }
}

TEST_F(DetailTest, WithTwoEyesNothingThatOneOfThemSeesIsLeftOut) {
  RenderParams close = view_.render;
  close.fov_deg = 25;
  const Laparoscope middle = MakeLaparoscope(close);
  int missed_in_the_middle = 0;
  for (const float convergence_m : {0.03f, 0.06f, 0.5f}) {
    const std::vector<Laparoscope> eyes = MakeEyes(close, {StereoLayout::kSideBySide, 0.01f, convergence_m});
    for (const Sides sides : {Sides::kBoth, Sides::kFront}) {
      const auto found = [&](std::span<const Laparoscope> cameras) {
        std::vector<Triangle> seen;
        FieldOfView(cameras).Find(view_.rest_position, view_.tube_surface, sides, &seen);
        std::sort(seen.begin(), seen.end());
        return seen;
      };
      const std::vector<Triangle> seen = found(eyes), one = found({&middle, 1});
      for (const Laparoscope& eye : eyes) {
        for (const Triangle& t : found({&eye, 1})) {
          EXPECT_TRUE(std::binary_search(seen.begin(), seen.end(), t));
          missed_in_the_middle += std::binary_search(one.begin(), one.end(), t) ? 0 : 1;
        }
      }
      EXPECT_LT(seen.size(), view_.tube_surface.size());
    }
  }
  EXPECT_GT(missed_in_the_middle, 0) << "one eye would do, and the test shows nothing";
}

TEST_F(DetailTest, WhatTurnsItsBackIsLeftOutOfAClosedSurface) {
  const Laparoscope scope = MakeLaparoscope(view_.render);
  std::vector<Triangle> both, front;
  FieldOfView field({&scope, 1});
  field.Find(view_.rest_position, view_.tube_surface, Sides::kBoth, &both);
  field.Find(view_.rest_position, view_.tube_surface, Sides::kFront, &front);
  EXPECT_LT(front.size(), 0.7 * static_cast<double>(both.size()));
  EXPECT_GT(front.size(), 0.2 * static_cast<double>(both.size()));
}

TEST_F(DetailTest, ASmoothSheetTakesFewTrianglesAndHasNoGaps) {
  MembraneMesh mesh(view_);
  mesh.Update(xyz_);
  const std::vector<Triangle> chosen = Choose(mesh);
  EXPECT_LT(chosen.size(), mesh.triangles().size() / 2);
  // Watertight: an inner edge of a sheet has two triangles; an edge with one is on the rim of the grid.
  std::map<std::pair<Index, Index>, int> edges;
  for (const Triangle& t : chosen) {
    for (int k = 0; k < 3; ++k) {
      const Index a = t[k], b = t[(k + 1) % 3];
      ++edges[{std::min(a, b), std::max(a, b)}];
    }
  }
  const auto on_rim = [&](Index node) {
    const Index row = node / view_.membrane.cols, col = node % view_.membrane.cols;
    return row == 0 || col == 0 || row == view_.membrane.rows - 1 || col == view_.membrane.cols - 1;
  };
  for (const auto& [edge, count] : edges) {
    EXPECT_TRUE(count == 2 || (on_rim(edge.first) && on_rim(edge.second)));
  }
}

TEST_F(DetailTest, TheSheetStaysWatertightWhereItsDetailVaries) {
  for (std::size_t i = view_.membrane.first; i < view_.rest_position.size(); ++i) {
    const float r = (view_.rest_position[i] - view_.render.scope_target_W).norm();
    xyz_[3 * i + 2] += 0.015f * std::exp(-r * r / 1e-4f);
  }
  MembraneMesh mesh(view_);
  mesh.Update(xyz_);
  double area = 0, fine_area = 0;
  const auto material_area = [&](const Triangle& t) {
    const auto m = view_.membrane_material;
    const Vec2f a = m[t[1]] - m[t[0]], b = m[t[2]] - m[t[0]];
    return 0.5 * static_cast<double>(a.x() * b.y() - a.y() * b.x());
  };
  for (const Triangle& t : Choose(mesh)) {
    area += material_area(t);
  }
  for (const Triangle& t : mesh.triangles()) {
    fine_area += material_area(t);
  }
  EXPECT_NEAR(area / fine_area, 1, 1e-3) << "the sheet is covered once";
}

TEST_F(DetailTest, ACutIsDrawnAsFinelyAsItIs) {
  MembraneMesh mesh(view_);
  ASSERT_TRUE(mesh.SetTopology(CutInTheMiddle()));
  mesh.Update(xyz_);
  const std::vector<Triangle> chosen = Choose(mesh);
  for (std::size_t block = 0; block < std::size_t{mesh.block_rows()} * mesh.block_cols(); ++block) {
    if (!mesh.block_intact(block)) {
      for (const Triangle& t : mesh.block_triangles(block)) {
        EXPECT_NE(std::find(chosen.begin(), chosen.end(), t), chosen.end());
      }
    }
  }
  for (const Triangle& t : mesh.triangles().subspan(mesh.whole_triangles())) {
    EXPECT_NE(std::find(chosen.begin(), chosen.end(), t), chosen.end()) << "a part of a cut triangle";
  }
}

TEST_F(DetailTest, UntouchedBlocksHaveRunsOfTheirOwnAndRowsStayInTheirOrder) {
  MembraneMesh mesh(view_);
  ASSERT_TRUE(mesh.SetTopology(CutInTheMiddle()));
  mesh.Update(xyz_);
  std::vector<Triangle> all = Choose(mesh);
  std::ranges::sort(all);
  const auto untouched = [](std::size_t block) { return block % 3 != 0; };
  const SheetRuns runs = Runs(mesh, untouched);
  std::vector<Triangle> drawn = runs.triangles;
  std::ranges::sort(drawn);
  EXPECT_EQ(drawn, all) << "the same triangles";
  ASSERT_EQ(runs.ends.back(), runs.triangles.size());
  EXPECT_GT(runs.ends.size(), 2u);
  EXPECT_LE(runs.ends.size(), mesh.block_rows() + 2u) << "a change of shader within each row, not at each block";
  const std::size_t parts = mesh.triangles().size() - mesh.whole_triangles();
  const std::size_t whole = runs.triangles.size() - parts;
  ASSERT_GT(parts, 0u);
  std::size_t run = 0, last_row = 0;
  bool down = false, up = false;
  for (std::size_t k = 0; k < runs.triangles.size(); ++k) {
    while (k >= runs.ends[run]) ++run;
    if (k >= whole) {
      EXPECT_EQ(run % 2, 1u) << "a part of a cut triangle";
      continue;
    }
    const std::size_t block = BlockOf(mesh, runs.triangles[k], view_.membrane.cols);
    EXPECT_EQ(run % 2 == 0, untouched(block) && mesh.block_intact(block)) << block;
    const std::size_t row = block / mesh.block_cols();
    up = up || (k > 0 && row > last_row);
    down = down || (k > 0 && row < last_row);
    last_row = row;
  }
  EXPECT_NE(up, down) << "far to near";
  EXPECT_EQ(Runs(mesh, [](std::size_t) { return false; }).ends, (std::vector<std::size_t>{0, all.size()}));
}

TEST_F(DetailTest, RunsEndInTheFieldWhereTheyEndOutsideIt) {
  RenderParams close = view_.render;
  close.fov_deg = 25;
  const Laparoscope scope = MakeLaparoscope(close);
  FieldOfView field({&scope, 1});
  MembraneMesh mesh(view_);
  mesh.Update(xyz_);
  const auto triangles = mesh.triangles();
  std::vector<std::size_t> ends{0, triangles.size() / 3, triangles.size() / 2, triangles.size()};
  const std::vector<std::size_t> before = ends;
  std::vector<Triangle> seen;
  ASSERT_TRUE(field.Find(mesh.positions(), triangles, Sides::kBoth, &seen, ends));
  for (std::size_t run = 0; run < ends.size(); ++run) {
    std::vector<Triangle> alone;
    FieldOfView({&scope, 1}).Find(mesh.positions(), triangles.first(before[run]), Sides::kBoth, &alone);
    EXPECT_EQ(ends[run], alone.size());
  }
}

TEST(QualityTest, StepsDownWhenPicturesAreDearAndUpWhenTheyAreCheap) {
  QualityControl quality(Quality::kAuto, 720);
  EXPECT_LT(quality.scale(), 0.6f) << "low until the first picture has been timed";
  quality.Add(60);
  EXPECT_EQ(quality.scale(), 1.0f);
  for (int k = 0; k < 1000; ++k) {
    quality.Add(60 * quality.scale() * quality.scale());
  }
  const float settled = quality.scale();
  EXPECT_LT(60 * settled * settled, 33);
  for (int k = 0; k < 1000; ++k) {
    quality.Add(60 * quality.scale() * quality.scale());
    EXPECT_EQ(quality.scale(), settled) << "no oscillation";
  }
  for (int k = 0; k < 1000; ++k) {
    quality.Add(5);
  }
  EXPECT_EQ(quality.scale(), 1.0f);
}

TEST(QualityTest, NeverGoesBelowLegible) {
  for (const int height : {180, 360, 540, 720, 1080, 2160}) {
    QualityControl quality(Quality::kAuto, height);
    for (int k = 0; k < 1000; ++k) {
      quality.Add(500);
    }
    EXPECT_GE(quality.scale() * static_cast<float>(height), std::min(height, 270));
    EXPECT_EQ(QualityControl(Quality::kLow, height).scale(), quality.scale());
    EXPECT_EQ(QualityControl(Quality::kHigh, height).scale(), 1.0f);
  }
}

/// On a GPU: up to four by four samples a pixel while a picture takes at most 12 ms.
TEST(QualityTest, SmoothsWhereThereIsTime) {
  QualityControl quality(Quality::kAuto, 1080, true);
  quality.Add(50);
  EXPECT_EQ(quality.scale(), 1.0f);
  for (int k = 0; k < 200; ++k) quality.Add(1 + 2 * quality.scale() * quality.scale());
  EXPECT_EQ(quality.scale(), 2.0f);
  for (int k = 0; k < 400; ++k) {
    quality.Add(2 + 5 * quality.scale() * quality.scale());
    EXPECT_LE(quality.scale(), 2.0f);
  }
  EXPECT_EQ(quality.scale(), 1.41f);
  for (int k = 0; k < 200; ++k) quality.Add(13);
  EXPECT_EQ(quality.scale(), 1.0f) << "above 12 ms and below 28";
  EXPECT_EQ(QualityControl(Quality::kHigh, 540, true).scale(), 4.0f);
  EXPECT_EQ(QualityControl(Quality::kHigh, 1080, true).scale(), 2.83f);
  quality.SetHeight(2160);
  EXPECT_EQ(quality.most(), 1.41f) << "the textures of a finer scale would be too large";
}

TEST(QualityTest, ALargerPictureBeginsWithTheLinesOfTheLastAndASmallerOneWithAllOfIts) {
  QualityControl quality(Quality::kAuto, 540);
  for (int k = 0; k < 20; ++k) quality.Add(20);
  ASSERT_EQ(quality.scale(), 1.0f);
  quality.SetHeight(2160);
  quality.Add(900);  // The first picture of a size also makes the textures.
  EXPECT_LE(quality.scale() * 2160, 540);
  EXPECT_GE(quality.scale() * 2160, 374);
  quality.SetHeight(360);
  quality.Add(900);
  EXPECT_EQ(quality.scale(), 1.0f);
  // A fast machine draws all lines within a hundred pictures, in several steps.
  quality.SetHeight(2160);
  for (int k = 0; k < 120; ++k) quality.Add(1 + 4 * quality.scale() * quality.scale());
  EXPECT_EQ(quality.scale(), 1.0f);
  QualityControl low(Quality::kLow, 540);
  low.SetHeight(2160);
  EXPECT_EQ(low.scale(), QualityControl(Quality::kLow, 2160).scale());
}

TEST(QualityTest, RefusesAnUnknownName) {
  EXPECT_EQ(QualityFromName("low"), Quality::kLow);
  EXPECT_THROW(static_cast<void>(QualityFromName("best")), InputError);
}

}  // namespace
}  // namespace fulcrum::render
