#include "render_node/geometry/atlas.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <vector>

#include "services/scene/builder/build.h"
#include "tests/support/whole_topology.h"

namespace fulcrum::render {
namespace {

TemperaturePatch PatchAt(std::uint32_t x, std::uint32_t y, std::uint8_t value) {
  TemperaturePatch patch;
  patch.header.origin_x = x;
  patch.header.origin_y = y;
  patch.texels.assign(4u * kPatchTexels * kPatchTexels, value);
  return patch;
}

class AtlasTest : public testing::Test {
 protected:
  AtlasTest() : data_(scene::BuildProcedural(scene::Small())), view_(data_.View()), atlas_(view_) {
    topology_ = WholeTopology(view_);
    for (std::uint32_t row = 30; row <= 40; ++row) {
      const std::size_t node = row * view_.membrane.cols + 8;
      SetBit(topology_.dead_edges, 3 * node);
      if (row < 40) {
        SetBit(topology_.dead_edges, 3 * node + 2);
      }
    }
    const std::size_t node = 35 * view_.membrane.cols + 8;
    slit_ = 0.5f * (view_.membrane_material[node] + view_.membrane_material[node + 1]);
  }

  std::uint8_t Texel(const Vec2f& material, int channel) const {
    const auto x = static_cast<std::size_t>(material.x() / atlas_.texel_m());
    const auto y = static_cast<std::size_t>(material.y() / atlas_.texel_m());
    return atlas_.texels()[4 * (y * static_cast<std::size_t>(atlas_.width()) + x) + static_cast<std::size_t>(channel)];
  }

