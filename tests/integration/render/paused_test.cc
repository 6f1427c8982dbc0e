// What goes on while the picture is paused.
#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <thread>

#include "render_node/node/render_node.h"
#include "services/scene/builder/build.h"
#include "tests/integration/render/node_bus.h"
#include "tests/integration/render/synthetic_scene.h"

namespace fulcrum::render {
namespace {

class PausedTest : public testing::Test {
 protected:
  PausedTest() : data_(scene::BuildProcedural(scene::Small())), view_(data_.View()) {
    view_.render.width = 320;
    view_.render.height = 180;
  }

  /// A node that has shown the synthetic moment of 1 s.
  std::unique_ptr<RenderNode> MakeNode(const NodeBus& bus) {
    auto node = std::make_unique<RenderNode>(view_, RenderSettings{}, bus.ports());
    SyntheticMoment moment = MakeSyntheticMoment(view_, 1.0);
    moment.tissue.header.stamp = moment.topology.stamp = moment.tools.stamp = moment.handles.stamp = Next();
    bus.tissue_out->Write(moment.tissue);
    bus.topology_out->Write(moment.topology);
    bus.tools_out->Write(moment.tools);
    bus.handles_out->Write(moment.handles);
    node->Step(At(1.0));
    return node;
  }
  Stamp Next() {
    ++sequence_;
    return {sequence_, 1, static_cast<std::int64_t>(sequence_)};
  }
  static Tick At(double time_s) { return {static_cast<std::uint64_t>(time_s * 15), time_s, 1.0 / 15, 0}; }

  const scene::SceneData data_;
  SceneView view_;
  std::uint64_t sequence_ = 0;
};

// Who takes the controls during a pause begins where the tools are, not where the picture shows them.
TEST_F(PausedTest, PicturesTellWhereTheToolsAreNow) {
  NodeBus bus;
  const auto node = MakeNode(bus);
  const auto reader = bus.pictures.MakeInput();
  Picture picture;
  const auto drawn = [&] {
    for (int i = 0; i < 500 && !reader->TakeLatest(&picture); ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return picture.header.stamp.sequence;
  };
  node->Press('p');
  node->Step(At(1.1));
  const std::uint64_t paused = drawn();
  ToolState moved = MakeSyntheticMoment(view_, 1.0).tools;
  const Vec3f shown = moved.tools[1].p_WT;
  ASSERT_EQ(picture.header.tip_W[1], shown);
  moved.stamp = Next();
  moved.tools[1].p_WT += Vec3f(0.05f, 0, 0);
  bus.tools_out->Write(moved);
  node->Step(At(1.2));
  EXPECT_EQ(drawn(), paused + 1);
  EXPECT_EQ(picture.header.tip_W[1], moved.tools[1].p_WT);
  EXPECT_EQ(node->tools().tools[1].p_WT, shown) << "the picture shows it where it was";
}

TEST_F(PausedTest, AnInjuryIsShownAfterwardsHoweverMuchHasHappenedSince) {
  const auto yellow_text = [&](bool injured) {
    NodeBus bus;
    const auto node = MakeNode(bus);
    node->Press('p');
    constexpr int kEvents = 600, kRead = 100;  // A port keeps 512.
    for (int i = 0; i < kEvents; ++i) {
      ThermalEvent event;
      event.stamp = Next();
      event.session_time_s = 1.0;
      event.kind = injured && i == 0 ? ThermalEventKind::kUreterInjury : ThermalEventKind::kChar;
      bus.events_out->Write(event);
      if (i % kRead == 0) node->Step(At(1.1));
    }
    node->Press('p');
    node->Step(At(1.2));
    node->Step(At(30));  // The smoke is gone.
    Bitmap picture;
    EXPECT_TRUE(node->DrawInto(&picture));
    int count = 0;
    for (std::size_t k = 0; k < picture.rgb.size(); k += 3) {
      count += picture.rgb[k] > 250 && picture.rgb[k + 2] < 60 ? 1 : 0;
    }
    return count;
  };
  EXPECT_GT(yellow_text(true), yellow_text(false) + 100);
}

}  // namespace
}  // namespace fulcrum::render
