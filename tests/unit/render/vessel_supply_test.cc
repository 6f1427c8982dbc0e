// Vessels that clips close: sources of blood with known answers on a straight vessel along t.
#include "render_node/geometry/vessel_supply.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <optional>
#include <vector>

#include "render_node/geometry/bleeding.h"
#include "services/scene/builder/build.h"

namespace fulcrum::render {
namespace {

constexpr int kTexels = 256;
constexpr float kPerMetre = 10;       // One repetition is longer than the sheet.
constexpr float kVessel_s = 0.0213f;  // Middle of a column of texels, 0.39 mm wide [m].
constexpr float kCut_t = 0.042f;      // In the middle of the sheet.

class VesselSupplyTest : public testing::Test {
 protected:
  VesselSupplyTest()
      : data_(scene::BuildProcedural(scene::Small())), view_(data_.View()), membrane_(view_), atlas_(view_) {
    std::vector<float> xyz;
    for (const Vec3f& p : view_.rest_position) xyz.insert(xyz.end(), {p.x(), p.y(), p.z()});
    membrane_.Update(xyz);
    for (int y = 0; y < kTexels; ++y) Vessel(Column(kVessel_s), y);
    bleeding_.emplace(view_, pattern_, kTexels, kPerMetre);
  }

  static int Column(float metres) { return static_cast<int>(metres * kPerMetre * kTexels); }
  void Vessel(int x, int y) { pattern_[4 * static_cast<std::size_t>(y * kTexels + x) + 3] = 255; }

  [[nodiscard]] Index NodeAt(float s, float t) const {
    const Vec2f place(s, t);
    Index best = 0;
    for (Index k = 1; k < view_.membrane_material.size(); ++k) {
      if ((view_.membrane_material[k] - place).norm() < (view_.membrane_material[best] - place).norm()) best = k;
    }
    return view_.membrane.first + best;
  }
  /// A clip across the direction of the vessel.
  [[nodiscard]] Clip ClipAt(float s, float t) const {
    Clip clip;
    clip.length_m = 0.008f;
    clip.anchors = {NodeAt(s - 0.003f, t), NodeAt(s + 0.003f, t), NodeAt(s, t + 0.0015f)};
    return clip;
  }

  /// Removes the tissue of a slit across the vessel and reports the cut.
  void Cut(double time_s, float behind_m = 0) {
    TemperaturePatch patch;
    const auto texel = [&](float metres) { return static_cast<std::uint32_t>(metres / atlas_.texel_m()); };
    patch.header.origin_x = texel(kVessel_s) - 128;
    patch.header.origin_y = texel(kCut_t + behind_m) - 128;
    patch.texels.assign(4u * kPatchTexels * kPatchTexels, 0);
    for (std::uint32_t y = 0; y < kPatchTexels; ++y) {
      for (std::uint32_t x = 0; x < kPatchTexels; ++x) {
        const float above = static_cast<float>(y) + behind_m / atlas_.texel_m();
        const bool before = behind_m > 0 && above > 124 && above < 132;
        const bool removed = x > 108 && x < 148 && ((y > 124 && y < 132) || before);  // 4 mm x 0.7 mm.
        patch.texels[4 * (y * kPatchTexels + x)] = 34;
        patch.texels[4 * (y * kPatchTexels + x) + 3] = removed ? 0 : 255;
      }
    }
    ASSERT_FALSE(atlas_.Apply(patch).empty());
    bleeding_->Cut({kVessel_s, kCut_t + behind_m}, atlas_, time_s);
  }
  bool Update(double time_s) { return bleeding_->Update(time_s, membrane_, {}, &atlas_); }
  /// Blood that lies nearer than 4 mm to the vessel's end before or behind the cut (t lower or higher).
  [[nodiscard]] float BloodAt(float side) const {
    float most = 0;
    for (float t = 0.0006f; t < 0.004f; t += 2e-4f) most = std::max(most, atlas_.Blood({kVessel_s, kCut_t + side * t}));
    return most;
  }