  const scene::SceneData data_;
  const SceneView view_;
  Atlas atlas_;
  TopologyState topology_;
  Vec2f slit_;  // Middle of the cut.
};

TEST_F(AtlasTest, CoversTheSheetAndNoMore) {
  for (const Vec2f& m : view_.membrane_material) {
    EXPECT_LE(m.x() / atlas_.texel_m(), static_cast<float>(atlas_.width()));
    EXPECT_LE(m.y() / atlas_.texel_m(), static_cast<float>(atlas_.height()));
  }
  EXPECT_LT(atlas_.width() * atlas_.height(), kAtlasTexels * kAtlasTexels / 8);
}

TEST_F(AtlasTest, StartsIntactAtBodyTemperature) {
  EXPECT_EQ(Texel(slit_, 0), 34);
  EXPECT_EQ(Texel(slit_, 1), 0);
  EXPECT_EQ(Texel(slit_, 2), 0);
  EXPECT_EQ(Texel(slit_, 3), 255);
}

TEST_F(AtlasTest, APatchReplacesItsTexelsOnly) {
  const AtlasRect rect = atlas_.Apply(PatchAt(32, 64, 99));
  EXPECT_EQ(rect.x, 32);
  EXPECT_EQ(rect.y, 64);
  EXPECT_EQ(rect.width, kPatchTexels);
  EXPECT_EQ(rect.height, kPatchTexels);
  const auto texels = atlas_.texels();
  const auto changed = std::count_if(texels.begin(), texels.end(), [](std::uint8_t byte) { return byte == 99; });
  EXPECT_EQ(changed, 4 * kPatchTexels * kPatchTexels);
}

TEST_F(AtlasTest, APatchOverTheRimIsClippedAndOneBeyondIgnored) {
  const AtlasRect rect = atlas_.Apply(PatchAt(static_cast<std::uint32_t>(atlas_.width() - 10), 0, 7));
  EXPECT_EQ(rect.width, 10);
  EXPECT_TRUE(atlas_.Apply(PatchAt(4000, 4000, 7)).empty());
  EXPECT_TRUE(atlas_.Apply(PatchAt(4294967295u, 0, 7)).empty());
  TemperaturePatch cut_short = PatchAt(0, 0, 7);
  cut_short.texels.pop_back();
  EXPECT_TRUE(atlas_.Apply(cut_short).empty());
}

TEST_F(AtlasTest, ACutKnownFromTheTopologyAloneIsASlitWithABrownedRim) {
  const AtlasRect rect = atlas_.PaintCuts(view_, topology_);
  EXPECT_FALSE(rect.empty());
  EXPECT_EQ(Texel(slit_, 3), 0);
  const Vec2f rim = slit_ + Vec2f(0.0005f, 0);
  EXPECT_EQ(Texel(rim, 3), 255);
  EXPECT_GT(Texel(rim, 2), 60);
  const Vec2f beside = slit_ + Vec2f(0.004f, 0);
  EXPECT_EQ(Texel(beside, 1), 0);
  EXPECT_TRUE(atlas_.PaintCuts(view_, topology_).empty()) << "painted twice";
}

TEST_F(AtlasTest, TheFilmTellsHowNearRemovedTissueIs) {
  EXPECT_TRUE(atlas_.TakeFilmChange().empty());
  TemperaturePatch patch = PatchAt(32, 64, 99);
  for (std::size_t k = 3; k < patch.texels.size(); k += 4) patch.texels[k] = 255;
  patch.texels[4 * (20 * kPatchTexels + 20) + 3] = 0;
  const auto rim = [&](int x, int y) {
    return atlas_
        .film()[Atlas::kFilmBytes * (static_cast<std::size_t>(y / 2) * static_cast<std::size_t>(atlas_.film_width()) +
                                     static_cast<std::size_t>(x / 2)) +
                1];
  };
  atlas_.Apply(patch);
  EXPECT_GT(rim(52, 84), 235);
  EXPECT_NEAR(rim(52 + 10, 84), 128, 16) << "1 of 2 mm away";
  EXPECT_EQ(rim(52 + 24, 84), 0);
  const AtlasRect changed = atlas_.TakeFilmChange();
  EXPECT_LE(changed.x, 26 - 9);
  EXPECT_GE(changed.x + changed.width, 26 + 9);
  EXPECT_TRUE(atlas_.TakeFilmChange().empty());
  atlas_.Apply(patch);
  EXPECT_TRUE(atlas_.TakeFilmChange().empty()) << "nothing new";
}

TEST_F(AtlasTest, BloodIsIndependentOfPatches) {
  const Vec2f place(0.005f, 0.008f);
  const int x = static_cast<int>(place.x() / (2 * atlas_.texel_m())),
            y = static_cast<int>(place.y() / (2 * atlas_.texel_m()));
  EXPECT_TRUE(atlas_.SetLiquid(x, y, 255, 20, 30));
  EXPECT_FALSE(atlas_.SetLiquid(x, y, 255, 20, 30)) << "nothing new";
  EXPECT_EQ(atlas_.Blood(place), 1);
  EXPECT_EQ(atlas_.Blood(place + Vec2f(0.0013f, 0)), 0);
  atlas_.Apply(PatchAt(32, 64, 99));
  EXPECT_EQ(atlas_.Blood(place), 1);
  EXPECT_EQ(atlas_.Blood(Vec2f(-1, -1)), 0) << "beside the sheet";
}

TEST_F(AtlasTest, WhatShowsAHistoryIsNoLongerUntouchedAndTheRestIs) {
  const float m = atlas_.texel_m();
  const Vec2f middle(0.5f * static_cast<float>(atlas_.width()) * m, 0.5f * static_cast<float>(atlas_.height()) * m);
  const Vec2f corner(0.001f, 0.001f), all = 2 * middle;
  const auto x = static_cast<std::uint32_t>(middle.x() / m), y = static_cast<std::uint32_t>(middle.y() / m);
  ASSERT_TRUE(atlas_.Untouched(Vec2f::Zero(), all));
  // Temperature, damage, dryness and opening of a texel; the first three as the shader draws them intact.
  const std::array<std::array<std::uint8_t, 4>, 2> intact{{{34, 0, 0, 255}, {41, 12, 2, 255}}};
  const std::array<std::array<std::uint8_t, 4>, 4> other{
      {{46, 0, 0, 255}, {34, 20, 0, 255}, {34, 0, 8, 255}, {34, 0, 0, 0}}};
  TemperaturePatch patch = PatchAt(x, y, 0);
  const auto apply = [&](Atlas* atlas, const std::array<std::uint8_t, 4>& texel) {
    for (std::size_t k = 0; k < patch.texels.size(); k += 4) std::ranges::copy(intact[0], &patch.texels[k]);
    std::ranges::copy(texel, patch.texels.data());
    ASSERT_FALSE(atlas->Apply(patch).empty());
  };
  for (const auto& texel : intact) {
    apply(&atlas_, texel);
    EXPECT_TRUE(atlas_.Untouched(Vec2f::Zero(), all)) << int{texel[0]};
  }
  for (const auto& texel : other) {
    Atlas atlas(view_);
    apply(&atlas, texel);
    EXPECT_FALSE(atlas.Untouched(middle, middle));
    EXPECT_FALSE(atlas.Untouched(middle + Vec2f(0.0025f, 0), middle + Vec2f(0.004f, 0)))
        << "the fascia is seen beside it";
    EXPECT_TRUE(atlas.Untouched(corner, corner));
    EXPECT_EQ(atlas.marks(), 1u);
    apply(&atlas, intact[0]);
    EXPECT_FALSE(atlas.Untouched(middle, middle)) << "it has a history";
  }
  Atlas wet(view_);
  wet.SetLiquid(static_cast<int>(x) / 2, static_cast<int>(y) / 2, 0, 0, 0);
  EXPECT_TRUE(wet.Untouched(Vec2f::Zero(), all));
  wet.SetLiquid(static_cast<int>(x) / 2, static_cast<int>(y) / 2, 0, 0, 9);
  EXPECT_FALSE(wet.Untouched(middle, middle));
  EXPECT_TRUE(wet.Untouched(corner, corner));
  SceneView hot = view_;
  hot.thermal.body_temperature_C = 42;
  EXPECT_FALSE(Atlas(hot).Untouched(corner, corner));
  SceneView cold = view_;
  cold.thermal.body_temperature_C = 15;  // Colder than a texel can say.
  EXPECT_EQ(Atlas(cold).texels()[0], 0);
  EXPECT_TRUE(Atlas(cold).Untouched(corner, corner));
}

TEST_F(AtlasTest, WhatAPatchSaidIsNotPaintedOver) {
  const auto x = static_cast<std::uint32_t>(slit_.x() / atlas_.texel_m()),
             y = static_cast<std::uint32_t>(slit_.y() / atlas_.texel_m());
  (void)atlas_.Apply(PatchAt(x > 128 ? x - 128 : 0, y > 128 ? y - 128 : 0, 200));
  (void)atlas_.PaintCuts(view_, topology_);
  EXPECT_EQ(Texel(slit_, 3), 200);
}

/// A sheet of 40 x 40 mm with nodes each millimetre: two places of an atlas with texels of 0.1 mm side by side.
TEST(AtlasOfTwoPlaces, AColdTearBesideABorderLeavesTheOtherPlaceIntact) {
  constexpr Index kNodes = 41;
  constexpr float kCell_m = 0.001f, kAlong_m = 0.0155f;
  std::vector<Vec2f> material;
  for (Index k = 0; k < kNodes * kNodes; ++k) {
    material.emplace_back(kCell_m * static_cast<float>(k % kNodes), kCell_m * static_cast<float>(k / kNodes));
  }
  SceneView scene;
  scene.membrane.rows = scene.membrane.cols = kNodes;
  scene.membrane.texel_m = 1e-4f;
  scene.membrane_material = material;
  scene.thermal.body_temperature_C = 37;
  TopologyState topology = WholeTopology(scene);
  Atlas atlas(scene);
  (void)atlas.PaintCuts(scene, topology);
  // All edges from column 25 to 26, at 25.5 mm: the border is at 25.6 mm.
  for (Index row = 10; row < 20; ++row) {
    for (const Index direction : {0u, 2u}) SetBit(topology.dead_edges, 3 * (row * kNodes + 25) + direction);
  }
  EXPECT_TRUE(atlas.PaintCuts(scene, topology).empty());
  // Thermal removes the cells at the tear, which are in one place, and sends that place alone.
  TemperaturePatch patch = PatchAt(0, 0, 0);
  for (int k = 0; k < kPatchTexels * kPatchTexels; ++k) {
    const bool removed = k % kPatchTexels == kPatchTexels - 1 && k / kPatchTexels > 100 && k / kPatchTexels < 200;
    patch.texels[4 * static_cast<std::size_t>(k)] = 34;
    patch.texels[4 * static_cast<std::size_t>(k) + 3] = removed ? 0 : 255;
  }
  ASSERT_FALSE(atlas.Apply(patch).empty());
  EXPECT_TRUE(atlas.Removed({0.02555f, kAlong_m}));
  EXPECT_FALSE(atlas.Removed({0.02575f, kAlong_m}));
  for (const float across_m : {0.0245f, 0.0257f, 0.0259f, 0.0263f}) {
    const auto texel = atlas.At({across_m, kAlong_m}).value();
    EXPECT_EQ(int{texel[1]}, 0) << across_m;
    EXPECT_EQ(int{texel[2]}, 0) << across_m;
    EXPECT_EQ(int{texel[3]}, 255) << across_m;
  }
}

}  // namespace
}  // namespace fulcrum::render
