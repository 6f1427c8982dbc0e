// Clips of the topic in the pictures of the node: when it draws, what it refuses, where they are.
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "render_node/scene_graph/drawn_surfaces.h"
#include "services/scene/builder/build.h"
#include "tests/integration/render/node_bus.h"
#include "tests/integration/render/synthetic_scene.h"

namespace fulcrum::render {
namespace {

// The middle of the box around a turned clip, whose bend is round and whose ends are not, is so far off its own [m].
constexpr float kBox = 1.5e-4f;

class RenderClipsTest : public testing::Test {
 protected:
  RenderClipsTest() : data_(scene::BuildProcedural(scene::Small())), view_(data_.View()) {
    view_.hash = 77;
    view_.render.width = 320;
    view_.render.height = 180;
    node_ = std::make_unique<RenderNode>(view_, RenderSettings{}, bus_.ports());
    moment_ = MakeSyntheticMoment(view_, 0.5);
    clips_.scene_hash = view_.hash;
    clips_.count = 2;
    const Index first = view_.membrane.first, cols = view_.membrane.cols;
    for (std::size_t k = 0; k < 2; ++k) {
      const Index node = first + (30 + 5 * static_cast<Index>(k)) * cols + 12;
      clips_.clips[k].anchors = {node, node + 1, node + cols};
      clips_.clips[k].length_m = 0.008f;
      clips_.clips[k].p_AC = Vec3f(0, 0, 0.002f);
    }
  }

  void WriteClips() {
    ++sequence_;
    clips_.stamp = {sequence_, 1, static_cast<std::int64_t>(sequence_)};
    bus_.clips_out->Write(clips_);
  }
  void WriteTissue() {
    ++sequence_;
    moment_.tissue.header.stamp = {sequence_, 1, static_cast<std::int64_t>(sequence_)};
    bus_.tissue_out->Write(moment_.tissue);
  }
  void Step(double time_s) { node_->Step({static_cast<std::uint64_t>(15 * time_s), time_s, 1.0 / 15, 0}); }

  [[nodiscard]] double Metric(const std::string& name) const {
    Health health;
    node_->FillHealth(&health);
    for (const auto& metric : health.metrics) {
      if (metric.name == name) return metric.value;
    }
    return 0;
  }
  /// Middles of the clips as drawn [m, W].
  [[nodiscard]] std::vector<Vec3f> Drawn() const {
    std::vector<Vec3f> middles;
    for (const DrawnSurface& surface : DrawnSurfaces(node_->view().root())) {
      if (surface.name != "clip") continue;
      Vec3d low = surface.positions_W[0], high = low;
      for (const Vec3d& p : surface.positions_W) {
        low = low.cwiseMin(p);
        high = high.cwiseMax(p);
      }
      middles.emplace_back((0.5 * (low + high)).cast<float>());
    }
    return middles;
  }
  /// Where it is by the tissue's positions.
  [[nodiscard]] Vec3f Expected(std::size_t clip) const {
    const auto at = [&](Index k) { return Vec3f(Vec3f::Map(&moment_.tissue.xyz[3 * std::size_t{k}])); };
    const auto& [a, b, c] = clips_.clips[clip].anchors;
    const Vec3f normal = (at(b) - at(a)).cross(at(c) - at(a)).normalized();
    return (at(a) + at(b) + at(c)) / 3 + 0.002f * normal;
  }

  const scene::SceneData data_;
  SceneView view_;
  NodeBus bus_;
  std::unique_ptr<bus::Input<Picture>> reader_ = bus_.pictures.MakeInput();
  std::unique_ptr<RenderNode> node_;
  SyntheticMoment moment_;
  ClipState clips_;
  std::uint64_t sequence_ = 0;
};

TEST_F(RenderClipsTest, AreDrawnWhereTheirAnchorsAre) {
  WriteTissue();
  Step(1);
  const double drawn = Metric("frames_drawn");
  EXPECT_TRUE(Drawn().empty());
  WriteClips();
  Step(1.1);
  EXPECT_EQ(Metric("frames_drawn"), drawn + 1) << "a change of clips draws a picture";
  ASSERT_EQ(Drawn().size(), 2u);
  for (std::size_t k = 0; k < 2; ++k) EXPECT_LT((Drawn()[k] - Expected(k)).norm(), kBox) << k;
  Step(1.2);
  EXPECT_EQ(Metric("frames_drawn"), drawn + 1) << "nothing has changed since";
  for (float& x : moment_.tissue.xyz) x = 1.1f * x + 0.003f;
  WriteTissue();
  Step(1.3);
  ASSERT_EQ(Drawn().size(), 2u);
  for (std::size_t k = 0; k < 2; ++k) EXPECT_LT((Drawn()[k] - Expected(k)).norm(), kBox) << k << " has moved";
  clips_.count = 1;
  WriteClips();
  Step(1.4);
  EXPECT_EQ(Drawn().size(), 1u);
  EXPECT_EQ(Metric("clips_dropped"), 0);
}

TEST_F(RenderClipsTest, ALateProcessDrawsThemWithItsFirstTissue) {
  WriteClips();
  Step(1);
  WriteTissue();
  Step(1.1);
  ASSERT_EQ(Drawn().size(), 2u);
  EXPECT_LT((Drawn()[1] - Expected(1)).norm(), kBox);
}

TEST_F(RenderClipsTest, OneOnAVertexThatTheSceneLacksIsRefusedAndCounted) {
  WriteTissue();
  clips_.clips[0].anchors[2] = static_cast<std::uint32_t>(view_.rest_position.size());
  WriteClips();
  Step(1);
  EXPECT_EQ(Metric("clips_dropped"), 1);
  ASSERT_EQ(Drawn().size(), 1u);
  EXPECT_LT((Drawn()[0] - Expected(1)).norm(), kBox);
}

TEST_F(RenderClipsTest, ThoseOfAnotherSceneAreDropped) {
  WriteTissue();
  clips_.scene_hash = 78;
  WriteClips();
  Step(1);
  EXPECT_TRUE(Drawn().empty());
  Health health;
  node_->FillHealth(&health);
  EXPECT_EQ(health.last_error, "ClipState of another scene dropped");
}

}  // namespace
}  // namespace fulcrum::render
