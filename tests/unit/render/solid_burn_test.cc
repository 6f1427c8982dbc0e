#include "render_node/geometry/solid_burn.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <set>
#include <vector>

#include "services/scene/builder/build.h"
#include "tests/unit/render/interleaved.h"

namespace fulcrum::render {
namespace {

class SolidBurnTest : public testing::Test {
 protected:
  SolidBurnTest()
      : data_(scene::BuildProcedural(scene::Small())), view_(data_.View()), charts_(MakeSolidCharts(view_)) {
    const std::vector<float> xyz = Interleaved(view_.rest_position);
    rest_.resize(view_.surface_vertices.size());
    MapEmbedded(view_.tets, view_.surface_vertices, xyz, rest_);
    // The solids' surface has an inside as well, which is not drawn: the place is found from the drawn surface.
    const NearestOnSurface simulated(view_.rest_position, view_.tube_surface);
    float nearest = std::numeric_limits<float>::max();
    for (const Triangle& t : view_.surface_triangles) {
      const SurfacePoint point = simulated.Find((rest_[t[0]] + rest_[t[1]] + rest_[t[2]]) / 3);
      const Index index = charts_.of_triangle[point.number];
      if (index == kNoIndex) continue;
      const SolidChart& chart = charts_.charts[index];
      const Vec2f middle = kSolidCell_m * Vec2f(static_cast<float>(chart.x) + 0.5f * static_cast<float>(chart.width),
                                                static_cast<float>(chart.y) + 0.5f * static_cast<float>(chart.height));
      const Vec3f place = point.At(xyz);
      const float distance = (chart.Material(place) - middle).norm();
      if (distance >= nearest) continue;
      nearest = distance;
      place_ = place;
      material_ = chart.Material(place);
      chart_ = index;
    }
  }

  /// Intact but for the texel at material_, which has this damage.
  [[nodiscard]] TemperaturePatch Patch(std::uint8_t damage) const {
    const auto x = static_cast<std::uint32_t>(material_.x() / kSolidCell_m);
    const auto y = static_cast<std::uint32_t>(material_.y() / kSolidCell_m);
    TemperaturePatch patch;
    patch.header.surface = BurntSurface::kSolids;
    patch.header.origin_x = x > 100 ? x - 100 : 0;
    patch.header.origin_y = y > 100 ? y - 100 : 0;
    for (int texel = 0; texel < kPatchTexels * kPatchTexels; ++texel) {
      patch.texels.insert(patch.texels.end(), {std::uint8_t{34}, std::uint8_t{0}, std::uint8_t{0}, std::uint8_t{255}});
    }
    patch.texels[4 * ((y - patch.header.origin_y) * std::size_t{kPatchTexels} + x - patch.header.origin_x) + 1] =
        damage;
    return patch;
  }

