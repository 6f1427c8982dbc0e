// Pictures for two eyes: what is drawn lies where two parallel cameras with asymmetric frusta see it.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "render_node/scene_graph/display.h"
#include "services/scene/builder/build.h"
#include "tests/integration/render/node_bus.h"
#include "tests/integration/render/synthetic_scene.h"

namespace fulcrum::render {
namespace {

constexpr double kTime_s = 4.8;  // Of the script: a slit is open.
constexpr float kInterocular_m = 0.005f, kConvergence_m = 0.06f;

/// One byte a pixel: what a thing covers of an eye's part, from the bottom row.
struct Mask {
  int width = 0, height = 0;
  std::vector<std::uint8_t> covered;

  [[nodiscard]] int count() const {
    int sum = 0;
    for (const std::uint8_t one : covered) sum += one;
    return sum;
  }
  /// Of the covered pixels' middles [pixels].
  [[nodiscard]] Vec2d Centre() const {
    Vec2d sum = Vec2d::Zero();
    for (std::size_t i = 0; i < covered.size(); ++i) {
      const auto x = static_cast<double>(i % static_cast<std::size_t>(width));
      const auto y = static_cast<double>(i / static_cast<std::size_t>(width));
      if (covered[i] != 0) sum += Vec2d(x + 0.5, y + 0.5);
    }
    return sum / count();
  }
};

/// The part of an eye: 0 left, 1 right.
Bitmap PartOf(const Bitmap& picture, StereoLayout layout, int eye) {
  const bool beside = layout == StereoLayout::kSideBySide;
  Bitmap part{beside ? picture.width / 2 : picture.width, beside ? picture.height : picture.height / 2, {}};
  const int from_x = beside && eye == 1 ? part.width : 0;
  const int from_y = !beside && eye == 0 ? picture.height - part.height : 0;  // The first row is the bottom one.
  for (int y = 0; y < part.height; ++y) {
    const auto row = picture.rgb.begin() + 3 * ((from_y + y) * picture.width + from_x);
    part.rgb.insert(part.rgb.end(), row, row + 3 * part.width);
  }
  return part;
}

Mask Difference(const Bitmap& a, const Bitmap& b, int threshold = 12) {
  Mask mask{a.width, a.height, {}};
  for (std::size_t i = 0; i < a.rgb.size(); i += 3) {
    int sum = 0;
    for (std::size_t k = i; k < i + 3; ++k) sum += std::abs(int{a.rgb[k]} - int{b.rgb[k]});
    mask.covered.push_back(sum > threshold ? 1 : 0);
  }
  return mask;
}

std::string NameOf(const testing::TestParamInfo<StereoLayout>& layout) {
  return layout.param == StereoLayout::kSideBySide ? "SideBySide" : "TopBottom";
}

/// Two balls, the bodies of tools 0 and 1, in an empty cavity.
class StereoBalls : public testing::TestWithParam<StereoLayout> {
 protected:
  StereoBalls() : data_(scene::BuildProcedural(scene::Small())) {
    for (std::uint32_t tool = 0; tool < 2; ++tool) AddBall(tool);
    view_ = data_.View();
    view_.static_surfaces = {};
    view_.static_vertices = {};
    view_.static_triangles = {};
    view_.stereo = {GetParam(), kInterocular_m, kConvergence_m};
    laparoscope_ = std::make_unique<LaparoscopeView>(view_);
    display_ = MakeOffscreenDisplay(*laparoscope_, view_.render);
    // No tissue in sight, hence no shadows.
    std::vector<float> far(3 * view_.rest_position.size(), 5.0f);
    laparoscope_->SetTissue(far);
    empty_ = Draw({});
  }

  struct Ball {
    int tool;
    float depth_m, x_m, y_m;  ///< Camera frame of the scope.
  };

  Bitmap Draw(std::span<const Ball> balls) {
    for (int tool = 0; tool < kMaxTools; ++tool) laparoscope_->SetTool(tool, {});
    const Laparoscope scope = MakeLaparoscope(view_.render);
    for (const Ball& ball : balls) {
      ToolSample sample;
      sample.kind = view_.tools[static_cast<std::size_t>(ball.tool)].kind;
      sample.p_WT = scope.view.block<3, 3>(0, 0).transpose() * Vec3f(ball.x_m, ball.y_m, -ball.depth_m) + EyeOf(scope);
      laparoscope_->SetTool(ball.tool, sample);
    }
    laparoscope_->Update();
    Bitmap picture;
    display_->DrawAndRead(&picture);
    return picture;
  }

  [[nodiscard]] Mask Covered(const Bitmap& picture, int eye, int threshold = 12) const {
    return Difference(PartOf(picture, GetParam(), eye), PartOf(empty_, GetParam(), eye), threshold);
  }

