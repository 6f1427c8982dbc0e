// Blood: sources, flow, end of bleeding, limits of cost.
#include "render_node/geometry/bleeding.h"

#include <gtest/gtest.h>

#include <vector>

#include "render_node/geometry/sheet_rim.h"
#include "services/scene/builder/build.h"

namespace fulcrum::render {
namespace {

class BleedingTest : public testing::Test {
 protected:
  BleedingTest() : data_(scene::BuildProcedural(scene::Small())), view_(data_.View()), membrane_(view_), atlas_(view_) {
    std::vector<float> xyz;
    for (const Vec3f& p : view_.rest_position) {
      xyz.insert(xyz.end(), {p.x(), p.y(), p.z()});
    }
    membrane_.Update(xyz);
    place_ = view_.membrane_material[view_.membrane.rows / 2 * view_.membrane.cols + view_.membrane.cols / 4];
  }

  /// Heats the disc round `place_` until its damage is `damage` of 255.
  void Heat(std::uint8_t damage) {
    TemperaturePatch patch;
    patch.header.origin_x = static_cast<std::uint32_t>(std::max(0.0f, place_.x() / atlas_.texel_m() - 128));
    patch.header.origin_y = static_cast<std::uint32_t>(std::max(0.0f, place_.y() / atlas_.texel_m() - 128));
    patch.texels.assign(4u * kPatchTexels * kPatchTexels, 255);
    for (std::size_t k = 0; k < patch.texels.size(); k += 4) {
      patch.texels[k] = 34;
      patch.texels[k + 1] = damage;
      patch.texels[k + 2] = 0;
    }
    ASSERT_FALSE(atlas_.Apply(patch).empty());
  }

  int Stained() const {
    int count = 0;
    for (std::size_t k = 0; k < atlas_.film().size(); k += Atlas::kFilmBytes) {
      count += atlas_.film()[k] != 0 ? 1 : 0;
    }
    return count;
  }

