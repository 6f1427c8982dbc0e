// Ground truth of what moves fast between two pictures, and of instruments of which tests of the picture have none.
#include <gtest/gtest.h>

#include <optional>

#include "render_node/geometry/laparoscope.h"
#include "services/apps/replayer/truth.h"
#include "services/base/core/scope.h"
#include "services/scene/builder/build.h"
#include "tests/integration/render/synthetic_scene.h"

namespace fulcrum::replay {
namespace {

constexpr int kWidth = 1920, kHeight = 1080;

class TruthMotionTest : public ::testing::Test {
 protected:
  TruthMotionTest() : data_(scene::BuildProcedural(scene::BuiltIn())), scene_(data_.View()) {}

  void Show(double time_s) {
    view_.emplace(scene_);
    const render::SyntheticMoment moment = render::MakeSyntheticMoment(scene_, time_s);
    view_->SetTissue(moment.tissue.xyz);
    for (std::size_t k = 0; k < kMaxTools; ++k) view_->SetTool(static_cast<int>(k), moment.tools.tools[k]);
    view_->Update();
  }
  Truth TruthFrom(const RenderParams& camera) {
    return Truth({&*view_, render::MakeLaparoscope(camera), scene_, kWidth, kHeight});
  }

  scene::SceneData data_;
  SceneView scene_;
  std::optional<render::LaparoscopeView> view_;
};

TEST_F(TruthMotionTest, ASuctionTubeHidesTheTissueBehindIt) {
  constexpr int kTube = 2;
  ToolDescription& tube = scene_.tools[kTube];
  tube = scene_.tools[1];
  tube.kind = ToolKind::kSuction;
  Show(1);
  const Truth without = TruthFrom(scene_.render);
  // Across the line of sight, halfway to the target.
  const Vec3f middle_W = 0.5f * (scene_.render.scope_tip_W + scene_.render.scope_target_W);
  ToolSample sample;
  sample.kind = ToolKind::kSuction;
  sample.p_WT = middle_W - Vec3f(0.01f, 0, 0);
  sample.q_WT = Quatf::FromTwoVectors(Vec3f::UnitZ(), -Vec3f::UnitX());
  view_->SetTool(kTube, sample);
  view_->Update();
  const Truth with = TruthFrom(scene_.render);
  Channel classes = with.Classes(), instances = with.Instances(), before = without.Classes();
  int pixels = 0;
  for (int y = 0; y < classes.height; ++y) {
    for (int x = 0; x < classes.width; ++x) {
      const bool seen = classes.At(x, y) == static_cast<int>(TruthClass::kSuction);
      EXPECT_EQ(instances.At(x, y) == kFirstToolInstance + kTube, seen) << x << " " << y;
      EXPECT_NE(before.At(x, y), static_cast<int>(TruthClass::kSuction));
      pixels += seen ? 1 : 0;
    }
  }
  EXPECT_GT(pixels, 1000);
  const Vec3d target_W = scene_.render.scope_target_W.cast<double>();
  EXPECT_TRUE(without.Sees(target_W, 0.01));
  EXPECT_FALSE(with.Sees(target_W, 0.01)) << "it is hidden by the tube";
}

TEST_F(TruthMotionTest, WhatGoesFartherThanAFlowImageTellsIsHiddenOrFarAndNotGone) {
  Show(1);
  RenderParams zoomed = scene_.render, rolled = scene_.render;
  zoomed.fov_deg *= 0.5f;
  rolled.roll_deg += 180;
  const Truth before = TruthFrom(scene_.render);
  Channel classes = before.Classes();
  for (const RenderParams& camera : {zoomed, rolled}) {
    Channel flow = before.FlowTo(TruthFrom(camera));
    int none = 0, far = 0, hidden = 0;
    for (int y = 0; y < flow.height; ++y) {
      for (int x = 0; x < flow.width; ++x) {
        if (classes.At(x, y) != static_cast<int>(TruthClass::kSurroundings)) continue;
        const auto state = static_cast<FlowState>(flow.At(x, y, 2));
        none += state == FlowState::kNone ? 1 : 0;
        far += state == FlowState::kFar ? 1 : 0;
        hidden += state == FlowState::kHidden ? 1 : 0;
        const bool told = flow.At(x, y, 0) != 0;
        EXPECT_EQ(told, flow.At(x, y, 1) != 0);
        EXPECT_EQ(state == FlowState::kVisible && !told, false) << x << " " << y;
        EXPECT_EQ(state == FlowState::kFar && told, false) << x << " " << y;
      }
    }
    EXPECT_EQ(none, 0) << "nothing of them is cut";
    EXPECT_GT(camera.roll_deg > 90 ? far : hidden, 1000);
  }
}

}  // namespace
}  // namespace fulcrum::replay
