// Smoothing by successive pictures: better edges where nothing moves, the same picture as without where the camera
// does.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "render_node/geometry/texel.h"
#include "render_node/scene_graph/display.h"
#include "services/scene/builder/build.h"
#include "tests/integration/render/synthetic_scene.h"
#include "tests/support/picture_statistics.h"

namespace fulcrum::render {
namespace {

class SmoothedTest : public testing::Test {
 protected:
  SmoothedTest() : data_(scene::BuildProcedural(scene::BuiltIn())), scene_(data_.View()) {
    scene_.render.width = 480;
    scene_.render.height = 270;
    moment_ = MakeSyntheticMoment(scene_, 12.0);
  }

  struct Drawing {
    explicit Drawing(const SceneView& scene) : view(scene), display(MakeOffscreenDisplay(view, scene.render)) {}
    Bitmap Draw() {
      view.Update();
      Bitmap picture;
      display->DrawAndRead(&picture);
      return picture;
    }
    LaparoscopeView view;
    std::unique_ptr<Display> display;
  };

  void Show(LaparoscopeView* view) const {
    view->SetTissue(moment_.tissue.xyz);
    view->SetTopology(moment_.topology);
    for (const TemperaturePatch& patch : moment_.patches) view->ApplyPatch(patch);
    for (int k = 0; k < kMaxTools; ++k) view->SetTool(k, moment_.tools.tools[static_cast<std::size_t>(k)]);
  }

  std::unique_ptr<Drawing> Make(float scale, bool smoothed) const {
    auto drawing = std::make_unique<Drawing>(scene_);
    drawing->view.SetScale(scale);
    drawing->view.SetSmoothed(smoothed);
    Show(&drawing->view);
    return drawing;
  }

  /// Four by four samples a pixel, of the same triangles.
  Bitmap Reference() const {
    constexpr int kFine = 4;
    SceneView large = scene_;
    large.render.width *= kFine;
    large.render.height *= kFine;
    Drawing drawing(large);
    drawing.view.SetDetail(1.0f / kFine);
    Show(&drawing.view);
    const Bitmap fine = drawing.Draw();
    Bitmap mean{fine.width / kFine, fine.height / kFine, {}};
    for (int y = 0; y < mean.height; ++y) {
      for (int x = 0; x < mean.width; ++x) {
        for (std::size_t channel = 0; channel < 3; ++channel) {
          int sum = 0;
          for (int k = 0; k < kFine * kFine; ++k) {
            sum += fine.rgb[3 * TexelIndex(kFine * x + k % kFine, kFine * y + k / kFine, fine.width) + channel];
          }
          mean.rgb.push_back(static_cast<std::uint8_t>(sum / (kFine * kFine)));
        }
      }
    }
    return mean;
  }

  static double EdgeError(const Bitmap& picture, const Bitmap& reference) {
    const std::vector<std::size_t> edges = EdgePixels(reference);
    double sum = 0;
    for (const std::size_t edge : edges) {
      for (std::size_t k = 3 * edge; k < 3 * edge + 3; ++k)
        sum += std::abs(int{picture.rgb[k]} - int{reference.rgb[k]});
    }
    return sum / (3.0 * static_cast<double>(edges.size()));
  }

  const scene::SceneData data_;
  SceneView scene_;
  SyntheticMoment moment_;
};

TEST_F(SmoothedTest, EdgesAtRestComeNearThoseOfManySamples) {
  const Bitmap reference = Reference();
  for (const float scale : {1.0f, 0.72f}) {
    const double single = EdgeError(Make(scale, false)->Draw(), reference);
    const auto drawing = Make(scale, true);
    Bitmap picture = drawing->Draw();
    EXPECT_NEAR(EdgeError(picture, reference), single, 0.02 * single) << "the first picture has one sample a pixel";
    int refined = 0;
    for (; drawing->view.Refine() && refined < 100; ++refined) picture = drawing->Draw();
    EXPECT_GE(refined, 8);
    EXPECT_LE(refined, 16) << "then the picture is as good as it will be";
    EXPECT_LT(EdgeError(picture, reference), (scale < 1 ? 0.6 : 0.45) * single) << scale;
    EXPECT_EQ(drawing->Draw().rgb, picture.rgb) << "nothing is drawn again";
    drawing->view.SetTool(0, moment_.tools.tools[0]);
    EXPECT_TRUE(drawing->view.Refine());
  }
}

TEST_F(SmoothedTest, APictureOfAMovingCameraIsThatWithoutSmoothing) {
  const auto smoothed = Make(1, true), single = Make(1, false);
  RenderParams camera = scene_.render;
  for (int k = 0; k < 3; ++k) {
    camera.scope_tip_W.x() += 1e-4f;
    for (Drawing* drawing : {smoothed.get(), single.get()}) drawing->view.SetCamera(camera);
    EXPECT_EQ(smoothed->Draw().rgb, single->Draw().rgb) << k;
  }
  for (int k = 0; k < 3 && smoothed->view.Refine(); ++k) (void)smoothed->Draw();
  smoothed->view.SetSmoothed(false);
  EXPECT_EQ(smoothed->Draw().rgb, single->Draw().rgb) << "switched off";
}

TEST_F(SmoothedTest, AToolThatMovesIsAsWithoutSmoothing) {
  const auto smoothed = Make(1, true);
  (void)smoothed->Draw();
  for (int k = 0; k < 20; ++k) {
    smoothed->view.Refine();
    (void)smoothed->Draw();
  }
  ToolSample hook = moment_.tools.tools[1];
  for (int k = 0; k < 12; ++k) {
    hook.p_WT += Vec3f(0.0005f, 0, 0.0005f);
    smoothed->view.SetTool(1, hook);
    (void)smoothed->Draw();
  }
  const Bitmap shown = smoothed->Draw();
  moment_.tools.tools[1] = hook;
  const Bitmap reference = Reference();
  EXPECT_LT(EdgeError(shown, reference), EdgeError(Make(1, false)->Draw(), reference)) << "a ghost of the hook";
}

}  // namespace
}  // namespace fulcrum::render