  const scene::SceneData data_;
  const SceneView view_;
  MembraneMesh membrane_;
  Atlas atlas_;
  Vec2f place_;
  const std::vector<std::uint8_t> vessels_ = std::vector<std::uint8_t>(4, 255);  // Everywhere.
  const std::vector<std::uint8_t> bloodless_ = std::vector<std::uint8_t>(4, 0);
};

TEST_F(BleedingTest, AnOpenedVesselStainsTheSheetDownhill) {
  Bleeding bleeding(view_, vessels_, 1, 16);
  bleeding.Cut(place_, atlas_, 1.0);
  ASSERT_EQ(bleeding.sources(), 1);
  EXPECT_TRUE(bleeding.Update(1.1, membrane_, {}, &atlas_));
  const int first = Stained();
  EXPECT_GT(first, 0);
  Vec2f centre = Vec2f::Zero();
  for (double t = 1.2; t < 4; t += 0.1) {
    bleeding.Update(t, membrane_, {}, &atlas_);
  }
  EXPECT_GT(Stained(), 2 * first);
  int count = 0;
  for (int y = 0; y < atlas_.height(); ++y) {
    for (int x = 0; x < atlas_.width(); ++x) {
      const Vec2f place = atlas_.texel_m() * Vec2f(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
      if (atlas_.Blood(place) > 0) {
        centre += place;
        ++count;
      }
    }
  }
  centre /= static_cast<float>(count);
  const auto height = [&](const Vec2f& m) {
    std::size_t best = 0;
    for (std::size_t k = 1; k < view_.membrane_material.size(); ++k) {
      if ((view_.membrane_material[k] - m).norm() < (view_.membrane_material[best] - m).norm()) {
        best = k;
      }
    }
    return membrane_.positions()[best].z();
  };
  EXPECT_LT(height(centre), height(place_));
}

TEST_F(BleedingTest, RunsToTheSideAndGathersThere) {
  const std::vector<float> rim = SheetRim(view_);
  Bleeding bleeding(view_, vessels_, 1, 16, rim);
  place_ = view_.membrane_material[view_.membrane.rows / 2 * view_.membrane.cols + view_.membrane.cols / 2 + 1];
  bleeding.Cut(place_, atlas_, 1.0);
  for (double t = 1.1; t < 40; t += 0.1) bleeding.Update(t, membrane_, {}, &atlas_);
  // A film all the way from the source, and the deepest place at the lower side of the sheet.
  float deepest = 0, away = 0, thinnest = 1;
  for (float s = place_.x(); s < static_cast<float>(atlas_.width()) * atlas_.texel_m(); s += 4e-4f) {
    float thickest = 0;
    for (float t = place_.y() - 0.02f; t < place_.y() + 0.02f; t += 4e-4f) {
      thickest = std::max(thickest, bleeding.fluid().At({s, t}).liquid());
    }
    if (thickest == 0) break;
    thinnest = std::min(thinnest, thickest);
    if (thickest > deepest) away = s - place_.x();
    deepest = std::max(deepest, thickest);
  }
  EXPECT_GT(away, 0.015f);
  EXPECT_GT(deepest, 1e-3f);
  EXPECT_GT(thinnest, 2e-5f);
  EXPECT_LT(thinnest, 2e-4f);
  const SheetFluid::Balance blood = bleeding.fluid().blood();
  EXPECT_GT(bleeding.shed_m3(), 150e-9);
  EXPECT_NEAR(blood.sum(), bleeding.shed_m3(), 1e-4 * bleeding.shed_m3());
  EXPECT_EQ(blood.ran_off, 0);
}

TEST_F(BleedingTest, HeatSealsIt) {
  Bleeding bleeding(view_, vessels_, 1, 16);
  bleeding.Cut(place_, atlas_, 1.0);
  bleeding.Update(1.5, membrane_, {}, &atlas_);
  EXPECT_EQ(bleeding.sources(), 1);
  Heat(200);
  bleeding.Update(1.6, membrane_, {}, &atlas_);
  EXPECT_EQ(bleeding.sources(), 0);
  double t = 1.7;
  for (; t < 300; t += 0.2) bleeding.Update(t, membrane_, {}, &atlas_);
  EXPECT_FALSE(bleeding.moves()) << "what has left comes to rest";
  const int stained = Stained();
  EXPECT_GT(stained, 0);
  for (; t < 700; t += 0.2) bleeding.Update(t, membrane_, {}, &atlas_);
  EXPECT_FALSE(bleeding.AgesAt(t + 10)) << "and clots";
  EXPECT_FALSE(bleeding.Update(t + 0.2, membrane_, {}, &atlas_));
  EXPECT_EQ(Stained(), stained) << "the stains remain";
}

TEST_F(BleedingTest, AtRestItAgesEachTwoSecondsIfUpdatedOnlyForThat) {
  Bleeding bleeding(view_, vessels_, 1, 16);
  bleeding.Cut(place_, atlas_, 1.0);
  bleeding.Update(2.0, membrane_, {}, &atlas_);
  Heat(200);
  double t = 2.0;
  for (; t < 2.05 || (bleeding.moves() && t < 300); t += 0.05) bleeding.Update(t, membrane_, {}, &atlas_);
  ASSERT_FALSE(bleeding.moves());
  ASSERT_GT(bleeding.fluid().blood().liquid, 0);
  std::vector<double> aged_s;
  double clotted = bleeding.fluid().blood().clotted;
  for (const double end = t + 21; t < end; t += 0.05) {
    if (!bleeding.AgesAt(t)) continue;
    bleeding.Update(t, membrane_, {}, &atlas_);
    EXPECT_GT(bleeding.fluid().blood().clotted, clotted) << "an update without ageing";
    clotted = bleeding.fluid().blood().clotted;
    aged_s.push_back(t);
  }
  ASSERT_GE(aged_s.size(), 10u);
  for (std::size_t k = 1; k < aged_s.size(); ++k) EXPECT_NEAR(aged_s[k] - aged_s[k - 1], 2, 0.08) << k;
}

TEST_F(BleedingTest, ASourceBleedsFromItsCutOnOnly) {
  Bleeding bleeding(view_, vessels_, 1, 16);
  bleeding.Cut(place_, atlas_, 1.0);
  bleeding.Update(1.5, membrane_, {}, &atlas_);
  Heat(200);
  bleeding.Update(1.6, membrane_, {}, &atlas_);
  ASSERT_EQ(bleeding.sources(), 0);
  // What lies there is not moved on for 2 s; then another vessel is cut, 1.8 s of which have passed before.
  const double before = bleeding.shed_m3();
  bleeding.Cut(view_.membrane_material[view_.membrane.rows / 2 * view_.membrane.cols + 3 * view_.membrane.cols / 4],
               atlas_, 3.4);
  ASSERT_EQ(bleeding.sources(), 1);
  bleeding.Update(3.6, membrane_, {}, &atlas_);
  EXPECT_GT(bleeding.shed_m3() - before, 0.2 * 20e-9) << "with the first pulse";
  EXPECT_LT(bleeding.shed_m3() - before, 0.3 * 20e-9);
}

TEST_F(BleedingTest, AVesselThatIsCutFurtherBleedsAtTheNewRim) {
  Bleeding bleeding(view_, vessels_, 1, 16);
  bleeding.Cut(place_, atlas_, 1.0);
  bleeding.Update(1.5, membrane_, {}, &atlas_);
  const auto patch_at = [](float metres, float texel_m) { return static_cast<std::uint32_t>(metres / texel_m); };
  TemperaturePatch patch;
  patch.texels.assign(4u * kPatchTexels * kPatchTexels, 0);
  for (std::size_t k = 0; k < patch.texels.size(); k += 4) patch.texels[k + 3] = 255;
  const std::uint32_t x = patch_at(place_.x(), atlas_.texel_m()), y = patch_at(place_.y(), atlas_.texel_m());
  patch.header.origin_x = x - 100;
  patch.header.origin_y = y - 100;
  for (std::uint32_t v = 94; v <= 106; ++v) {  // Removed within 0.6 mm: all places of the first ring.
    for (std::uint32_t u = 94; u <= 106; ++u) patch.texels[4 * (v * kPatchTexels + u) + 3] = 0;
  }
  ASSERT_FALSE(atlas_.Apply(patch).empty());
  bleeding.Update(1.6, membrane_, {}, &atlas_);
  EXPECT_EQ(bleeding.sources(), 1);
  Heat(200);
  bleeding.Update(1.7, membrane_, {}, &atlas_);
  EXPECT_EQ(bleeding.sources(), 0);
}

TEST_F(BleedingTest, ASmallVesselClosesByItself) {
  Bleeding bleeding(view_, vessels_, 1, 16);
  bleeding.Cut(place_, atlas_, 1.0);
  for (double t = 1.1; t < 8.5; t += 0.1) bleeding.Update(t, membrane_, {}, &atlas_);
  EXPECT_EQ(bleeding.sources(), 1);
  for (double t = 8.5; t < 9.5; t += 0.1) bleeding.Update(t, membrane_, {}, &atlas_);
  EXPECT_EQ(bleeding.sources(), 0);
}

TEST_F(BleedingTest, ACoagulatedOrBloodlessPlaceDoesNotBleed) {
  Bleeding without(view_, bloodless_, 1, 16);
  without.Cut(place_, atlas_, 1.0);
  EXPECT_EQ(without.sources(), 0);
  Heat(200);
  Bleeding bleeding(view_, vessels_, 1, 16);
  bleeding.Cut(place_, atlas_, 1.0);
  EXPECT_EQ(bleeding.sources(), 0);
}

TEST_F(BleedingTest, NothingIsComputedWithoutBlood) {
  Bleeding bleeding(view_, vessels_, 1, 16);
  EXPECT_FALSE(bleeding.Update(100, membrane_, {}, &atlas_));
  EXPECT_FALSE(bleeding.moves());
  EXPECT_FALSE(bleeding.AgesAt(1e6));
  bleeding.Cut(place_, atlas_, 100);
  bleeding.Update(100.2, membrane_, {}, &atlas_);
  EXPECT_GT(bleeding.shed_m3(), 0.2 * 20e-9) << "with the first pulse";
  EXPECT_LT(bleeding.shed_m3(), 0.3 * 20e-9) << "time begins at the cut";
}

TEST_F(BleedingTest, IsBoundedAndDoesNotDependOnHowOftenItIsDrawn) {
  const auto run = [&](double step) {
    Atlas atlas(view_);
    Bleeding bleeding(view_, vessels_, 1, 16);
    for (const Vec2f& m : view_.membrane_material) {
      bleeding.Cut(m, atlas, 1.0);
    }
    const Vec3f tip = membrane_.positions()[view_.membrane.rows / 2 * view_.membrane.cols + view_.membrane.cols / 2];
    const std::array<WorkingTube, 2> tubes{
        WorkingTube{TubeFlow::kAspirates, tip, -Vec3f::UnitZ(), 0.0025f},
        {TubeFlow::kIrrigates, tip + Vec3f(0, 0.02f, 0.01f), -Vec3f::UnitZ(), 0.0025f}};
    for (int k = 1; k * step < 8.0001; ++k) {
      bleeding.Update(1.0 + k * step, membrane_, tubes, &atlas);
      EXPECT_LE(bleeding.sources(), 8);
    }
    return std::vector<std::uint8_t>(atlas.film().begin(), atlas.film().end());
  };
  EXPECT_EQ(run(0.1), run(0.4));
}

}  // namespace
}  // namespace fulcrum::render
