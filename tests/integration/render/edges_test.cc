// Edges of known place: nearer to pictures of many samples also while everything moves; what is hidden stays hidden.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "render_node/geometry/texel.h"
#include "render_node/scene_graph/display.h"
#include "services/scene/builder/build.h"
#include "tests/integration/render/synthetic_scene.h"

namespace fulcrum::render {
namespace {

class SmoothEdgesTest : public testing::Test {
 protected:
  SmoothEdgesTest() : data_(scene::BuildProcedural(scene::BuiltIn())), scene_(data_.View()) {
    scene_.render.width = 480;
    scene_.render.height = 270;
    moment_ = MakeSyntheticMoment(scene_, 12.0);
  }

  Bitmap Draw(bool smooth, int size = 1, float scale = 1) const {
    SceneView large = scene_;
    large.render.width *= static_cast<std::uint32_t>(size);
    large.render.height *= static_cast<std::uint32_t>(size);
    LaparoscopeView view(large);
    view.SetScale(scale);
    view.SetDetail(1.0f / static_cast<float>(size));
    view.SetSmoothEdges(smooth);
    const auto display = MakeOffscreenDisplay(view, large.render);
    view.SetTissue(moment_.tissue.xyz);
    for (int k = 0; k < kMaxTools; ++k) view.SetTool(k, moment_.tools.tools[static_cast<std::size_t>(k)]);
    view.Update();
    Bitmap picture;
    display->DrawAndRead(&picture);
    return picture;
  }

  /// Mean of four by four samples.
  Bitmap Reference() const {
    constexpr int kFine = 4;
    const Bitmap fine = Draw(false, kFine);
    Bitmap mean{fine.width / kFine, fine.height / kFine, {}};
    for (int y = 0; y < mean.height; ++y) {
      for (int x = 0; x < mean.width; ++x) {
        for (std::size_t channel = 0; channel < 3; ++channel) {
          int sum = 0;
          for (int k = 0; k < kFine * kFine; ++k) {
            sum += fine.rgb[3 * TexelIndex(kFine * x + k % kFine, kFine * y + k / kFine, fine.width) + channel];
          }
          mean.rgb.push_back(static_cast<std::uint8_t>((sum + kFine * kFine / 2) / (kFine * kFine)));
        }
      }
    }
    return mean;
  }

  /// Pixels that the tools change in a picture, and their neighbours.
  std::vector<std::size_t> AroundTools() {
    const Bitmap with = Draw(false);
    const SyntheticMoment before = moment_;
    for (ToolSample& tool : moment_.tools.tools) tool.kind = ToolKind::kNone;
    const Bitmap without = Draw(false);
    moment_ = before;
    const auto differs = [&](int x, int y) {
      const std::size_t at = 3 * TexelIndex(x, y, with.width);
      return std::abs(int{with.rgb[at]} - int{without.rgb[at]}) > 24;
    };
    std::vector<std::size_t> border;
    for (int y = 1; y + 1 < with.height; ++y) {
      for (int x = 1; x + 1 < with.width; ++x) {
        const bool here = differs(x, y);
        if (here != differs(x + 1, y) || here != differs(x - 1, y) || here != differs(x, y + 1) ||
            here != differs(x, y - 1)) {
          border.push_back(TexelIndex(x, y, with.width));
        }
      }
    }
    return border;
  }

  static double Error(const Bitmap& a, const Bitmap& b, const std::vector<std::size_t>& pixels) {
    double sum = 0;
    for (const std::size_t pixel : pixels) {
      for (std::size_t k = 3 * pixel; k < 3 * pixel + 3; ++k) sum += std::abs(int{a.rgb[k]} - int{b.rgb[k]});
    }
    return sum / (3.0 * static_cast<double>(pixels.size()));
  }

