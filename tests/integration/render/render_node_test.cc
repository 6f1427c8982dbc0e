// The node on in-process ports: what it draws and when, what it refuses, its state after a restart.
#include "render_node/node/render_node.h"

#include <gtest/gtest.h>
#include <turbojpeg.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <osgGA/GUIEventAdapter>
#include <set>
#include <string>
#include <thread>
#include <utility>

#include "render_node/geometry/temporal_filter.h"
#include "services/scene/builder/build.h"
#include "tests/integration/render/node_bus.h"
#include "tests/integration/render/synthetic_scene.h"

namespace fulcrum::render {
namespace {

class RenderNodeTest : public testing::Test {
 protected:
  RenderNodeTest() : data_(scene::BuildProcedural(scene::Small())), view_(data_.View()) {
    view_.hash = 77;
    view_.render.width = 320;
    view_.render.height = 180;
    view_.render.png_rate_Hz = 2;
    folder_ = std::filesystem::path(testing::TempDir()) /
              (std::string("render_") + testing::UnitTest::GetInstance()->current_test_info()->name());
    std::filesystem::remove_all(folder_);
  }
  ~RenderNodeTest() override { std::filesystem::remove_all(folder_); }

  std::unique_ptr<RenderNode> MakeNode(Quality quality = Quality::kAuto) {
    return std::make_unique<RenderNode>(view_, RenderSettings{.quality = quality, .frames = folder_}, bus_.ports());
  }

  static double Metric(const RenderNode& node, const std::string& name) {
    Health health;
    node.FillHealth(&health);
    for (const auto& metric : health.metrics) {
      if (metric.name == name) {
        return metric.value;
      }
    }
    ADD_FAILURE() << "no metric " << name;
    return -1;
  }

  static void Stamped(Stamp* stamp) {
    static std::uint64_t sequence = 0;
    *stamp = {++sequence, 1, static_cast<std::int64_t>(sequence)};
  }

  void Publish(SyntheticMoment moment) {
    Stamped(&moment.tissue.header.stamp);
    Stamped(&moment.topology.stamp);
    Stamped(&moment.tools.stamp);
    Stamped(&moment.handles.stamp);
    bus_.tissue_out->Write(moment.tissue);
    bus_.topology_out->Write(moment.topology);
    bus_.tools_out->Write(moment.tools);
    bus_.handles_out->Write(moment.handles);
    for (TemperaturePatch& patch : moment.patches) {
      Stamped(&patch.header.stamp);
      bus_.patches_out->Write(patch);
    }
  }

  static Tick At(double time_s) { return {static_cast<std::uint64_t>(time_s * 15), time_s, 1.0 / 15, 0}; }

