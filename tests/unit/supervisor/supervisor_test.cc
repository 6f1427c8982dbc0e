#include <gtest/gtest.h>
#include <png.h>
#include <signal.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <thread>

#include "services/base/core/error.h"
#include "services/session/supervisor/attached_node.h"
#include "services/session/supervisor/child_process.h"
#include "services/session/supervisor/clip.h"
#include "services/session/supervisor/outcome.h"
#include "services/session/supervisor/picture.h"
#include "services/session/supervisor/progress.h"
#include "services/session/supervisor/report.h"
#include "services/session/supervisor/restart_policy.h"
#include "services/session/supervisor/scene_cache.h"
#include "services/session/supervisor/script_outlook.h"
#include "services/session/supervisor/session_record.h"
#include "services/session/supervisor/svg_plot.h"

namespace fulcrum::supervisor {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kMs = 1'000'000;

class Folder {
 public:
  Folder() {
    std::string name = (fs::temp_directory_path() / "fulcrum_supervisor_unit_XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) throw std::runtime_error("no temporary folder");
    path_ = name;
  }
  ~Folder() { fs::remove_all(path_); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  [[nodiscard]] const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

// ------------------------------------------------------------------------------------------------- attached node

/// A node that somebody else runs: here a process that only sleeps.
class AttachedNodeTest : public ::testing::Test {
 protected:
  AttachedNodeTest() : node_(Command(), folder_.path() / "nodes", [this](NodeId, const char* verb) { order_ = verb; }) {
    node_.Start(kStart);
  }
  static NodeCommand Command() {
    NodeCommand command;
    command.id = NodeId::kPhysics;
    command.arguments = {"--scene", "/run/scene.fulcrum"};
    return command;
  }
  ChildProcess Sleeper() const { return ChildProcess::Start("/bin/sleep", {"600"}, folder_.path() / "log"); }
  bool Report(pid_t pid, HealthState state = HealthState::kRunning) {
    Health health;
    health.node = NodeId::kPhysics;
    health.pid = pid;
    health.state = state;
    return node_.OnHealth(health, kStart);
  }
  static void Kill(ChildProcess* process) {
    process->Signal(SIGKILL);
    while (!process->Poll()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }

  static constexpr std::int64_t kStart = 1'000'000'000'000;
  Folder folder_;
  std::string order_;
  AttachedNode node_;
};

TEST_F(AttachedNodeTest, WritesWhatItsServiceIsGiven) {
  std::ifstream file(folder_.path() / "nodes" / "physics_node");
  std::string line;
  std::getline(file, line);
  EXPECT_EQ(line, "FULCRUM_ARGUMENTS=\"--scene /run/scene.fulcrum\"");
  EXPECT_THROW((void)AttachedNode::ArgumentsFile({"--file", "/my recordings/a.mcap"}), InputError);
  EXPECT_THROW((void)AttachedNode::ArgumentsFile({"$HOME"}), InputError);
  node_.Stop();
  EXPECT_FALSE(fs::exists(folder_.path() / "nodes" / "physics_node")) << "it would be started after the session";
}

TEST_F(AttachedNodeTest, NoticesADeathAndTheReturn) {
  ChildProcess first = Sleeper(), other = Sleeper();
  EXPECT_TRUE(Report(first.pid()));
  EXPECT_FALSE(Report(other.pid())) << "the first one lives";
  EXPECT_FALSE(node_.Update(kStart).has_value());
  const pid_t dead = first.pid();
  Kill(&first);
  EXPECT_FALSE(node_.Update(kStart).has_value()) << "it may have said that it ends";
  const auto death = node_.Update(kStart + 300 * kMs);
  ASSERT_TRUE(death.has_value());
  EXPECT_FALSE(death->for_good);
  EXPECT_FALSE(death->asked);
  EXPECT_EQ(death->at_ns, kStart);
  EXPECT_FALSE(node_.running());
  EXPECT_FALSE(Report(dead)) << "a late sample of the dead one";
  EXPECT_FALSE(node_.Update(kStart + 400 * kMs).has_value()) << "told once";
  EXPECT_TRUE(Report(other.pid()));
  EXPECT_TRUE(node_.running());
}

TEST_F(AttachedNodeTest, DoesNotWaitForLastWordsWhenTheNextOneSpeaks) {
  ChildProcess first = Sleeper(), second = Sleeper();
  ASSERT_TRUE(Report(first.pid()));
  Kill(&first);
  EXPECT_FALSE(node_.Update(kStart).has_value());
  EXPECT_FALSE(Report(second.pid())) << "the death is told first";
  EXPECT_TRUE(node_.Update(kStart).has_value());
  EXPECT_TRUE(Report(second.pid()));
}

TEST_F(AttachedNodeTest, LastWordsMayComeAfterTheEnd) {
  ChildProcess first = Sleeper();
  ASSERT_TRUE(Report(first.pid()));
  const pid_t dead = first.pid();
  Kill(&first);
  EXPECT_FALSE(node_.Update(kStart).has_value());
  EXPECT_TRUE(Report(dead, HealthState::kStopping));
  EXPECT_FALSE(node_.Update(kStart + 300 * kMs).has_value()) << "it was stopped, it did not die";
}

TEST_F(AttachedNodeTest, OneThatWasStoppedIsReportedWhenItIsBack) {
  ChildProcess first = Sleeper(), second = Sleeper();
  node_.AskRestart(kStart);
  EXPECT_EQ(order_, "restart");
  ASSERT_TRUE(Report(first.pid()));
  ASSERT_TRUE(Report(first.pid(), HealthState::kStopping));
  Kill(&first);
  EXPECT_FALSE(node_.Update(kStart).has_value());
  ASSERT_TRUE(Report(second.pid()));
  const auto death = node_.Update(kStart + kMs);
  ASSERT_TRUE(death.has_value());
  EXPECT_TRUE(death->asked);
  EXPECT_EQ(death->at_ns, kStart) << "how long it took to come back counts from its end";
}

TEST_F(AttachedNodeTest, HasFailedForGoodWhenItStaysAway) {
  EXPECT_FALSE(node_.Update(kStart + 59'000 * kMs).has_value());
  const auto death = node_.Update(kStart + 61'000 * kMs);
  ASSERT_TRUE(death.has_value());
  EXPECT_TRUE(death->for_good);
  EXPECT_TRUE(node_.failed());
}

// ------------------------------------------------------------------------------------------------ restart policy

TEST(RestartPolicyTest, FirstDeathIsRestartedAtOnce) {
  RestartPolicy policy;
  EXPECT_EQ(policy.OnDeath(10 * kMs), 0);
}

TEST(RestartPolicyTest, CrashLoopBacksOffAndThenGivesUp) {
  RestartPolicy policy(
      {.healthy_ns = 1000 * kMs, .first_delay_ns = 100 * kMs, .longest_delay_ns = 250 * kMs, .most_quick_deaths = 6});
  EXPECT_EQ(policy.OnDeath(kMs), 0);
  EXPECT_EQ(policy.OnDeath(kMs), 100 * kMs);
  EXPECT_EQ(policy.OnDeath(kMs), 200 * kMs);
  EXPECT_EQ(policy.OnDeath(kMs), 250 * kMs);
  EXPECT_EQ(policy.OnDeath(kMs), 250 * kMs);
  EXPECT_EQ(policy.OnDeath(kMs), std::nullopt);
}

TEST(RestartPolicyTest, LongLifeStartsTheCountAnew) {
  const RestartSettings settings;
  RestartPolicy policy(settings);
  for (int i = 0; i < 100; ++i) {
    EXPECT_EQ(policy.OnDeath(settings.healthy_ns), 0);
  }
}

// ------------------------------------------------------------------------------------------------ child process

ProcessEnd WaitFor(ChildProcess* child) {
  for (;;) {
    if (const auto end = child->Poll()) return *end;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

TEST(ChildProcessTest, ReportsExitCodeAndKeepsTheOutput) {
  const Folder folder;
  ChildProcess child = ChildProcess::Start("/bin/sh", {"-c", "echo out; echo err >&2; exit 3"}, folder.path() / "log");
  const ProcessEnd end = WaitFor(&child);
  EXPECT_EQ(end.exit_code, 3);
  EXPECT_EQ(end.Describe(), "ended with exit code 3 (scene or schema mismatch)");
  EXPECT_FALSE(child.running());
  std::ifstream log(folder.path() / "log");
  std::string first, second;
  EXPECT_TRUE(log >> first >> second);
  EXPECT_EQ(first + second, "outerr");
}

TEST(ChildProcessTest, ReportsTheSignal) {
  const Folder folder;
  ChildProcess child = ChildProcess::Start("/bin/sleep", {"100"}, folder.path() / "log");
  EXPECT_FALSE(child.Poll().has_value());
  child.Signal(SIGKILL);
  EXPECT_EQ(WaitFor(&child).Describe(), "killed by signal 9 (Killed)");
}

TEST(ChildProcessTest, MissingProgramIsRefusedByName) {
  const Folder folder;
  try {
    (void)ChildProcess::Start(folder.path() / "nothing", {}, folder.path() / "log");
    FAIL() << "a missing program was started";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("nothing: No such file"), std::string::npos) << error.what();
  }
}

TEST(ChildProcessTest, DestructionLeavesNoProcess) {
  const Folder folder;
  pid_t pid = 0;
  {
    const ChildProcess child = ChildProcess::Start("/bin/sleep", {"100"}, folder.path() / "log");
    pid = child.pid();
    EXPECT_EQ(::kill(pid, 0), 0);
  }
  EXPECT_NE(::kill(pid, 0), 0);
}

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

// ------------------------------------------------------------------------------------------------ script outlook

class ScriptTest : public ::testing::Test {
 protected:
  ScriptTest() {
    scene_.tools[0].kind = ToolKind::kGrasper;
    scene_.tools[1].kind = ToolKind::kHook;
    scene_.script = keys_;
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
  EXPECT_FALSE(DemandsUntil(SceneView{}, 20.0).deformation);
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
  // Without heat there is no temperature, not one of 0.
  EXPECT_EQ(json.find("highest_temperature_C"), std::string::npos) << json;
  EXPECT_EQ(std::count(json.begin(), json.end(), '{'), 1);
}

TEST(OutcomeTest, TableShowsEachNodeAndTheVerdict) {
  SessionOutcome outcome;
  outcome.nodes = {NodeId::kPhysics, NodeId::kRender};
  outcome.verdict = "nothing was cut";
  SessionRecord record;
  record.AddHealth(1, PhysicsHealth(1, 1, 3.25));
  const std::string table = FinalTable(outcome, record);
  EXPECT_NE(table.find("physics_node"), std::string::npos);
  EXPECT_NE(table.find("1.00 / 2.00 / 5.00"), std::string::npos) << table;
  EXPECT_NE(table.find("silent"), std::string::npos) << table;
  EXPECT_NE(table.find("NOT WELL: nothing was cut"), std::string::npos) << table;
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
  const Folder folder;
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
    if (i < 10 || i > 20) frames.push_back({"", 0.5 * i});  // A gap, as while the renderer was dead.
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
  const Folder folder;
  WritePng(folder.path() / "frame_0000000.png", 64, 32);
  const std::string full = EmbedPng(folder.path() / "frame_0000000.png", 1);
  EXPECT_TRUE(full.starts_with("data:image/png;base64,iVBOR"));
  EXPECT_FALSE(EmbedPng(folder.path() / "frame_0000000.png", 2).empty());
  EXPECT_TRUE(EmbedPng(folder.path() / "frame_0000000.png", 64).empty());
  std::ofstream(folder.path() / "bad.png") << "not a picture";
  EXPECT_TRUE(EmbedPng(folder.path() / "bad.png", 1).empty());
}

/// A program `ffmpeg` of the test's own, alone on the path.
class ClipTest : public ::testing::Test {
 protected:
  ClipTest() : path_(std::getenv("PATH")) { setenv("PATH", folder_.path().c_str(), 1); }
  ~ClipTest() override { setenv("PATH", path_.c_str(), 1); }
  void Ffmpeg(const std::string& body) {
    const fs::path program = folder_.path() / "ffmpeg";
    std::ofstream(program) << "#!/bin/sh\nfor last; do :; done\n" << body << '\n';
    fs::permissions(program, fs::perms::owner_all);
  }
  [[nodiscard]] bool Make() const { return MakeClip(folder_.path(), clip_, folder_.path() / "clip.log"); }

  const Folder folder_;
  const fs::path clip_ = folder_.path() / "clip.mp4";
  const std::string path_;
};

TEST_F(ClipTest, ShowsEachPictureForItsTime) {
  for (const char* name : {"frame_0000500.png", "frame_0000750.png", "frame_0002000.png"}) {
    std::ofstream(folder_.path() / name) << "x";
  }
  Ffmpeg("while read -r line; do echo \"$line\"; done < \"$last.frames\" > \"$last\"");
  ASSERT_TRUE(Make());
  std::ifstream in(clip_);
  const std::string list{std::istreambuf_iterator<char>(in), {}};
  EXPECT_NE(list.find("frame_0000500.png'\nduration 0.25\n"), std::string::npos) << list;
  EXPECT_NE(list.find("frame_0000750.png'\nduration 1.25\n"), std::string::npos) << list;
  EXPECT_FALSE(fs::exists(clip_.string() + ".frames"));
}

TEST_F(ClipTest, WithoutPicturesOrProgramOrAfterAFailureThereIsNone) {
  Ffmpeg("echo clip > \"$last\"");
  EXPECT_FALSE(Make()) << "no pictures";
  std::ofstream(folder_.path() / "frame_0000500.png") << "x";
  std::ofstream(folder_.path() / "frame_0000750.png") << "x";
  EXPECT_TRUE(Make());
  Ffmpeg("echo half > \"$last\"; exit 1");
  EXPECT_FALSE(Make());
  EXPECT_FALSE(fs::exists(clip_));
  fs::remove(folder_.path() / "ffmpeg");
  EXPECT_FALSE(Make());
}

TEST(ReportTest, HoldsEverythingAndNothingFromElsewhere) {
  const Folder folder;
  WritePng(folder.path() / "frame_0001000.png", 64, 32);
  SessionOutcome outcome;
  outcome.scene_name = "<tiny>";
  outcome.nodes = {NodeId::kPhysics};
  outcome.duration_s = 10;
  outcome.configuration = "a: <b>\n";
  SessionRecord record;
  Health health = PhysicsHealth(1, 1, 3.25);
  health.metrics.push_back({"displacement_mm", 2});
  record.AddHealth(1, health);
  record.AddDeath(5.1, NodeId::kPhysics, "killed by signal 9 (Killed)", false);
  ThermalEvent event;
  event.kind = ThermalEventKind::kCut;
  record.AddEvent(event);
  std::ofstream(folder.path() / "clip.mp4") << "a clip";
  const std::string html = ReportHtml(outcome, record, folder.path(), folder.path() / "clip.mp4");
  for (const char* part : {"&lt;tiny&gt;", "physics_node", "data:image/png;base64,", "data:video/mp4;base64,YSBjbGlw",
                           "<svg", "class='mark'", "killed by signal 9", "cut × 1", "a: &lt;b&gt;"}) {
    EXPECT_NE(html.find(part), std::string::npos) << part;
  }
  for (const char* outside : {"http://", "https://", "src='/", "<script", "<link"}) {
    EXPECT_EQ(html.find(outside), std::string::npos) << outside;
  }
}

// --------------------------------------------------------------------------------------------------- scene cache

class SceneCacheTest : public ::testing::Test {
 protected:
  SceneCacheTest() {
    request_.library = folder_.path() / "scenes";
    request_.compiler = folder_.path() / "compiler";
    request_.cache = folder_.path() / "cache";
    fs::create_directory(request_.library);
    std::ofstream(request_.library / "one.yaml") << "name: one\nfolders: [../meshes]\nmesh: organ.stl\n";
    fs::create_directory(folder_.path() / "meshes");
    std::ofstream(folder_.path() / "meshes" / "organ.stl") << "solid";
    Program("echo run >> \"$0.runs\"; cp \"$1\" \"$3\"");
  }
  void Program(const std::string& body) const {
    std::ofstream(request_.compiler) << "#!/bin/sh\n" << body << "\n";
    fs::permissions(request_.compiler, fs::perms::owner_all);
  }
  int Runs() const {
    std::ifstream stream(request_.compiler.string() + ".runs");
    int runs = 0;
    for (std::string line; std::getline(stream, line);) ++runs;
    return runs;
  }
  Folder folder_;
  SceneRequest request_;
};

TEST_F(SceneCacheTest, CompilesOnceUntilAnInputChanges) {
  request_.name = "one";
  const fs::path first = ResolveScene(request_);
  EXPECT_TRUE(fs::exists(first));
  EXPECT_EQ(ResolveScene(request_), first);
  EXPECT_EQ(Runs(), 1);
  std::ofstream(folder_.path() / "meshes" / "organ.stl") << "solid changed";
  EXPECT_NE(ResolveScene(request_), first);
  EXPECT_EQ(Runs(), 2);
  std::ofstream(request_.library / "one.yaml") << "name: two\n";
  (void)ResolveScene(request_);
  EXPECT_EQ(Runs(), 3);
}

TEST_F(SceneCacheTest, CompiledFileIsTakenAsItIs) {
  std::ofstream(folder_.path() / "ready.fulcrum") << "x";
  request_.name = (folder_.path() / "ready.fulcrum").string();
  EXPECT_EQ(ResolveScene(request_), request_.name);
  EXPECT_EQ(Runs(), 0);
}

TEST_F(SceneCacheTest, UnknownNameListsTheShippedOnes) {
  request_.name = "three";
  try {
    (void)ResolveScene(request_);
    FAIL() << "an unknown scene was found";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("one"), std::string::npos) << error.what();
  }
}

TEST_F(SceneCacheTest, CompilersComplaintIsPassedOn) {
  Program("echo \"one.yaml: organ: missing\" >&2; exit 2");
  request_.name = "one";
  try {
    (void)ResolveScene(request_);
    FAIL() << "a scene that does not compile was found";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("one.yaml: organ: missing"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace fulcrum::supervisor