  /// Pixels of the rim of the round field.
  [[nodiscard]] std::vector<std::size_t> Rim(float half_width) const {
    const Laparoscope scope = MakeLaparoscope(scene_.render);
    std::vector<std::size_t> rim;
    for (int y = 0; y < 270; ++y) {
      for (int x = 0; x < 480; ++x) {
        const Vec2f at(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
        if (std::abs((at - scope.picture_centre).norm() - scope.circle_radius) < half_width) {
          rim.push_back(TexelIndex(x, y, 480));
        }
      }
    }
    return rim;
  }

  const scene::SceneData data_;
  SceneView scene_;
  SyntheticMoment moment_;
};

TEST_F(SmoothEdgesTest, OutlinesOfInstrumentsComeNearThoseOfManySamplesAtAnySlope) {
  for (const float roll_deg : {0.0f, 13.0f, 71.0f}) {
    scene_.render.roll_deg = roll_deg;
    const Bitmap reference = Reference();
    const std::vector<std::size_t> border = AroundTools();
    ASSERT_GT(border.size(), 200u);
    for (const float scale : {1.0f, 0.52f}) {
      const double plain = Error(Draw(false, 1, scale), reference, border);
      EXPECT_LT(Error(Draw(true, 1, scale), reference, border), (scale < 1 ? 0.9 : 0.6) * plain)
          << roll_deg << " degrees, scale " << scale << ", plain " << plain;
    }
  }
}

TEST_F(SmoothEdgesTest, BothEyesHaveSmoothOutlines) {
  for (const StereoLayout layout : {StereoLayout::kSideBySide, StereoLayout::kTopBottom}) {
    scene_.stereo = {layout, 0.005f, 0.06f};
    const Bitmap reference = Reference(), plain = Draw(false), smooth = Draw(true);
    const std::vector<std::size_t> border = AroundTools();
    for (const bool second : {false, true}) {  // In the picture: right, or top.
      std::vector<std::size_t> part;
      for (const std::size_t pixel : border) {
        const auto x = pixel % static_cast<std::size_t>(plain.width), y = pixel / static_cast<std::size_t>(plain.width);
        if ((layout == StereoLayout::kSideBySide ? x >= 240 : y >= 135) == second) part.push_back(pixel);
      }
      ASSERT_GT(part.size(), 100u);
      EXPECT_LT(Error(smooth, reference, part), 0.7 * Error(plain, reference, part)) << second;
    }
  }
}

TEST_F(SmoothEdgesTest, TheRimOfTheFieldIsAsOfManySamples) {
  const Bitmap reference = Reference();
  const std::vector<std::size_t> rim = Rim(1);
  for (const float scale : {1.0f, 0.52f}) {
    const double plain = Error(Draw(false, 1, scale), reference, rim);
    EXPECT_LT(Error(Draw(true, 1, scale), reference, rim), 0.35 * plain) << scale << ", plain " << plain;
  }
}

TEST_F(SmoothEdgesTest, HiddenInstrumentsLeaveNoLines) {
  // Behind everything that the scope sees: all that is drawn hides them.
  const Laparoscope scope = MakeLaparoscope(scene_.render);
  const Vec3f away = 0.09f * (scene_.render.scope_target_W - EyeOf(scope)).normalized();
  for (ToolSample& tool : moment_.tools.tools) tool.p_WT += away;
  Bitmap plain = Draw(false), smooth = Draw(true);
  for (const std::size_t pixel : Rim(2)) {
    for (std::size_t k = 3 * pixel; k < 3 * pixel + 3; ++k) plain.rgb[k] = smooth.rgb[k] = 0;
  }
  for (ToolSample& tool : moment_.tools.tools) tool.kind = ToolKind::kNone;
  Bitmap none = Draw(false);
  for (const std::size_t pixel : Rim(2)) std::fill_n(none.rgb.begin() + static_cast<std::ptrdiff_t>(3 * pixel), 3, 0);
  const auto differ = [](const Bitmap& a, const Bitmap& b, int x, int y) {
    const std::size_t at = 3 * TexelIndex(x, y, a.width);
    return a.rgb[at] != b.rgb[at] || a.rgb[at + 1] != b.rgb[at + 1] || a.rgb[at + 2] != b.rgb[at + 2];
  };
  constexpr int kStrip = 2;  // Half of its width, and the pixel beyond.
  int lines = 0, seen = 0;
  for (int y = kStrip; y + kStrip < plain.height; ++y) {
    for (int x = kStrip; x + kStrip < plain.width; ++x) {
      bool near_tool = false;
      for (int dy = -kStrip; dy <= kStrip; ++dy) {
        for (int dx = -kStrip; dx <= kStrip; ++dx) near_tool |= differ(plain, none, x + dx, y + dy);
      }
      if (near_tool) ++seen;
      if (!near_tool && differ(plain, smooth, x, y)) ++lines;
    }
  }
  EXPECT_EQ(lines, 0) << "pixels";
  EXPECT_LT(seen, 10000) << "of the instruments themselves: most of them must be hidden";
}

TEST_F(SmoothEdgesTest, SwitchedOffItIsThePlainPicture) {
  LaparoscopeView view(scene_);
  const auto display = MakeOffscreenDisplay(view, scene_.render);
  view.SetTissue(moment_.tissue.xyz);
  for (int k = 0; k < kMaxTools; ++k) view.SetTool(k, moment_.tools.tools[static_cast<std::size_t>(k)]);
  Bitmap picture;
  for (const bool smooth : {true, false}) {
    view.SetSmoothEdges(smooth);
    view.Update();
    display->DrawAndRead(&picture);
  }
  EXPECT_EQ(picture.rgb, Draw(false).rgb);
}

}  // namespace
}  // namespace fulcrum::render
