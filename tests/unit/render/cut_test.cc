// Contours, lips and strands of a straight slit of known place and width.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "render_node/geometry/cut_contour.h"
#include "render_node/geometry/cut_lip.h"
#include "render_node/geometry/cut_strands.h"
#include "services/scene/builder/build.h"
#include "tests/support/whole_topology.h"
#include "tests/unit/render/interleaved.h"

namespace fulcrum::render {
namespace {

constexpr float kHalfSlit_m = 0.0004f;
constexpr std::uint32_t kSlitCol = 8, kFirstRow = 20, kLastRow = 34;

/// A slit along t between the columns kSlitCol and kSlitCol + 1, as a patch of the thermal node shows it, in a sheet
/// that is flat: node (row, col) lies at (s, t, 0).
class CutTest : public testing::Test {
 protected:
  CutTest() : data_(scene::BuildProcedural(scene::Small())), view_(data_.View()), atlas_(view_), mesh_(view_) {
    topology_ = WholeTopology(view_);
    for (const Vec2f& m : view_.membrane_material) flat_.emplace_back(m.x(), m.y(), 0.0f);
    particles_.assign(view_.rest_position.begin(), view_.rest_position.end());
    std::copy(flat_.begin(), flat_.end(), particles_.begin() + view_.membrane.first);
  }

  Index Node(std::uint32_t row, std::uint32_t col) const { return row * view_.membrane.cols + col; }
  Vec2f Material(std::uint32_t row, std::uint32_t col) const { return view_.membrane_material[Node(row, col)]; }
  float Middle() const { return 0.5f * (Material(kFirstRow, kSlitCol).x() + Material(kFirstRow, kSlitCol + 1).x()); }
  float FirstT() const { return Material(kFirstRow, kSlitCol).y(); }
  float LastT() const { return Material(kLastRow, kSlitCol).y(); }

  void Cut(std::uint8_t damage = 0) {
    for (std::uint32_t row = kFirstRow; row <= kLastRow; ++row) {
      SetBit(topology_.dead_edges, 3 * std::size_t{Node(row, kSlitCol)} + 0);
      if (row < kLastRow) SetBit(topology_.dead_edges, 3 * std::size_t{Node(row, kSlitCol)} + 2);
    }
    ASSERT_TRUE(mesh_.SetTopology(topology_));
    TemperaturePatch patch;
    const float texel = atlas_.texel_m();
    const Vec2f corner = Vec2f(Middle() - 0.005f, FirstT() - 0.005f).cwiseMax(0);
    patch.header.origin_x = static_cast<std::uint32_t>(corner.x() / texel);
    patch.header.origin_y = static_cast<std::uint32_t>(corner.y() / texel);
    patch.texels.resize(4u * kPatchTexels * kPatchTexels);
    for (int y = 0; y < kPatchTexels; ++y) {
      for (int x = 0; x < kPatchTexels; ++x) {
        const float s = (static_cast<float>(patch.header.origin_x) + static_cast<float>(x) + 0.5f) * texel;
        const float t = (static_cast<float>(patch.header.origin_y) + static_cast<float>(y) + 0.5f) * texel;
        const bool removed = std::abs(s - Middle()) < kHalfSlit_m && t > FirstT() && t < LastT();
        std::uint8_t* to =
            &patch.texels[4 * (static_cast<std::size_t>(y) * kPatchTexels + static_cast<std::size_t>(x))];
        to[0] = 34;
        to[1] = damage;
        to[2] = 0;
        to[3] = removed ? 0 : 255;
      }
    }
    ASSERT_FALSE(atlas_.Apply(patch).empty());
    ASSERT_LT(LastT() - patch.header.origin_y * texel, 0.0256f) << "the slit lies within the patch";
  }

  /// Moves what lies right of the slit by `gap_m`.
  void Open(float gap_m) {
    std::vector<Vec3f> particles = particles_;
    for (std::uint32_t row = 0; row < view_.membrane.rows; ++row) {
      for (std::uint32_t col = kSlitCol + 1; col < view_.membrane.cols; ++col) {
        particles[view_.membrane.first + Node(row, col)].x() += gap_m;
      }
    }
    mesh_.Update(Interleaved(particles));
    places_.SetTopology(mesh_);
  }

  CutGeometry Lips() {
    CutLip lip(view_);
    lip.Find(atlas_, mesh_, places_);
    CutGeometry geometry;
    lip.Append(mesh_, &geometry);
    return geometry;
  }

  CutStrands Strands() {
    CutStrands strands(view_);
    strands.Find(atlas_, mesh_, places_);
    return strands;
  }