  scene::SceneData data_;
  SceneView view_;
  std::unique_ptr<LaparoscopeView> laparoscope_;
  std::unique_ptr<Display> display_;
  Bitmap empty_;

 private:
  /// A ball of 1 mm about the origin of frame T.
  void AddBall(std::uint32_t tool) {
    constexpr Index kRound = 24, kUp = 12;
    const auto first = static_cast<Index>(data_.tool_vertices.size());
    const auto first_triangle = static_cast<Index>(data_.tool_triangles.size());
    for (Index i = 0; i <= kUp; ++i) {
      const float polar = std::numbers::pi_v<float> * static_cast<float>(i) / kUp;
      for (Index k = 0; k < kRound; ++k) {
        const float turn = 2 * std::numbers::pi_v<float> * static_cast<float>(k) / kRound;
        data_.tool_vertices.emplace_back(
            0.001f * Vec3f(std::sin(polar) * std::cos(turn), std::sin(polar) * std::sin(turn), std::cos(polar)));
        if (i == kUp) continue;
        const Index a = i * kRound + k, b = i * kRound + (k + 1) % kRound;
        data_.tool_triangles.push_back({first + a, first + a + kRound, first + b});
        data_.tool_triangles.push_back({first + b, first + a + kRound, first + b + kRound});
      }
    }
    data_.tool_meshes.push_back({tool, ToolPart::kBody, first, static_cast<Index>(data_.tool_vertices.size()) - first,
                                 first_triangle, static_cast<Index>(data_.tool_triangles.size()) - first_triangle});
  }
};

INSTANTIATE_TEST_SUITE_P(Layouts, StereoBalls, testing::Values(StereoLayout::kSideBySide, StereoLayout::kTopBottom),
                         NameOf);

TEST_P(StereoBalls, DisparityIsThatOfParallelCamerasNearAndFarAndNoneAtTheConvergence) {
  const double height = view_.render.height;
  const double focal = height / (2 * std::tan(static_cast<double>(view_.render.fov_deg) * std::numbers::pi / 360));
  const Vec2d squeeze = GetParam() == StereoLayout::kSideBySide ? Vec2d(0.5, 1) : Vec2d(1, 0.5);
  for (const float depth_m : {0.03f, 0.045f, kConvergence_m, 0.08f, 0.11f}) {
    for (const float aside : {0.0f, 0.1f}) {
      SCOPED_TRACE(std::to_string(depth_m) + " m, " + std::to_string(aside));
      const Bitmap picture = Draw(std::vector<Ball>{{0, depth_m, aside * depth_m, -0.5f * aside * depth_m}});
      const Mask left = Covered(picture, 0), right = Covered(picture, 1);
      ASSERT_GT(left.count(), 15);
      const double disparity = static_cast<double>(kInterocular_m) * focal *
                               (1 / static_cast<double>(depth_m) - 1 / static_cast<double>(kConvergence_m));
      const Vec2d measured = left.Centre() - right.Centre();
      EXPECT_NEAR(measured.x(), squeeze.x() * disparity, 0.5);
      EXPECT_NEAR(measured.y(), 0, 0.35);
      // The place of both: the mean is that of an eye in the middle.
      const Vec2d middle = 0.5 * (left.Centre() + right.Centre());
      const Vec2d place = squeeze.cwiseProduct(Vec2d(0.5 * view_.render.width, 0.5 * height) +
                                               focal * static_cast<double>(aside) * Vec2d(1, -0.5));
      EXPECT_NEAR(middle.x(), place.x(), 0.5);
      EXPECT_NEAR(middle.y(), place.y(), 0.5);
    }
  }
}

TEST_P(StereoBalls, TheNearBallHidesTheFarOneAndEachEyeLooksPastItsOwnSide) {
  const Ball near{0, 0.03f, 0, 0}, far{1, 0.04f, 0, 0};
  const Bitmap only_near = Draw(std::vector{near}), only_far = Draw(std::vector{far});
  const Bitmap both = Draw(std::vector{near, far});
  for (const int eye : {0, 1}) {
    SCOPED_TRACE(eye);
    const Mask covers = Covered(only_near, eye), behind = Covered(only_far, eye, 0);
    const Bitmap seen = PartOf(both, GetParam(), eye), near_alone = PartOf(only_near, GetParam(), eye),
                 far_alone = PartOf(only_far, GetParam(), eye);
    const Mask not_near = Difference(seen, near_alone, 0), not_far = Difference(seen, far_alone, 0);
    int overlap = 0, aside = 0;
    for (std::size_t i = 0; i < covers.covered.size(); ++i) {
      if (covers.covered[i] != 0) {
        EXPECT_EQ(not_near.covered[i], 0) << "the near ball is covered at " << i;
        overlap += behind.covered[i];
      } else if (behind.covered[i] != 0 && not_near.covered[i] != 0) {
        EXPECT_EQ(not_far.covered[i], 0) << "something else is seen at " << i;
        ++aside;
      }
    }
    EXPECT_GT(overlap, 10);
    EXPECT_GT(aside, 10);
    const double by = behind.Centre().x() - covers.Centre().x();
    EXPECT_GT(eye == 0 ? -by : by, 1) << "the left eye sees the far ball to the left of the near one";
  }
}

TEST_P(StereoBalls, WithoutAConvergenceTheTargetHasNoDisparity) {
  SceneView at_target = view_;
  at_target.stereo.convergence_m = 0;
  display_ = nullptr;  // It refers to the view.
  laparoscope_ = nullptr;
  view_ = at_target;
  laparoscope_ = std::make_unique<LaparoscopeView>(view_);
  display_ = MakeOffscreenDisplay(*laparoscope_, view_.render);
  std::vector<float> far(3 * view_.rest_position.size(), 5.0f);
  laparoscope_->SetTissue(far);
  empty_ = Draw({});
  const float distance_m = (view_.render.scope_target_W - view_.render.scope_tip_W).norm();
  const Bitmap picture = Draw(std::vector<Ball>{{0, distance_m, 0, 0}});
  EXPECT_NEAR(Covered(picture, 0).Centre().x(), Covered(picture, 1).Centre().x(), 0.25);
}

class StereoScene : public testing::TestWithParam<StereoLayout> {
 protected:
  StereoScene() : data_(scene::BuildProcedural(scene::Small())), view_(data_.View()) {}

