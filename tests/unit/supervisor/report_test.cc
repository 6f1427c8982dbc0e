// Summary, table, pictures, video and report from the data of a session.
#include "services/session/supervisor/report.h"

#include <gtest/gtest.h>
#include <png.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "services/session/supervisor/outcome.h"
#include "services/session/supervisor/picture.h"
#include "services/session/supervisor/progress.h"
#include "services/session/supervisor/script_outlook.h"
#include "services/session/supervisor/session_record.h"
#include "services/session/supervisor/svg_plot.h"
#include "services/session/supervisor/video.h"
#include "tests/unit/supervisor/temporary_folder.h"

namespace fulcrum::supervisor {
namespace {

namespace fs = std::filesystem;

// ------------------------------------------------------------------------------------------------ session record

Health PhysicsHealth(std::uint64_t epoch, std::uint64_t ticks, double displacement) {
  Health health;
  health.stamp.epoch = epoch;
  health.node = NodeId::kPhysics;
  health.state = HealthState::kRunning;
  health.ticks = ticks;
  health.overruns = 1;
  health.rate_asked_Hz = 100;
  health.step = {1000, 2000, 5000};
  health.inputs = {{TopicId::kToolState, true, 1, 100, 2, 3}};
  health.metrics = {{"max_displacement_mm", displacement}};
  return health;
}

TEST(SessionRecordTest, CountersAddUpOverARestartAndPeaksStay) {
  SessionRecord record;
  record.AddHealth(0, PhysicsHealth(1, 0, 1));
  record.AddHealth(5, PhysicsHealth(1, 500, 9));
  record.AddDeath(5.1, NodeId::kPhysics, "killed by signal 9 (Killed)", false);
  record.AddHealth(5.5, PhysicsHealth(2, 10, 4));
  record.AddHealth(10, PhysicsHealth(2, 460, 5));
  const NodeFigures& node = record.node(NodeId::kPhysics);
  EXPECT_EQ(node.ticks, 960u);
  EXPECT_EQ(node.overruns, 2u);
  EXPECT_EQ(node.drops, 10u);
  EXPECT_EQ(node.restarts, 1);
  EXPECT_DOUBLE_EQ(node.rate_achieved_Hz, 96.0);
  EXPECT_NEAR(node.longest_rejoin_s, 0.4, 1e-12);
  EXPECT_EQ(record.peak("max_displacement_mm"), 9);
  ASSERT_EQ(record.restarts().size(), 1u);
  EXPECT_NEAR(record.restarts()[0].rejoin_s, 0.4, 1e-12);
}

TEST(SessionRecordTest, LateSampleOfTheDeadProcessIsIgnored) {
  SessionRecord record;
  record.AddHealth(1, PhysicsHealth(2, 100, 1));
  record.AddHealth(2, PhysicsHealth(1, 900, 1));
  EXPECT_EQ(record.node(NodeId::kPhysics).ticks, 100u);
}

TEST(SessionRecordTest, CurveStaysBoundedAndKeepsItsPeak) {
  Curve curve;
  for (int i = 0; i < 100'000; ++i) {
    curve.Add(0.1 * i, i == 77'777 ? 50.0 : 1.0);
  }
  curve.Add(1e4, std::numeric_limits<double>::quiet_NaN());
  EXPECT_LT(curve.points().size(), Curve::kMostPoints);
  EXPECT_GT(curve.points().size(), Curve::kMostPoints / 4);
  EXPECT_EQ(curve.max(), 50.0);
  EXPECT_TRUE(std::is_sorted(curve.points().begin(), curve.points().end(),
                             [](const CurvePoint& a, const CurvePoint& b) { return a.time_s < b.time_s; }));
}

TEST(SessionRecordTest, MissingNamesWhatTheScriptAskedFor) {
  SessionRecord record;
  EXPECT_EQ(MissingFrom(record, {}), "");
  EXPECT_NE(MissingFrom(record, {.deformation = true}).find("nothing was deformed"), std::string::npos);
  record.AddHealth(1, PhysicsHealth(1, 1, 3.0));
  EXPECT_EQ(MissingFrom(record, {.deformation = true}), "");
  EXPECT_NE(MissingFrom(record, {.deformation = true, .cut = true}).find("nothing was cut"), std::string::npos);
}

TEST(SessionRecordTest, ABurntOrganIsAnEffectAndAFigureOfItsName) {
  SessionRecord record;
  ThermalEvent event;
  event.kind = ThermalEventKind::kSolidBurn;
  for (const auto& [solid, m2] : {std::pair<std::uint8_t, float>{1, 4e-6f}, {1, 12.5e-6f}, {1, 9e-6f}, {7, 2e-6f}}) {
    event.solid = solid;
    event.value = m2;
    record.AddEvent(event);
  }
  EXPECT_EQ(MissingFrom(record, {.cut = true}), "");
  EXPECT_EQ(MissingFrom(record, {.deformation = true}), "");
  EXPECT_NE(MissingFrom(record, {.deformation = true, .grasp = true}), "");
  SessionRecord both = record;
  event.kind = ThermalEventKind::kContact;
  both.AddEvent(event);
  EXPECT_NE(MissingFrom(both, {.cut = true}), "") << "the hook had current in the membrane as well";
  // Coagulated the membrane at 2 s, cut an organ's bed from 5 s on.
  SessionRecord coagulated = record;
  event.session_time_s = 2;
  coagulated.AddEvent(event);
  EXPECT_EQ(MissingFrom(coagulated, {.cut = true, .cutting = {{5, 9}}}), "");
  event.session_time_s = 6;
  coagulated.AddEvent(event);
  EXPECT_NE(MissingFrom(coagulated, {.cut = true, .cutting = {{5, 9}}}), "") << "the hook slipped onto the membrane";
  SessionOutcome outcome;
  outcome.solids = {"organ", "cystic duct"};
  const std::vector<KeyFigure> figures = KeyFigures(outcome, record);
  ASSERT_EQ(figures.size(), 2u);
  EXPECT_EQ(figures[0].key, "burnt.cystic_duct_mm2");
  EXPECT_EQ(figures[0].label, "burnt surface of cystic duct");
  EXPECT_NEAR(figures[0].value, 12.5, 1e-4);
  EXPECT_EQ(figures[1].key, "burnt.solid_7_mm2");  // Of no solid that the scene names.
}

// ------------------------------------------------------------------------------------------------ script outlook

class ScriptTest : public ::testing::Test {
 protected:
  ScriptTest() {
    scene_.tools[0].kind = ToolKind::kGrasper;
    scene_.tools[1].kind = ToolKind::kHook;
    scene_.script = keys_;
    scene_.membrane.rows = scene_.membrane.cols = 2;
  }
  static constexpr float kOpen = 0.8f, kClosed = 0.0f;
  const std::vector<ScriptKey> keys_{
      {0, 0, Vec3f(0, 0, 0.1f), kOpen, 0, 0},     {2, 0, Vec3f(0, 0, 0), kOpen, 0, 0},
      {3, 0, Vec3f(0, 0, 0), kClosed, 0, 0},      {6, 0, Vec3f(0, 0, 0.03f), kClosed, 0, 0},
      {12, 0, Vec3f(0, 0, 0.03f), kClosed, 0, 0}, {13, 0, Vec3f(0, 0, 0.03f), kOpen, 0, 0},
      {8, 1, Vec3f(0, 0, 0), 0, kPedalCut, 35},   {11, 1, Vec3f(0.02f, 0, 0), 0, 0, 0}};
  SceneView scene_;
};

TEST_F(ScriptTest, PhaseFollowsTheTools) {
  EXPECT_EQ(PhaseAt(scene_, 0.5), "approach");
  EXPECT_EQ(PhaseAt(scene_, 2.2), "grasp");
  EXPECT_EQ(PhaseAt(scene_, 4.5), "pull");
  EXPECT_EQ(PhaseAt(scene_, 7.0), "hold");
  EXPECT_EQ(PhaseAt(scene_, 9.0), "cut");
  EXPECT_EQ(PhaseAt(scene_, 11.5), "hold");
  EXPECT_EQ(PhaseAt(scene_, 14.0), "release");
  EXPECT_EQ(PhaseAt(SceneView{}, 1.0), "");
}

TEST_F(ScriptTest, DemandsGrowWithTheTimeGiven) {
  EXPECT_FALSE(DemandsUntil(scene_, 3.5).deformation);
  EXPECT_TRUE(DemandsUntil(scene_, 6.0).deformation);
  EXPECT_FALSE(DemandsUntil(scene_, 9.0).cut);
  EXPECT_TRUE(DemandsUntil(scene_, 20.0).cut);
  EXPECT_TRUE(DemandsUntil(scene_, 20.0).grasp);
  SceneView without_sheet = scene_;
  without_sheet.membrane = {};
  EXPECT_FALSE(DemandsUntil(without_sheet, 20.0).cut);
  EXPECT_FALSE(DemandsUntil(SceneView{}, 20.0).deformation);
  std::vector<ScriptKey> coag(scene_.script.begin(), scene_.script.end());
  for (ScriptKey& key : coag) key.pedals = key.pedals == kPedalNone ? kPedalNone : kPedalCoag;
  SceneView only_coag = scene_;
  only_coag.script = coag;
  EXPECT_FALSE(DemandsUntil(only_coag, 20.0).cut);
  EXPECT_TRUE(DemandsUntil(only_coag, 20.0).deformation);
  const ScriptDemands all = DemandsUntil(scene_, 20.0);
  ASSERT_EQ(all.cutting.size(), 1u);
  EXPECT_EQ(all.cutting[0].begin_s, 8);
  EXPECT_EQ(all.cutting[0].end_s, 11);
  SceneView without_hook = scene_;
  without_hook.tools[1].kind = ToolKind::kGrasper;
  EXPECT_FALSE(DemandsUntil(without_hook, 20.0).cut) << "only the hook has current";
}

// -------------------------------------------------------------------------------------------------- presentation

TEST(OutcomeTest, SummaryIsFlatJsonWithTextEscaped) {
  SessionOutcome outcome;
  outcome.scene_name = "a \"b\"\n\\";
  outcome.nodes = {NodeId::kPhysics};
  SessionRecord record;
  record.AddHealth(1, PhysicsHealth(1, 1, 3.25));
  const std::string json = SummaryJson(outcome, record);
  EXPECT_NE(json.find(R"("scene": "a \"b\"\u000a\\")"), std::string::npos) << json;
  EXPECT_NE(json.find("\"max_displacement_mm\": 3.25"), std::string::npos) << json;
  EXPECT_NE(json.find("\"physics_node.step_p99_ms\": 2"), std::string::npos) << json;
  // Without heat no temperature is reported.
  EXPECT_EQ(json.find("highest_temperature_C"), std::string::npos) << json;
  EXPECT_EQ(std::count(json.begin(), json.end(), '{'), 1);
}

TEST(OutcomeTest, TableShowsEachNodeAndTheVerdict) {
  SessionOutcome outcome;
  outcome.nodes = {NodeId::kPhysics, NodeId::kRender};
  outcome.faults = {{4.5, "nothing was cut"}, {5, "the recorder lost samples"}};
  SessionRecord record;
  record.AddHealth(1, PhysicsHealth(1, 1, 3.25));
  const std::string table = FinalTable(outcome, record);
  EXPECT_NE(table.find("physics_node"), std::string::npos);
  EXPECT_NE(table.find("1.00 / 2.00 / 5.00"), std::string::npos) << table;
  EXPECT_NE(table.find("silent"), std::string::npos) << table;
  EXPECT_NE(table.find("fault at 4.5 s: nothing was cut\n"), std::string::npos) << table;
  EXPECT_NE(table.find("NOT WELL: nothing was cut; the recorder lost samples\n"), std::string::npos) << table;
}

TEST(OutcomeTest, FixedHasNoNegativeZero) {
  EXPECT_EQ(Fixed(-0.001, 1), "0.0");
  EXPECT_EQ(Fixed(-0.16, 1), "-0.2");
}

TEST(ProgressTest, CutsAtCharactersNotBytes) {
  EXPECT_EQ(CutToColumns("37 °C · x", 4), "37 °");
  EXPECT_EQ(CutToColumns("abc", 10), "abc");
}

TEST(SvgPlotTest, NiceStepIsOneTwoOrFive) {
  EXPECT_DOUBLE_EQ(NiceStep(10, 5), 2);
  EXPECT_DOUBLE_EQ(NiceStep(20, 8), 5);
  EXPECT_DOUBLE_EQ(NiceStep(3.3, 5), 1);
  EXPECT_DOUBLE_EQ(NiceStep(0.07, 5), 0.02);
}

TEST(SvgPlotTest, PlotOfNothingIsEmptyAndMarksAreDrawn) {
  Curve curve;
  EXPECT_EQ(SvgPlot({.title = "Force", .unit = "N", .end_s = 20, .marks_s = {}}, {{"a", "red", &curve}}), "");
  curve.Add(1, 2.5);
  curve.Add(2, 1.5);
  const std::string svg =
      SvgPlot({.title = "Force", .unit = "N", .end_s = 20, .marks_s = {1.5}}, {{"a", "red", &curve}});
  EXPECT_NE(svg.find("polyline"), std::string::npos);
  EXPECT_NE(svg.find("class='mark'"), std::string::npos);
}

TEST(PictureTest, Base64MatchesTheStandardsExamples) {
  const auto encode = [](std::string_view text) {
    return Base64(std::span(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()));
  };
  // RFC 4648, section 10.
  EXPECT_EQ(encode(""), "");
  EXPECT_EQ(encode("f"), "Zg==");
  EXPECT_EQ(encode("fo"), "Zm8=");
  EXPECT_EQ(encode("foo"), "Zm9v");
  EXPECT_EQ(encode("foob"), "Zm9vYg==");
  EXPECT_EQ(encode("fooba"), "Zm9vYmE=");
  EXPECT_EQ(encode("foobar"), "Zm9vYmFy");
}

void WritePng(const fs::path& file, unsigned width, unsigned height) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = width;
  image.height = height;
  image.format = PNG_FORMAT_RGB;
  const std::vector<std::uint8_t> pixels(std::size_t{3} * width * height, 100);
  ASSERT_NE(png_image_write_to_file(&image, file.c_str(), 0, pixels.data(), 0, nullptr), 0);
}

TEST(PictureTest, FramesAreFoundByTimeAndStrangersLeft) {
  const TemporaryFolder folder;
  for (const char* name :
       {"frame_0012500.png", "frame_0000500.png", "frame_x.png", "frame_.png", "other.png", "frame_0000700.png.part"}) {
    std::ofstream(folder.path() / name) << "x";
  }
  const std::vector<Frame> frames = FindFrames(folder.path());
  ASSERT_EQ(frames.size(), 2u);
  EXPECT_DOUBLE_EQ(frames[0].time_s, 0.5);
  EXPECT_DOUBLE_EQ(frames[1].time_s, 12.5);
  EXPECT_TRUE(FindFrames(folder.path() / "missing").empty());
}

TEST(PictureTest, SpreadTakesFirstLastAndEvenTimesOnceEach) {
  std::vector<Frame> frames;
  for (int i = 0; i <= 40; ++i) {
    if (i < 10 || i > 20) frames.push_back({"", 0.5 * i});  // A gap, as while the renderer did not run.
  }
  const std::vector<Frame> chosen = Spread(frames, 9);
  ASSERT_EQ(chosen.size(), 9u);
  EXPECT_EQ(chosen.front().time_s, 0);
  EXPECT_EQ(chosen.back().time_s, 20);
  for (std::size_t i = 1; i < chosen.size(); ++i) {
    EXPECT_LT(chosen[i - 1].time_s, chosen[i].time_s);
  }
  EXPECT_EQ(Spread({frames.begin(), frames.begin() + 3}, 9).size(), 3u);
}

TEST(PictureTest, EmbedsAndShrinks) {
  const TemporaryFolder folder;
  WritePng(folder.path() / "frame_0000000.png", 64, 32);
  const std::string full = EmbedPng(folder.path() / "frame_0000000.png", 1);
  EXPECT_TRUE(full.starts_with("data:image/png;base64,iVBOR"));
  EXPECT_FALSE(EmbedPng(folder.path() / "frame_0000000.png", 2).empty());
  EXPECT_TRUE(EmbedPng(folder.path() / "frame_0000000.png", 64).empty());
  std::ofstream(folder.path() / "bad.png") << "not a picture";
  EXPECT_TRUE(EmbedPng(folder.path() / "bad.png", 1).empty());
}

class VideoTest : public ::testing::Test {
 protected:
  /// A substitute for `replayer`.
  void Replayer(const std::string& body) {
    std::ofstream(order_.replayer) << "#!/bin/sh\n" << body << '\n';
    fs::permissions(order_.replayer, fs::perms::owner_all);
  }
  [[nodiscard]] SessionVideo Make(bool goes_on = true) const {
    return MakeVideo(order_, [goes_on] { return goes_on; });
  }

  const TemporaryFolder folder_;
  const VideoOrder order_{.replayer = folder_.path() / "replayer",
                          .recording = folder_.path() / "recording.mcap",
                          .scene = folder_.path() / "scene.fulcrum",
                          .video = folder_.path() / "video.mp4",
                          .log = folder_.path() / "video.log"};
};

TEST_F(VideoTest, HasItsChapters) {
  Replayer(
      R"(echo "$@"; echo '{"chapters": [{"begin_s": 0, "title": "start"}, {"begin_s": 72.5, "title": "cut at 35 W"}]}' > )" +
      (folder_.path() / "video.json").string());
  const SessionVideo video = Make();
  EXPECT_EQ(video.file, order_.video);
  EXPECT_EQ(video.missing, "");
  EXPECT_EQ(video.chapters, (std::vector<std::string>{"0:00 start", "1:12 cut at 35 W"}));
  EXPECT_EQ(video.subtitles, "WEBVTT\n\n00:01:12.500 --> 00:01:15.500\ncut at 35 W\n");
  std::ifstream in(order_.log);
  std::string words;
  std::getline(in, words);
  EXPECT_TRUE(words.starts_with(order_.recording.string() + " --video " + order_.video.string())) << words;
}

TEST_F(VideoTest, SaysWhyThereIsNone) {
  EXPECT_NE(Make().missing.find("cannot start"), std::string::npos);
  Replayer("echo 'replayer: ffmpeg is not installed'; exit 2");
  EXPECT_EQ(Make().missing, "ffmpeg is not installed");
  EXPECT_TRUE(Make().file.empty());
  fs::remove(order_.log);
  Replayer("kill -9 $$");
  EXPECT_NE(Make().missing.find("killed by signal 9"), std::string::npos);
  Replayer("sleep 60");
  EXPECT_EQ(Make(false).missing, "it was left out");
  Replayer("echo nonsense: [ > " + (folder_.path() / "video.json").string());
  EXPECT_EQ(Make().file, order_.video) << "a video without its chapters";
}

TEST(ReportTest, HoldsEverythingAndNothingFromElsewhere) {
  const TemporaryFolder folder;
  WritePng(folder.path() / "frame_0001000.png", 64, 32);
  SessionOutcome outcome;
  outcome.scene_name = "<tiny>";
  outcome.nodes = {NodeId::kPhysics};
  outcome.duration_s = 10;
  outcome.configuration = "a: <b>\n";
  outcome.exit_code = ExitCode::kFailure;
  outcome.faults = {{3.5, "a fault & its cause"}};
  SessionRecord record;
  Health health = PhysicsHealth(1, 1, 3.25);
  health.metrics.push_back({"displacement_mm", 2});
  health.metrics.push_back({"force0_N", 1});
  health.metrics.push_back({"force1_N", 2});
  record.AddHealth(1, health);
  record.AddDeath(5.1, NodeId::kPhysics, "killed by signal 9 (Killed)", false);
  ThermalEvent event;
  event.kind = ThermalEventKind::kCut;
  record.AddEvent(event);
  std::ofstream(folder.path() / "video.mp4") << "a clip";
  outcome.recording = folder.path() / "recording.mcap";
  outcome.video = {.file = folder.path() / "video.mp4", .chapters = {"0:03 cut at 35 W"}, .subtitles = "WEBVTT\n"};
  const std::string html = ReportHtml(outcome, record, folder.path());
  for (const char* part :
       {"&lt;tiny&gt;", "physics_node", "data:image/png;base64,", "data:video/mp4;base64,YSBjbGlw", "<svg",
        "class='mark'", "killed by signal 9", "cut × 1", "✗ a fault &amp; its cause", "<td>3.5 s</td>", "a: &lt;b&gt;",
        ">tool 1<", ">tool 2<", "0:03 cut at 35 W", "data:text/vtt;base64,"}) {
    EXPECT_NE(html.find(part), std::string::npos) << part;
  }
  for (const char* outside : {"http://", "https://", "src='/", "<script", "<link"}) {
    EXPECT_EQ(html.find(outside), std::string::npos) << outside;
  }
}

TEST(ReportTest, HasItsVideoOrSaysWhyNotAlsoWithoutPictures) {
  const TemporaryFolder folder;
  SessionOutcome outcome;
  outcome.recording = "/elsewhere/it's.mcap";
  outcome.video = {.command = "fulcrum log video 'x'", .missing = "ffmpeg <is> not installed"};
  std::string html = ReportHtml(outcome, {}, folder.path() / "no frames");
  EXPECT_NE(html.find("ffmpeg &lt;is&gt; not installed. Draw it with: fulcrum log video"), std::string::npos);
  std::ofstream(folder.path() / "video.mp4") << "a clip";
  outcome.video = {.file = folder.path() / "video.mp4", .is_part = true};
  html = ReportHtml(outcome, {}, folder.path() / "no frames");
  EXPECT_NE(html.find("data:video/mp4;base64,"), std::string::npos);
  EXPECT_NE(html.find("The recorder was restarted"), std::string::npos);
  fs::resize_file(folder.path() / "video.mp4", 40'000'000);
  html = ReportHtml(outcome, {}, folder.path() / "no frames");
  EXPECT_NE(html.find("src='video.mp4'"), std::string::npos) << "too large to embed";
}

}  // namespace
}  // namespace fulcrum::supervisor