  const scene::SceneData data_;
  SceneView view_;
  std::filesystem::path folder_;
  NodeBus bus_;
};

TEST_F(RenderNodeTest, DrawsNothingBeforeTheFirstTissueFrame) {
  const auto node = MakeNode();
  node->Step(At(1));
  node->Finish();
  EXPECT_EQ(Metric(*node, "frames_drawn"), 0);
}

TEST_F(RenderNodeTest, WritesAPictureWhenOneIsDueAndNoneWhileNothingChanges) {
  {
    const auto node = MakeNode();
    Publish(MakeSyntheticMoment(view_, 1.0));
    node->Step(At(1.0));
    EXPECT_EQ(Metric(*node, "frames_drawn"), 1);
    Publish(MakeSyntheticMoment(view_, 1.2));
    node->Step(At(1.2));
    EXPECT_EQ(Metric(*node, "frames_drawn"), 1) << "the next picture is due at 1.5 s";
    node->Step(At(1.51));
    EXPECT_EQ(Metric(*node, "frames_drawn"), 2);
    node->Step(At(2.1));
    node->Step(At(2.6));
    node->Finish();
    EXPECT_EQ(Metric(*node, "frames_drawn"), 2) << "nothing has changed since";
  }
  EXPECT_TRUE(std::filesystem::exists(folder_ / "frame_0001000.png"));
  EXPECT_TRUE(std::filesystem::exists(folder_ / "frame_0001510.png"));
}

TEST_F(RenderNodeTest, ShowsTheForceOfTheTissueAndNotThatOnTheHand) {
  const auto node = MakeNode();
  const auto reader = bus_.pictures.MakeInput();
  SyntheticMoment moment = MakeSyntheticMoment(view_, 1.0);
  Publish(moment);
  node->Step(At(1.0));
  node->Step(At(1.02));  // Smoke and blood of the first moment have come to rest.
  const double drawn = Metric(*node, "frames_drawn");
  ASSERT_GE(drawn, 1);
  moment.tools.tools[0].f_W = Vec3f(0, 0, 1);
  Stamped(&moment.tools.stamp);
  bus_.tools_out->Write(moment.tools);
  node->Step(At(1.05));
  EXPECT_EQ(Metric(*node, "frames_drawn"), drawn);
  ContactModel model;
  Stamped(&model.stamp);
  model.devices[0].count = 1;
  model.devices[0].contacts[0].kind = ContactKind::kGrasp;
  model.devices[0].contacts[0].f_ref = Vec3f(0, 0, 5);
  bus_.contact_models_out->Write(model);
  node->Step(At(1.1));
  EXPECT_EQ(Metric(*node, "frames_drawn"), drawn + 1) << "the figure has changed";
}

TEST_F(RenderNodeTest, TellsHowOldTheShapeInALivePictureIs) {
  const auto node = MakeNode();
  const auto told = [&node] {
    Health health;
    node->FillHealth(&health);
    return std::count_if(health.metrics.begin(), health.metrics.end(),
                         [](const auto& metric) { return metric.name.starts_with("motion_to_picture_"); });
  };
  SyntheticMoment moment = MakeSyntheticMoment(view_, 1.0);
  moment.tissue.header.session_time_s = 0.5;
  Publish(moment);
  node->Step(At(1.0));
  EXPECT_EQ(Metric(*node, "frames_drawn"), 1);
  EXPECT_EQ(told(), 0) << "no reader of pictures";
  const auto reader = bus_.pictures.MakeInput();
  moment = MakeSyntheticMoment(view_, 1.2);
  moment.tissue.header.session_time_s = 1.1512;
  Publish(moment);
  node->Step(At(1.2));
  EXPECT_EQ(told(), 3);
  const double median_ms = Metric(*node, "motion_to_picture_p50_ms");
  EXPECT_GE(median_ms, 50 + Metric(*node, "draw_ms") - 1);
  EXPECT_LE(median_ms, 1.07 * (50 + Metric(*node, "draw_ms")) + 1) << "a bin of the histogram is 6 % wide";
}

TEST_F(RenderNodeTest, SendsEachChangeWhilePicturesAreReadAndNoneOtherwise) {
  const auto node = MakeNode();
  Publish(MakeSyntheticMoment(view_, 1.0));
  node->Step(At(1.0));
  EXPECT_EQ(Metric(*node, "pictures_sent"), 0);
  Picture picture;
  {
    const auto reader = bus_.pictures.MakeInput();
    const auto received = [&] {
      for (int i = 0; i < 500 && !reader->TakeLatest(&picture); ++i) {
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
      }
      return picture.header.stamp.sequence;
    };
    node->Step(At(1.1));
    EXPECT_EQ(received(), 1u) << "a new reader gets the present picture";
    EXPECT_EQ(picture.header.width, view_.render.width);
    EXPECT_EQ(picture.header.height, view_.render.height);
    EXPECT_EQ(picture.header.present, 3u);
    const SyntheticMoment moment = MakeSyntheticMoment(view_, 1.2);
    Publish(moment);
    node->Step(At(1.2));
    EXPECT_EQ(received(), 2u);
    EXPECT_EQ(picture.header.tip_W[1], moment.tools.tools[1].p_WT);
    EXPECT_EQ(picture.header.session_time_s, 1.2);
    node->Step(At(1.25));
    EXPECT_EQ(Metric(*node, "pictures_sent"), 2) << "nothing has changed";
  }
  Publish(MakeSyntheticMoment(view_, 1.3));
  node->Step(At(1.3));
  EXPECT_EQ(Metric(*node, "pictures_sent"), 2) << "the topic has no reader";
}

TEST_F(RenderNodeTest, HighQualityIsRefinedForAPeriodAndNoLonger) {
  const auto node = MakeNode(Quality::kHigh);
  const bool software = node->display_description().find("llvmpipe") != std::string::npos;
  const auto reader = bus_.pictures.MakeInput();
  Publish(MakeSyntheticMoment(view_, 1.0));
  for (int k = 0; k < 20; ++k) node->Step(At(1 + 0.001 * k));
  const std::uint64_t drawn = node->pictures_drawn();
  // A GPU draws many samples a pixel at once.
  EXPECT_GE(drawn, software ? static_cast<std::uint64_t>(JitterPeriod(1)) : 1);
  EXPECT_LT(drawn, 20u);
  for (int k = 0; k < 20; ++k) node->Step(At(1.05 + 0.001 * k));
  EXPECT_EQ(node->pictures_drawn(), drawn) << "nothing has changed";
}

TEST_F(RenderNodeTest, ThePictureIsThatOfTheHeldScope) {
  view_.tools[2] = view_.tools[0];
  view_.tools[2].traction_N = 1;  // An assistant.
  view_.tools[3].kind = ToolKind::kScope;
  view_.render.scope_angle_deg = 0;
  const auto node = MakeNode();
  SyntheticMoment moment = MakeSyntheticMoment(view_, 1.0);
  ToolSample& scope = moment.tools.tools[3];
  scope.kind = ToolKind::kScope;
  scope.p_WT = {0.01f, -0.05f, 0.09f};
  // Level, looking to +y and down.
  const Vec3f shaft = Vec3f(0, 0.05f, -0.07f).normalized();
  Mat3f turn;
  turn << Vec3f::UnitX(), shaft.cross(Vec3f::UnitX()), shaft;
  scope.q_WT = Quatf(turn);
  moment.tools.tools[2].kind = ToolKind::kGrasper;
  const auto reader = bus_.pictures.MakeInput();
  Picture picture;
  const auto show = [&](double time_s) {
    moment.tools.stamp.sequence += 1;
    Publish(moment);
    node->Step(At(time_s));
    for (int i = 0; i < 500 && !reader->TakeLatest(&picture); ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
  };
  show(1.0);
  EXPECT_EQ(picture.header.eye_W, scope.p_WT);
  EXPECT_LT((picture.header.forward_W - shaft).norm(), 1e-5f);
  EXPECT_LT((picture.header.right_W - Vec3f::UnitX()).norm(), 1e-5f);
  EXPECT_EQ(picture.header.present, 0b1011u) << "the assistant is not operated by hand";
  EXPECT_EQ(picture.header.scopes, 0b1000u);
  const float wide = picture.header.pixel_rad;
  scope.q_WT = Quatf(turn) * Quatf(Eigen::AngleAxisf(0.4f, Vec3f::UnitZ()));
  moment.handles.handles[3] = {.present = true, .jaw_angle_rad = 1.0472f};
  node->Press('r');  // The scope is held: keys do not turn the picture.
  show(1.1);
  EXPECT_NEAR(picture.header.right_W.dot(Vec3f::UnitX()), std::cos(0.4f), 1e-4f) << "its turn is the picture's";
  EXPECT_NEAR(picture.header.pixel_rad, wide / 2, 1e-3f * wide) << "zoomed twice";
}

TEST_F(RenderNodeTest, ATubeIrrigatesAtTheSecondSqueezeAlsoWhenNoPictureIsDrawn) {
  view_.tools[2] = view_.tools[0];
  view_.tools[2].kind = ToolKind::kSuction;
  const auto node = MakeNode();
  SyntheticMoment moment = MakeSyntheticMoment(view_, 1.0);
  ToolSample& tube = moment.tools.tools[2];
  tube.kind = ToolKind::kSuction;
  const Vec2f place = view_.membrane_material[view_.membrane.rows / 2 * view_.membrane.cols + view_.membrane.cols / 2];
  Publish(moment);
  node->Step(At(1.0));
  tube.p_WT = node->view().OnMembrane(place) + Vec3f(0, 0, 0.005f);
  tube.q_WT = Quatf(Eigen::AngleAxisf(3.14159f, Vec3f::UnitX()));  // Downwards.
  moment.tools.stamp.sequence += 1;
  Publish(moment);
  node->Step(At(1.05));
  const auto water = [&] {
    const Atlas& atlas = node->view().atlas();
    int wet = 0;
    for (std::size_t k = 3; k < atlas.film().size(); k += Atlas::kFilmBytes) wet += atlas.film()[k] > 0 ? 1 : 0;
    return wet;
  };
  // Both squeezes come between two steps.
  const auto squeeze = [&](double time_s, float jaw_rad) {
    moment.handles.handles[2] = {.present = true, .jaw_angle_rad = jaw_rad};
    Stamped(&moment.handles.stamp);
    moment.handles.stamp.stamp_ns = static_cast<std::int64_t>(1e9 * time_s);
    bus_.handles_out->Write(moment.handles);
  };
  squeeze(1.1, 0);
  squeeze(1.2, 0.7f);
  node->Step(At(1.25));
  EXPECT_EQ(water(), 0) << "one squeeze aspirates";
  squeeze(3.1, 0);
  squeeze(3.2, 0.7f);
  squeeze(3.3, 0);
  const std::uint64_t drawn = node->pictures_drawn();
  node->Step(At(3.35));
  for (int k = 1; k <= 5; ++k) node->Step(At(3.35 + 0.02 * k));
  EXPECT_GT(water(), 100);
  EXPECT_LE(node->pictures_drawn(), drawn + 1);
  EXPECT_TRUE(node->view().TubesWork());
  node->Press('p');
  squeeze(3.5, 0.7f), node->Step(At(3.55));
  EXPECT_FALSE(node->view().TubesWork()) << "let go during a pause";
}

TEST(JpegEncoder, KeepsThePictureAndTheLimit) {
  Bitmap picture{64, 48, std::vector<std::uint8_t>(3 * 64 * 48)};
  // Red above, blue beneath; the first row is the bottom one.
  for (std::size_t i = 0; i < picture.rgb.size(); i += 3) picture.rgb[i + (i < picture.rgb.size() / 2 ? 2 : 0)] = 250;
  JpegEncoder encoder;
  const std::span<const std::uint8_t> file = encoder.Encode(picture, 4096);
  std::vector<std::uint8_t> top_first(picture.rgb.size());
  tjhandle reader = tjInitDecompress();
  ASSERT_EQ(tjDecompress2(reader, file.data(), file.size(), top_first.data(), 64, 0, 48, TJPF_RGB, 0), 0);
  tjDestroy(reader);
  EXPECT_GT(top_first[0], 200);
  EXPECT_LT(top_first[2], 50);
  EXPECT_LT(top_first[top_first.size() - 3], 50);
  EXPECT_GT(top_first[top_first.size() - 1], 200);

  std::uint32_t noise = 1;
  for (std::uint8_t& value : picture.rgb)
    value = static_cast<std::uint8_t>((noise = noise * 1664525u + 1013904223u) >> 24);
  const std::size_t full = encoder.Encode(picture, 1 << 20).size();
  EXPECT_LE(encoder.Encode(picture, full - 1).size(), full - 1) << "more detail than fits is compressed more";
  EXPECT_THROW((void)encoder.Encode(picture, 10), std::runtime_error);
}

TEST_F(RenderNodeTest, FinishWritesTheLastStateOfTheSession) {
  {
    const auto node = MakeNode();
    Publish(MakeSyntheticMoment(view_, 1.0));
    node->Step(At(1.0));
    Publish(MakeSyntheticMoment(view_, 1.2));
    node->Step(At(1.2));
    node->Finish();
  }
  EXPECT_TRUE(std::filesystem::exists(folder_ / "frame_0001200.png"));
}

TEST_F(RenderNodeTest, DropsTheTissueOfAnotherSceneAndSaysSo) {
  const auto node = MakeNode();
  SyntheticMoment moment = MakeSyntheticMoment(view_, 1.0);
  moment.tissue.header.scene_hash = 78;
  Publish(moment);
  node->Step(At(1.0));
  EXPECT_EQ(Metric(*node, "frames_drawn"), 0);
  Health health;
  node->FillHealth(&health);
  EXPECT_NE(health.last_error.find("another scene"), std::string::npos);
}

TEST_F(RenderNodeTest, ANewNodeShowsTheCutAfterOneTissueFrameAndOneTopology) {
  SyntheticMoment moment = MakeSyntheticMoment(view_, 4.8);
  moment.patches.clear();  // Lost with the previous node.
  Publish(moment);
  {
    const auto node = MakeNode();
    node->Step(At(4.8));
    EXPECT_EQ(Metric(*node, "frames_drawn"), 1);
  }
  const Bitmap with_cut = ReadPng(folder_ / "frame_0004800.png");
  std::fill(moment.topology.dead_edges.begin(), moment.topology.dead_edges.end(), std::uint8_t{0});
  moment.topology.revision += 1;
  Publish(moment);
  {
    const auto node = MakeNode();
    node->Step(At(4.9));
  }
  EXPECT_NE(with_cut.rgb, ReadPng(folder_ / "frame_0004900.png").rgb);
}

TEST_F(RenderNodeTest, TissueAtRestMayBeSilentForAsLongAsItSaid) {
  const auto node = MakeNode();
  SyntheticMoment moment = MakeSyntheticMoment(view_, 1.0);
  moment.tissue.header.next_within_s = 2;
  Publish(moment);
  const auto step = [&](double time_s) {  // Poses and jaw angles arrive.
    Stamped(&moment.tools.stamp);
    Stamped(&moment.handles.stamp);
    bus_.tools_out->Write(moment.tools);
    bus_.handles_out->Write(moment.handles);
    node->Step(At(time_s));
  };
  step(1.0);
  step(2.0);
  const double drawn = Metric(*node, "frames_drawn");
  step(3.2);
  EXPECT_EQ(Metric(*node, "frames_drawn"), drawn) << "nothing has changed";
  step(3.9);
  EXPECT_EQ(Metric(*node, "frames_drawn"), drawn + 1) << "the picture shows that tissue is late";
}

TEST_F(RenderNodeTest, SaysThatTheTissueIsSlow) {
  const auto node = MakeNode();
  SyntheticMoment moment = MakeSyntheticMoment(view_, 1.0);
  const auto frame = [&](double session_s, double simulated_s) {
    moment.tissue.header.session_time_s = session_s;
    moment.tissue.header.simulated_time_s = simulated_s;
    Publish(moment);
    node->Step(At(session_s));
    return Metric(*node, "frames_drawn");
  };
  (void)frame(1.0, 1.0);
  const double drawn = frame(2.0, 2.0);
  EXPECT_EQ(frame(2.6, 2.6), drawn) << "in real time: nothing to say";
  EXPECT_EQ(frame(3.2, 3.0), drawn + 1) << "TISSUE AT 90 % SPEED";
  EXPECT_EQ(frame(5.5, 5.3), drawn + 2) << "the notice is removed";
}

TEST_F(RenderNodeTest, HoldsTissueThatIsLateAndSaysSo) {
  {
    const auto node = MakeNode();
    SyntheticMoment moment = MakeSyntheticMoment(view_, 1.0);
    Publish(moment);
    node->Step(At(1.0));
    node->Step(At(1.5));
    EXPECT_EQ(Metric(*node, "frames_drawn"), 2) << "the picture shows that tissue is late";
    node->Step(At(2.1));
    EXPECT_EQ(Metric(*node, "frames_drawn"), 2) << "it is drawn once";
    Publish(moment);
    node->Step(At(2.6));
    EXPECT_EQ(Metric(*node, "frames_drawn"), 3) << "the notice is removed";
  }
  const Bitmap held = ReadPng(folder_ / "frame_0001500.png");
  const auto red_text = [](const Bitmap& picture) {
    int count = 0;
    for (std::size_t k = 0; k < picture.rgb.size(); k += 3) {
      count += picture.rgb[k] > 250 && picture.rgb[k + 2] < 60 ? 1 : 0;
    }
    return count;
  };
  EXPECT_GT(red_text(held), 50);
  EXPECT_EQ(red_text(ReadPng(folder_ / "frame_0002600.png")), 0);
}

TEST_F(RenderNodeTest, PatchesReachThePicture) {
  const auto node = MakeNode();
  const SyntheticMoment moment = MakeSyntheticMoment(view_, 4.8);
  ASSERT_FALSE(moment.patches.empty());
  Publish(moment);
  node->Step(At(4.8));
  EXPECT_GE(Metric(*node, "patches"), 1);
}

TEST_F(RenderNodeTest, KeysDoWhatTheHelpSays) {
  const auto node = MakeNode();
  Publish(MakeSyntheticMoment(view_, 4.0));
  int ms = 4000;
  const auto shot = [&](std::initializer_list<int> keys) {
    for (const int key : keys) {
      node->Press(key);
    }
    node->Press('s');
    ms += 5;
    node->Step(At(0.001 * ms));
    const std::filesystem::path file = folder_ / ("frame_000" + std::to_string(ms) + ".png");
    for (int wait = 0; wait < 1000 && !std::filesystem::exists(file); ++wait) {
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    std::ifstream in(file, std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(in), {});
  };
  const std::string with_figures = shot({});
  const std::string plain = shot({'u'});
  ASSERT_FALSE(plain.empty());
  EXPECT_NE(with_figures, plain);
  EXPECT_EQ(shot({}), plain) << "nothing pressed, nothing changed";
  EXPECT_EQ(shot({'x'}), plain) << "a key without a function";
  for (const int key : {osgGA::GUIEventAdapter::KEY_Left, osgGA::GUIEventAdapter::KEY_Right,
                        osgGA::GUIEventAdapter::KEY_Up, osgGA::GUIEventAdapter::KEY_Down}) {
    EXPECT_NE(shot({key}), plain) << key;
    EXPECT_EQ(shot({'0'}), plain);
  }
  for (const int key : {'+', '-', 'r', 't'}) {
    EXPECT_NE(shot({key}), plain) << static_cast<char>(key);
    EXPECT_EQ(shot({'0'}), plain);
  }
  EXPECT_NE(shot({'h'}), plain);
  EXPECT_EQ(shot({'h'}), plain);
  EXPECT_NE(shot({'l'}), plain) << "the view turns to the first tool";
  EXPECT_EQ(shot({'l', 'l', '0'}), plain);
  // During a pause new states are not shown; afterwards they are.
  const std::string paused = shot({'p'});
  std::set<std::pair<std::uint32_t, std::uint32_t>> places;
  const auto publish = [&](const SyntheticMoment& moment) {
    for (const TemperaturePatch& patch : moment.patches) places.emplace(patch.header.origin_x, patch.header.origin_y);
    Publish(moment);
  };
  publish(MakeSyntheticMoment(view_, 4.6));
  EXPECT_EQ(shot({}), paused);
  // More patches than the port holds: the newest of each place is shown after the pause.
  SyntheticMoment later = MakeSyntheticMoment(view_, 4.8);
  ASSERT_FALSE(later.patches.empty());
  later.patches.resize(1);
  for (int i = 0; i < 40; ++i) {
    publish(later);
    if (i == 0) later.patches[0].header.origin_x += 8;
    EXPECT_EQ(shot({}), paused);
  }
  const double applied = Metric(*node, "patches");
  EXPECT_NE(shot({'p'}), plain);
  EXPECT_EQ(Metric(*node, "patches"), applied + static_cast<double>(places.size()));
}

}  // namespace
}  // namespace fulcrum::render