  const scene::SceneData data_;
  const SceneView view_;
  const SolidCharts charts_;
  Vec3f place_ = Vec3f::Zero();  // Of a burn, at rest: near the middle of a chart.
  Vec2f material_ = Vec2f::Zero();
  Index chart_ = 0;
  std::vector<Vec3f> rest_;  // Of the drawn vertices.
};

TEST_F(SolidBurnTest, MakesNothingBeforeTheFirstPatch) {
  const SolidBurn burn(view_);
  EXPECT_EQ(burn.atlas().width(), 0);
  EXPECT_TRUE(burn.atlas().texels().empty());
  EXPECT_TRUE(burn.triangles().empty());
  EXPECT_EQ(burn.additions(), 0u);
}

TEST_F(SolidBurnTest, WarmTissueThatIsNotDamagedNeedsNoTriangles) {
  SolidBurn burn(view_);
  TemperaturePatch warm = Patch(0);
  for (std::size_t i = 0; i < warm.texels.size(); i += 4) warm.texels[i] = 70;
  EXPECT_FALSE(burn.Apply(warm).empty());
  EXPECT_TRUE(burn.triangles().empty());
}

TEST_F(SolidBurnTest, ABurnAddsTheDrawnTrianglesOfItsChartAndNoOthers) {
  SolidBurn burn(view_);
  const AtlasRect rect = burn.Apply(Patch(200));
  EXPECT_FALSE(rect.empty());
  EXPECT_GE(burn.atlas().width(), charts_.width);
  EXPECT_GE(burn.atlas().height(), charts_.height);
  EXPECT_EQ(burn.additions(), 1u);
  ASSERT_FALSE(burn.triangles().empty());
  EXPECT_LT(burn.triangles().size(), view_.surface_triangles.size());
  ASSERT_EQ(burn.vertices().size(), burn.materials().size());
  ASSERT_EQ(burn.vertices().size(), burn.charts().size());
  ASSERT_EQ(burn.vertices().size(), burn.boxes().size());

  // The simulated triangles of the chart at rest, and the most that a drawn triangle of it reaches beyond them: half a
  // triangle over the border, and the distance of the two surfaces.
  constexpr float kBeyond_m = 0.006f;
  const SolidChart& chart = charts_.charts[chart_];
  Vec3f low = Vec3f::Constant(std::numeric_limits<float>::max()), high = -low;
  for (Index t = 0; t < view_.tube_surface.size(); ++t) {
    if (charts_.of_triangle[t] != chart_) continue;
    for (const Index v : view_.tube_surface[t]) {
      low = low.cwiseMin(view_.rest_position[v]);
      high = high.cwiseMax(view_.rest_position[v]);
    }
  }
  for (std::size_t k = 0; k < burn.vertices().size(); ++k) {
    const Vec3f& rest = rest_[burn.vertices()[k]];
    EXPECT_TRUE((rest.array() > low.array() - kBeyond_m).all() && (rest.array() < high.array() + kBeyond_m).all());
    EXPECT_LT((burn.materials()[k] - chart.Material(rest)).norm(), 1e-6f);
    EXPECT_EQ(burn.charts()[k], chart_);
  }
}

TEST_F(SolidBurnTest, ATriangleLiesOverTheBurn) {
  SolidBurn burn(view_);
  (void)burn.Apply(Patch(200));
  int covering = 0;
  for (const Triangle& t : burn.triangles()) {
    const Vec2f a = burn.materials()[t[0]], b = burn.materials()[t[1]], c = burn.materials()[t[2]];
    const auto left_of = [&](const Vec2f& from, const Vec2f& to) {
      return (to.x() - from.x()) * (material_.y() - from.y()) - (to.y() - from.y()) * (material_.x() - from.x()) >= 0;
    };
    if (!left_of(a, b) || !left_of(b, c) || !left_of(c, a)) continue;
    ++covering;
    const Vec3f middle =
        (rest_[burn.vertices()[t[0]]] + rest_[burn.vertices()[t[1]]] + rest_[burn.vertices()[t[2]]]) / 3;
    EXPECT_LT((middle - place_).norm(), 0.005f);
  }
  EXPECT_GE(covering, 1);
}

TEST_F(SolidBurnTest, NoDrawnTriangleIsAddedToAChartTwice) {
  SolidBurn burn(view_);
  (void)burn.Apply(Patch(200));
  std::set<Triangle> drawn;
  for (const Triangle& t : burn.triangles()) {
    EXPECT_TRUE(drawn.insert({burn.vertices()[t[0]], burn.vertices()[t[1]], burn.vertices()[t[2]]}).second);
  }
}

TEST_F(SolidBurnTest, ASecondPatchOfTheSameChartAddsTexelsOnly) {
  SolidBurn burn(view_);
  (void)burn.Apply(Patch(200));
  const std::size_t triangles = burn.triangles().size();
  EXPECT_FALSE(burn.Apply(Patch(255)).empty());
  EXPECT_EQ(burn.triangles().size(), triangles);
  EXPECT_EQ(burn.additions(), 1u);
  const auto texels = burn.atlas().texels();
  EXPECT_EQ(std::count(texels.begin(), texels.end(), std::uint8_t{200}), 0);
}

TEST_F(SolidBurnTest, AChartHasTexelsWithinItsBoxOnly) {
  SolidBurn burn(view_);
  (void)burn.Apply(Patch(200));
  const Index here[] = {chart_};
  const BurnCharts atlas(burn.atlas(), here);
  (void)burn.Apply(Patch(255));
  const BurnAtlas::Texel burnt{34, 200, 0, 255};
  EXPECT_EQ(atlas.At(chart_, material_), burnt) << "a copy keeps its texels";
  EXPECT_EQ(atlas.At(chart_, material_ + Vec2f(2 * kSolidCell_m, 0)), atlas.intact());

  const SolidChart& chart = charts_.charts[chart_];
  const Vec2f low = kSolidCell_m * Vec2f(static_cast<float>(chart.x), static_cast<float>(chart.y));
  const Vec2f high = low + kSolidCell_m * Vec2f(static_cast<float>(chart.width), static_cast<float>(chart.height));
  const Vec2f half = Vec2f::Constant(0.5f * kSolidCell_m);
  EXPECT_TRUE(atlas.At(chart_, low + half));
  EXPECT_TRUE(atlas.At(chart_, high - half));
  EXPECT_FALSE(atlas.At(chart_, low - half));
  EXPECT_FALSE(atlas.At(chart_, high + half));
  EXPECT_FALSE(atlas.At(static_cast<Index>(charts_.charts.size()), material_)) << "there is no such chart";
  EXPECT_FALSE(BurnCharts(burn.atlas(), {}).At(chart_, material_)) << "it was not asked for";
}

TEST_F(SolidBurnTest, EverySurfaceTakesItsOwnPatchesOnly) {
  SolidBurn burn(view_);
  TemperaturePatch of_membrane = Patch(200);
  of_membrane.header.surface = BurntSurface::kMembrane;
  EXPECT_TRUE(burn.Apply(of_membrane).empty());
  EXPECT_EQ(burn.atlas().width(), 0) << "the atlas was made for a patch of the membrane";
  Atlas atlas(view_);
  EXPECT_TRUE(atlas.Apply(Patch(200)).empty());
  EXPECT_EQ(atlas.touches(), 0u);
}

TEST_F(SolidBurnTest, IgnoresPatchesOfWrongSizeAndBeyondTheAtlas) {
  SolidBurn burn(view_);
  TemperaturePatch cut_short = Patch(200);
  cut_short.texels.pop_back();
  EXPECT_TRUE(burn.Apply(cut_short).empty());
  TemperaturePatch beyond = Patch(200);
  for (const std::uint32_t origin : {4000u, 4294967295u}) {
    beyond.header.origin_x = beyond.header.origin_y = origin;
    EXPECT_TRUE(burn.Apply(beyond).empty());
  }
  EXPECT_TRUE(burn.triangles().empty());
}

}  // namespace
}  // namespace fulcrum::render