  Bitmap Draw(const StereoParams& stereo, std::span<const OverlayText> texts = {}) const {
    SceneView view = view_;
    view.stereo = stereo;
    LaparoscopeView laparoscope(view);
    const auto display = MakeOffscreenDisplay(laparoscope, view.render);
    const SyntheticMoment moment = MakeSyntheticMoment(view, kTime_s);
    laparoscope.SetTissue(moment.tissue.xyz);
    laparoscope.SetTopology(moment.topology);
    for (const TemperaturePatch& patch : moment.patches) laparoscope.ApplyPatch(patch);
    for (int tool = 0; tool < kMaxTools; ++tool) {
      laparoscope.SetTool(tool, moment.tools.tools[static_cast<std::size_t>(tool)]);
    }
    laparoscope.SetTexts(texts);
    laparoscope.Update();
    Bitmap picture;
    display->DrawAndRead(&picture);
    return picture;
  }

  const scene::SceneData data_;
  const SceneView view_;
};

INSTANTIATE_TEST_SUITE_P(Layouts, StereoScene, testing::Values(StereoLayout::kSideBySide, StereoLayout::kTopBottom),
                         NameOf);

/// Where the cut of the moment is in the picture of one camera, as shares of width and height.
Vec2d PlaceOfCut(const SceneView& view, const SyntheticMoment& moment) {
  LaparoscopeView laparoscope(view);
  laparoscope.SetTissue(moment.tissue.xyz);
  laparoscope.SetTopology(moment.topology);
  laparoscope.Update();
  const Vec3f p_W = laparoscope.OnMembrane(moment.cut_path[moment.cut_path.size() / 2]);
  const Laparoscope scope = MakeLaparoscope(view.render);
  const Vec3f clip = (scope.projection * scope.view * p_W.homogeneous()).hnormalized();
  return 0.5 * (clip.head<2>().cast<double>() + Vec2d::Ones());
}

/// A box of a tenth of the width and height around a place.
Bitmap Around(const Bitmap& picture, const Vec2d& place) {
  Bitmap box{picture.width / 10, picture.height / 10, {}};
  const int left = static_cast<int>(place.x() * picture.width) - box.width / 2;
  const int low = static_cast<int>(place.y() * picture.height) - box.height / 2;
  for (int y = low; y < low + box.height; ++y) {
    const auto row = picture.rgb.begin() + 3 * (y * picture.width + left);
    box.rgb.insert(box.rgb.end(), row, row + 3 * box.width);
  }
  return box;
}

/// Mean of n_x x n_y pixels.
Bitmap Squeezed(const Bitmap& fine, int n_x, int n_y) {
  Bitmap mean{fine.width / n_x, fine.height / n_y, {}};
  for (int y = 0; y < mean.height; ++y) {
    for (int x = 0; x < mean.width; ++x) {
      for (int channel = 0; channel < 3; ++channel) {
        int sum = 0;
        for (int k = 0; k < n_x * n_y; ++k) {
          sum +=
              fine.rgb[static_cast<std::size_t>(3 * ((n_y * y + k / n_x) * fine.width + n_x * x + k % n_x) + channel)];
        }
        mean.rgb.push_back(static_cast<std::uint8_t>(sum / (n_x * n_y)));
      }
    }
  }
  return mean;
}

double MeanDifference(const Bitmap& a, const Bitmap& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.rgb.size(); ++i) sum += std::abs(int{a.rgb[i]} - int{b.rgb[i]});
  return sum / static_cast<double>(a.rgb.size());
}

// Eyes that are nearly one see what one camera sees: field, vignette, light and both layers of the membrane are
// squeezed with the picture, and nothing of it is left out.
TEST_P(StereoScene, EachPartIsThePictureOfOneCameraSqueezed) {
  const Bitmap one = Draw({});
  const bool beside = GetParam() == StereoLayout::kSideBySide;
  const Bitmap wanted = Squeezed(one, beside ? 2 : 1, beside ? 1 : 2);
  const Bitmap stereo = Draw({GetParam(), 1e-5f, kConvergence_m});
  ASSERT_EQ(stereo.width, one.width);
  ASSERT_EQ(stereo.height, one.height);
  for (const int eye : {0, 1}) EXPECT_LT(MeanDifference(PartOf(stereo, GetParam(), eye), wanted), 1.5);
  const Vec2d cut = PlaceOfCut(view_, MakeSyntheticMoment(view_, kTime_s));
  for (const int eye : {0, 1}) {
    EXPECT_LT(MeanDifference(Around(PartOf(stereo, GetParam(), eye), cut), Around(wanted, cut)), 3.1)
        << "the fascia below the edges of the slit, its lips, and strands of about a pixel";
  }
  // What a real distance of the eyes changes is several times as much.
  const Bitmap apart = Draw({GetParam(), kInterocular_m, 0.3f});
  for (const int eye : {0, 1}) EXPECT_GT(MeanDifference(PartOf(apart, GetParam(), eye), wanted), 4.0);
}

TEST_P(StereoScene, TextIsAtTheSamePlaceForBothEyes) {
  const std::vector<OverlayText> texts{{Corner::kTopLeft, 0, "CUT 35 W"},
                                       {Corner::kTopRight, 1, "0:12"},
                                       {Corner::kBottomLeft, 0, "URETER", true, 2},
                                       {Corner::kBottomRight, 2, "R ▮▮▯ 1.2 N"}};
  const StereoParams stereo{GetParam(), kInterocular_m, kConvergence_m};
  const Bitmap with = Draw(stereo, texts), without = Draw(stereo);
  const auto lit = [](const Bitmap& picture, const Bitmap& dark) { return Difference(picture, dark, 150); };
  const Mask left = lit(PartOf(with, GetParam(), 0), PartOf(without, GetParam(), 0));
  const Mask right = lit(PartOf(with, GetParam(), 1), PartOf(without, GetParam(), 1));
  EXPECT_EQ(left.covered, right.covered) << "outside the field all is black but the text";
  // Half as many pixels as the text of one camera, because it is as large on the display.
  const Mask one = lit(Draw({}, texts), Draw({}));
  EXPECT_NEAR(left.count(), 0.5 * one.count(), 0.15 * one.count());
}

TEST_P(StereoScene, AReaderOfLivePicturesOperatesTheToolsAsWithOneCamera) {
  std::vector<PictureHeader> headers;
  for (const StereoLayout layout : {StereoLayout::kNone, GetParam()}) {
    SceneView view = view_;
    view.stereo.layout = layout;
    NodeBus bus;
    const auto reader = bus.pictures.MakeInput();
    RenderNode node(view, {}, bus.ports());
    SyntheticMoment moment = MakeSyntheticMoment(view, kTime_s);
    moment.tissue.header.stamp = moment.tools.stamp = {1, 1, 1};
    bus.tissue_out->Write(moment.tissue);
    bus.tools_out->Write(moment.tools);
    node.Step({1, kTime_s, 1.0 / 30, 0});
    Picture picture;
    for (int i = 0; i < 500 && !reader->TakeLatest(&picture); ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    headers.push_back(picture.header);
  }
  EXPECT_EQ(headers[0].width, view_.render.width);
  EXPECT_EQ(headers[1].width, headers[0].width);
  EXPECT_EQ(headers[1].height, headers[0].height);
  EXPECT_EQ(headers[1].eye_W, view_.render.scope_tip_W) << "in the middle of both eyes";
  EXPECT_EQ(headers[1].right_W, headers[0].right_W);
  EXPECT_GT(headers[0].pixel_rad, 0);
  EXPECT_EQ(headers[1].pixel_rad, headers[0].pixel_rad) << "of an eye's part at full size";
  EXPECT_EQ(headers[1].tip_W, headers[0].tip_W);
}

}  // namespace
}  // namespace fulcrum::render