  static bool Finite(const CutGeometry& geometry) {
    return std::ranges::all_of(geometry.positions, [](const Vec3f& p) { return p.allFinite(); }) &&
           std::ranges::all_of(geometry.normals, [](const Vec3f& n) { return n.allFinite(); });
  }

  const scene::SceneData data_;
  const SceneView view_;
  Atlas atlas_;
  MembraneMesh mesh_;
  SheetPlaces places_{view_};
  TopologyState topology_;
  std::vector<Vec3f> flat_, particles_;
  const Vec3f eye_W_{0.03f, 0.04f, 0.1f};
  static constexpr float kPixelsPerRad = 700;
};

TEST_F(CutTest, TheContourOfASlitIsClosedAroundItWithTissueToItsLeft) {
  Cut();
  const auto contours = FindContours(atlas_, 0.0004f);
  ASSERT_EQ(contours.size(), 1u);
  EXPECT_TRUE(contours[0].closed);
  float length = 0;
  const auto& points = contours[0].points;
  for (std::size_t k = 0; k < points.size(); ++k) {
    const Vec2f step = points[(k + 1) % points.size()].material - points[k].material;
    EXPECT_NEAR(step.norm(), 0.0004f, 0.0001f);
    length += step.norm();
    EXPECT_FALSE(atlas_.Removed(points[k].material + 0.0002f * points[k].inward));
    EXPECT_TRUE(atlas_.Removed(points[k].material - 0.0002f * points[k].inward));
    if (points[k].material.y() > FirstT() + 0.001f && points[k].material.y() < LastT() - 0.001f) {
      EXPECT_NEAR(std::abs(points[k].material.x() - Middle()), kHalfSlit_m, 0.5f * atlas_.texel_m());
    }
  }
  EXPECT_NEAR(length, 2 * (LastT() - FirstT()), 0.002f);
}

TEST_F(CutTest, HolesThatMeetAtACornerAreOneAndAHoleOfOneTexelHasAContour) {
  TemperaturePatch patch;
  patch.texels.assign(4u * kPatchTexels * kPatchTexels, 255);
  const auto remove = [&patch](std::size_t x, std::size_t y) { patch.texels[4 * (y * kPatchTexels + x) + 3] = 0; };
  for (std::size_t y = 0; y < 8; ++y) {
    for (std::size_t x = 0; x < 8; ++x) {
      remove(40 + x, 40 + y);
      remove(48 + x, 48 + y);
    }
  }
  remove(80, 20);
  atlas_.Apply(patch);
  const auto contours = FindContours(atlas_, 0.0004f);
  // What is removed is connected over a corner.
  EXPECT_EQ(contours.size(), 2u);
  for (const Contour& contour : contours) {
    EXPECT_TRUE(contour.closed);
    EXPECT_GE(contour.points.size(), 5u);
  }
}

TEST_F(CutTest, AnUncutSheetHasNeitherContourNorLipNorStrand) {
  Open(0);
  EXPECT_TRUE(FindContours(atlas_, 0.0004f).empty());
  EXPECT_TRUE(Lips().positions.empty());
  EXPECT_TRUE(Strands().strands().empty());
}

TEST_F(CutTest, AnUnburntLipIsAsThickAsTheSheet) {
  Cut();
  Open(0.004f);
  const CutGeometry lips = Lips();
  ASSERT_FALSE(lips.positions.empty());
  ASSERT_TRUE(Finite(lips));
  // A section has 6 vertices of the upper side, 3 of the wall and 6 of the underside from the wall back.
  constexpr std::size_t kVertices = 15;
  ASSERT_EQ(lips.positions.size() % kVertices, 0u);
  for (std::size_t first = 0; first < lips.positions.size(); first += kVertices) {
    for (std::size_t row = 1; row < 6; ++row) {
      const Vec3f through = lips.positions[first + row] - lips.positions[first + 14 - row];
      EXPECT_NEAR(through.norm(), view_.thermal.thickness_m, 1e-6f);
      EXPECT_GT(through.normalized().dot(lips.normals[first + row]), 0.999f);
    }
    // It begins in the sheet, which is flat here.
    EXPECT_NEAR(0.5f * (lips.positions[first] + lips.positions[first + 14]).z(), 0, 1e-5f);
  }
}

TEST_F(CutTest, TheLipBeginsWhereTheSheetStillIsDrawnAndReachesTheCut) {
  Cut();
  Open(0.004f);
  const CutGeometry lips = Lips();
  for (std::size_t k = 0; k < lips.positions.size(); ++k) {
    const Vec2f m(lips.coordinates[k][0], lips.coordinates[k][1]);
    // No hole between sheet and lip: its first row, where it is still transparent, and its second, where it is not,
    // lie on the sheet or on the border where the sheet ends.
    if (k % 15 > 1) continue;
    EXPECT_LT(atlas_.Nearness(m), kLipNearness + (k % 15 == 0 ? -0.1f : 0.06f)) << k;
  }
}

TEST_F(CutTest, TheLipBeginsAtItsPlaceOnTheSheetAlsoAtTheEndsOfTheSlit) {
  Cut();
  Open(0);
  const CutGeometry lips = Lips();
  ASSERT_FALSE(lips.positions.empty());
  for (std::size_t k = 0; k < lips.positions.size(); k += 15) {
    const Vec2f place = lips.positions[k].head<2>(), material(lips.coordinates[k][0], lips.coordinates[k][1]);
    EXPECT_LT((place - material).norm(), 1e-4f) << material.transpose();
  }
}

TEST_F(CutTest, LipsOfTwoCutsShareTheTissueBetweenThem) {
  Cut();
  Open(0);
  // A second slit beside the first, 0.6 mm of tissue between them.
  TemperaturePatch patch;
  const float texel = atlas_.texel_m();
  patch.header.stamp.sequence = 2;
  const Vec2f corner = Vec2f(Middle() - 0.005f, FirstT() - 0.005f).cwiseMax(0);
  patch.header.origin_x = static_cast<std::uint32_t>(corner.x() / texel);
  patch.header.origin_y = static_cast<std::uint32_t>(corner.y() / texel);
  patch.texels.assign(4u * kPatchTexels * kPatchTexels, 255);
  const float other = Middle() + 2 * kHalfSlit_m + 0.0006f;
  for (int y = 0; y < kPatchTexels; ++y) {
    for (int x = 0; x < kPatchTexels; ++x) {
      const float s = (static_cast<float>(patch.header.origin_x) + static_cast<float>(x) + 0.5f) * texel;
      const float t = (static_cast<float>(patch.header.origin_y) + static_cast<float>(y) + 0.5f) * texel;
      const bool slit = std::abs(s - Middle()) < kHalfSlit_m || std::abs(s - other) < kHalfSlit_m;
      std::uint8_t* to = &patch.texels[4 * (static_cast<std::size_t>(y) * kPatchTexels + static_cast<std::size_t>(x))];
      to[1] = to[2] = 0;
      to[3] = slit && t > FirstT() && t < LastT() ? 0 : 255;
    }
  }
  ASSERT_FALSE(atlas_.Apply(patch).empty());
  const CutGeometry lips = Lips();
  const float between = 0.5f * (Middle() + other);
  int left = 0, right = 0;
  for (std::size_t k = 0; k < lips.positions.size(); k += 15) {
    const float inner = lips.coordinates[k][0], edge = lips.coordinates[k + 7][0], t = lips.coordinates[k][1];
    if (t < FirstT() + 0.002f || t > LastT() - 0.002f || edge < Middle() || edge > other) continue;
    const bool of_left = edge < between;
    (of_left ? left : right) += 1;
    EXPECT_LT(of_left ? inner - between : between - inner, 1.5f * texel);
  }
  EXPECT_GT(left, 5);
  EXPECT_GT(right, 5);
}

TEST_F(CutTest, DamageCurlsTheLipUp) {
  const auto height = [this] {
    const CutGeometry lips = Lips();
    float highest = 0;
    for (const Vec3f& p : lips.positions) highest = std::max(highest, p.z());
    return highest;
  };
  Cut(0);
  Open(0.004f);
  const float intact = height();
  Cut(255);
  EXPECT_GT(height(), intact + 0.0002f);
  EXPECT_LT(height(), 0.0015f);
}

TEST_F(CutTest, LipTrianglesFaceAsTheirNormals) {
  Cut(255);
  Open(0.004f);
  const CutGeometry lips = Lips();
  for (const Triangle& t : lips.triangles) {
    const Vec3f own = (lips.positions[t[1]] - lips.positions[t[0]]).cross(lips.positions[t[2]] - lips.positions[t[0]]);
    if (own.norm() < 1e-10f) continue;
    const Vec3f given = lips.normals[t[0]] + lips.normals[t[1]] + lips.normals[t[2]];
    EXPECT_GT(own.normalized().dot(given.normalized()), 0.0f);
  }
}

TEST_F(CutTest, StrandsOfAStraightSlitHaveTheirDensityAndAreAnchoredOnItsSides) {
  Cut();
  Open(0.001f);
  const CutStrands strands = Strands();
  const float expected = kStrandsPerMetre * (LastT() - FirstT());
  EXPECT_NEAR(static_cast<float>(strands.strands().size()), expected, 0.3f * expected);
  for (const auto& strand : strands.strands()) {
    for (const auto& [place, material] : {std::pair{strand.a, strand.material_a}, {strand.b, strand.material_b}}) {
      const bool right = material.x() > Middle();
      const Vec3f at = place.Of(mesh_.positions());
      EXPECT_LT((at - Vec3f(material.x() + (right ? 0.001f : 0.0f), material.y(), 0)).norm(), 5e-5f);
    }
    EXPECT_LT((strand.material_a.x() - Middle()) * (strand.material_b.x() - Middle()), 0);
  }
}

TEST_F(CutTest, AStrandBreaksAtItsStretch) {
  Cut();
  Open(0);
  const CutStrands strands = Strands();
  const auto intact = [&] {
    return std::ranges::count_if(strands.strands(),
                                 [&](const auto& s) { return CutStrands::StretchOf(s, mesh_) <= s.breaks_at; });
  };
  const auto count = static_cast<std::ptrdiff_t>(strands.strands().size());
  ASSERT_GT(count, 0);
  EXPECT_EQ(intact(), count);
  std::ptrdiff_t before = count;
  for (const float gap_m : {0.002f, 0.004f, 0.008f}) {
    Open(gap_m);
    EXPECT_LE(intact(), before);
    before = intact();
    for (const auto& strand : strands.strands()) {
      EXPECT_GE(strand.breaks_at, kWeakestStrand);
      EXPECT_LE(strand.breaks_at, kStrongestStrand);
    }
  }
  // Across a slit that is held open wide nothing is spanned, however little it is stretched.
  Open(kLongestSpan_m + 0.001f);
  CutGeometry wide;
  strands.Append(mesh_, eye_W_, kPixelsPerRad, &wide);
  EXPECT_FALSE(wide.triangles.empty());
  for (const Vec3f& p : wide.positions) EXPECT_GT(std::abs(p.x() - Middle() - 0.003f), 0.0005f);
  Open(0.030f);
  EXPECT_EQ(intact(), 0);
  // What is left of each stays near its lip: nothing spans the slit.
  CutGeometry drawn;
  strands.Append(mesh_, eye_W_, kPixelsPerRad, &drawn);
  EXPECT_FALSE(drawn.triangles.empty());
  for (const Triangle& t : drawn.triangles) {
    EXPECT_LT((drawn.positions[t[0]] - drawn.positions[t[2]]).norm(), 0.002f);
  }
  for (const Vec3f& p : drawn.positions) {
    EXPECT_TRUE(p.x() < Middle() + 0.004f || p.x() > Middle() + 0.026f);
  }
}

TEST_F(CutTest, CharredLipsHaveFewStrands) {
  Cut(0);
  Open(0);
  const std::size_t fresh = Strands().strands().size();
  Cut(255);
  EXPECT_LT(Strands().strands().size(), fresh / 2);
}

TEST_F(CutTest, TheSameCutGivesTheSameBytes) {
  Cut(90);
  Open(0.003f);
  CutGeometry first = Lips();
  Strands().Append(mesh_, eye_W_, kPixelsPerRad, &first);
  // As a process that joins later.
  Atlas late(view_);
  std::swap(late, atlas_);
  Cut(90);
  CutGeometry second = Lips();
  Strands().Append(mesh_, eye_W_, kPixelsPerRad, &second);
  EXPECT_EQ(first.positions, second.positions);
  EXPECT_EQ(first.coordinates, second.coordinates);
  EXPECT_EQ(first.triangles, second.triangles);
}

TEST_F(CutTest, WildPositionsDoNotSpread) {
  Cut(90);
  Open(0.003f);
  const std::size_t whole = Lips().positions.size();
  std::vector<Vec3f> particles = particles_;
  particles[view_.membrane.first + Node(27, kSlitCol)] = Vec3f::Constant(std::numeric_limits<float>::quiet_NaN());
  particles[view_.membrane.first + Node(30, kSlitCol + 1)] = Vec3f(1e20f, 0, 0);
  mesh_.Update(Interleaved(particles));
  CutGeometry drawn = Lips();
  Strands().Append(mesh_, eye_W_, kPixelsPerRad, &drawn);
  EXPECT_TRUE(Finite(drawn));
  for (const Vec3f& p : drawn.positions) EXPECT_LT(p.norm(), 1);
  EXPECT_GT(drawn.positions.size(), whole / 3) << "the rest of the slit is drawn";
}

}  // namespace
}  // namespace fulcrum::render