  const scene::SceneData data_;
  const SceneView view_;
  MembraneMesh membrane_;
  Atlas atlas_;
  std::vector<std::uint8_t> pattern_ = std::vector<std::uint8_t>(4u * kTexels * kTexels, 0);
  std::optional<Bleeding> bleeding_;
};

TEST_F(VesselSupplyTest, WithoutClipsACutVesselBleeds) {
  Cut(1);
  EXPECT_EQ(bleeding_->sources(), 1);
}

TEST_F(VesselSupplyTest, BetweenTwoClipsNothingBleeds) {
  bleeding_->SetClips(std::vector{ClipAt(kVessel_s, kCut_t - 0.0035f), ClipAt(kVessel_s, kCut_t + 0.0035f)});
  Cut(1);
  EXPECT_EQ(bleeding_->sources(), 0);
  EXPECT_FALSE(Update(2));
  EXPECT_EQ(bleeding_->shed_m3(), 0);
}

TEST_F(VesselSupplyTest, WithOneClipTheOtherEndBleeds) {
  for (const float side : {-1.0f, 1.0f}) {
    atlas_ = Atlas(view_);
    bleeding_.emplace(view_, pattern_, kTexels, kPerMetre);
    bleeding_->SetClips(std::vector{ClipAt(kVessel_s, kCut_t + side * 0.0035f)});
    Cut(1);
    EXPECT_EQ(bleeding_->sources(), 1);
    Update(1.03);  // Later it runs across the slit.
    EXPECT_EQ(bleeding_->sources(), 1);
    EXPECT_GT(BloodAt(-side), 2 * BloodAt(side)) << side;
  }
}

TEST_F(VesselSupplyTest, ClipsBesideTheVesselDoNotHelp) {
  bleeding_->SetClips(
      std::vector{ClipAt(kVessel_s + 0.008f, kCut_t - 0.0035f), ClipAt(kVessel_s + 0.008f, kCut_t + 0.0035f)});
  Cut(1);
  Update(1.5);
  EXPECT_EQ(bleeding_->sources(), 1);
}

TEST_F(VesselSupplyTest, ClipsOnABleedingVesselStopIt) {
  Cut(1);
  Update(2);
  ASSERT_EQ(bleeding_->sources(), 1);
  const Clip before = ClipAt(kVessel_s, kCut_t - 0.0035f), behind = ClipAt(kVessel_s, kCut_t + 0.0035f);
  bleeding_->SetClips(std::vector{before});
  Update(2.5);
  EXPECT_EQ(bleeding_->sources(), 1) << "the other end bleeds";
  const double shed = bleeding_->shed_m3();
  bleeding_->SetClips(std::vector{before, behind});
  Update(3);
  EXPECT_EQ(bleeding_->sources(), 0);
  EXPECT_EQ(bleeding_->shed_m3(), shed);
}

TEST_F(VesselSupplyTest, AVesselThatIsCutThroughLaterStopsWhereItsClipIs) {
  bleeding_->SetClips(std::vector{ClipAt(kVessel_s, kCut_t - 0.0035f)});
  bleeding_->Cut({kVessel_s, kCut_t}, atlas_, 1);  // Opened, not yet severed: both sides are supplied.
  Update(1.1);
  EXPECT_EQ(bleeding_->sources(), 1);
  Cut(1.2);
  Update(1.3);
  EXPECT_EQ(bleeding_->sources(), 1);
  bleeding_->SetClips(std::vector{ClipAt(kVessel_s, kCut_t - 0.0035f), ClipAt(kVessel_s, kCut_t + 0.0035f)});
  Update(1.4);
  EXPECT_EQ(bleeding_->sources(), 0);
}

TEST_F(VesselSupplyTest, AVesselThatJoinsAnotherOneBetweenTheClipsBleeds) {
  for (int x = Column(kVessel_s); x < kTexels; ++x) Vessel(x, Column(kCut_t + 0.0015f));
  bleeding_->SetClips(std::vector{ClipAt(kVessel_s, kCut_t - 0.0035f), ClipAt(kVessel_s, kCut_t + 0.0045f)});
  Cut(1);
  EXPECT_EQ(bleeding_->sources(), 1);
}

/// Shares of the vessel's length that are shown without supply: before the first clip, between the two, behind.
TEST_F(VesselSupplyTest, ShowsWhatIsCutOff) {
  VesselSupply supply(view_, pattern_, kTexels, kPerMetre);
  const float before_t = kCut_t - 0.006f, behind_t = kCut_t + 0.006f;
  const auto lengths = [&](const std::vector<Clip>& clips) {
    supply.SetClips(clips);
    std::array<int, 3> texels{};
    supply.ForEachCutOff(atlas_, [&](const Vec2f& place) {
      EXPECT_NEAR(place.x(), kVessel_s, 6e-4f);
      ++texels[place.y() < before_t ? 0 : place.y() < behind_t ? 1 : 2];
    });
    return texels;
  };
  const Clip first = ClipAt(kVessel_s, before_t), second = ClipAt(kVessel_s, behind_t);
  EXPECT_EQ(lengths({}), (std::array<int, 3>{}));
  EXPECT_EQ(lengths({first}), (std::array<int, 3>{})) << "supplied from either side";
  const auto both = lengths({first, second});
  EXPECT_EQ(both[0] + both[2], 0) << "supplied";
  EXPECT_GT(both[1], 6e-3f / atlas_.texel_m()) << "between the clips, except what they hold";
  Cut(1);
  const auto stump = lengths({first});
  EXPECT_EQ(stump[0] + stump[2], 0);
  EXPECT_GT(stump[1], 0) << "from the clip to the cut";
  EXPECT_LT(stump[1], both[1] / 2);
  EXPECT_EQ(lengths({first, second})[0], 0);
}

TEST_F(VesselSupplyTest, LooksAgainAfterAChangeOfClipsAndHalfASecondAfterCuts) {
  EXPECT_FALSE(bleeding_->FindCutOff(atlas_, 0.5)) << "without clips nothing is done";
  EXPECT_TRUE(bleeding_->cut_off().empty());
  const auto shown = [&] { return std::ranges::count(bleeding_->cut_off(), std::uint8_t{255}); };
  bleeding_->SetClips(std::vector{ClipAt(kVessel_s, kCut_t - 0.006f)});
  EXPECT_TRUE(bleeding_->FindCutOff(atlas_, 1));
  EXPECT_EQ(shown(), 0);
  EXPECT_FALSE(bleeding_->FindCutOff(atlas_, 2)) << "nothing has changed";
  Cut(2);
  EXPECT_TRUE(bleeding_->FindCutOff(atlas_, 2));
  const auto stump = shown();
  EXPECT_GT(stump, 0);
  bleeding_->SetClips({});
  EXPECT_TRUE(bleeding_->FindCutOff(atlas_, 2.1)) << "of clips at once";
  EXPECT_EQ(shown(), 0);
}

TEST_F(VesselSupplyTest, APieceThatCutsHaveSeparatedFromItsClippedVesselDoesNotBleed) {
  Cut(1);
  Cut(1, 0.002f);  // And a second slit behind the first.
  const Vec2f piece(kVessel_s, kCut_t + 0.001f);
  VesselSupply supply(view_, pattern_, kTexels, kPerMetre);
  const Clip before = ClipAt(kVessel_s, kCut_t - 0.0045f), behind = ClipAt(kVessel_s, kCut_t + 0.0075f);
  supply.SetClips(std::vector{before, behind});
  EXPECT_TRUE(supply.CutOff(piece, atlas_));
  supply.SetClips(std::vector{ClipAt(kVessel_s + 0.01f, kCut_t)});
  EXPECT_FALSE(supply.CutOff(piece, atlas_)) << "a clip on another vessel";
  // The vessel behind the second slit only ends, 12 mm away, and counts as supplied.
  for (int y = Column(kCut_t + 0.014f); y < kTexels; ++y)
    pattern_[4 * static_cast<std::size_t>(y * kTexels + Column(kVessel_s)) + 3] = 0;
  supply.SetClips(std::vector{before});
  EXPECT_FALSE(supply.CutOff({kVessel_s, kCut_t + 0.004f}, atlas_));
}

TEST_F(VesselSupplyTest, AClipOnASolidClosesNoVesselOfTheSheet) {
  ASSERT_GT(view_.membrane.first, 2u);
  Clip clip;
  clip.anchors = {0, 1, 2};
  Clip half = ClipAt(kVessel_s, kCut_t + 0.0035f);
  half.anchors[2] = 0;
  VesselSupply supply(view_, pattern_, kTexels, kPerMetre);
  supply.SetClips(std::vector{clip, half});
  EXPECT_FALSE(supply.has_clips());
  EXPECT_FALSE(supply.CutOff({kVessel_s, kCut_t}, atlas_));
}

TEST_F(VesselSupplyTest, AClipClosesAMillimetreAroundItsTriangle) {
  VesselSupply supply(view_, pattern_, kTexels, kPerMetre);
  const Clip clip = ClipAt(kVessel_s, kCut_t), other = ClipAt(kVessel_s, kCut_t + 0.02f);
  supply.SetClips(std::vector{clip, other});
  const float low = view_.membrane_material[clip.anchors[0] - view_.membrane.first].y();
  EXPECT_TRUE(supply.CutOff({kVessel_s, low - 0.9f * VesselSupply::kClosed_m}, atlas_)) << "within the clip";
  EXPECT_FALSE(supply.CutOff({kVessel_s, low - 1.2f * VesselSupply::kClosed_m}, atlas_)) << "supplied from there";
  EXPECT_TRUE(supply.CutOff({kVessel_s, kCut_t + 0.01f}, atlas_)) << "between the two";
}

}  // namespace
}  // namespace fulcrum::render
