// The program `fulcrum` with fake nodes: real processes, real bus, a tiny scene.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "services/base/core/messages.h"
#include "services/base/runtime/child_process.h"
#include "services/base/runtime/cyclic_thread.h"
#include "services/scene/builder/build.h"
#include "services/scene/format/scene_file.h"
#include "services/session/supervisor/node_process.h"
#include "services/transport/bus/dds/participant.h"
#include "services/transport/bus/input_account.h"
#include "tests/support/session_bus.h"

namespace fulcrum::supervisor {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

constexpr int kDomain = 21;

std::string ReadAll(const fs::path& file) {
  std::ifstream stream(file);
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// The small scene without its script, for other nodes.
scene::SceneData TinyScene(std::uint32_t node_mask) {
  scene::SceneData data = scene::BuildProcedural(scene::Small());
  std::snprintf(data.fixed.name, sizeof(data.fixed.name), "tiny");
  data.fixed.node_mask = node_mask;
  data.fixed.script_duration_s = 0;
  data.script.clear();
  return data;
}

/// Session programs in a folder of their own: `fulcrum` starts the nodes in its own folder.
class SupervisorTest : public ::testing::Test {
 protected:
  static constexpr NodeId kNodes[] = {NodeId::kPhysics, NodeId::kThermal};

  void SetUp() override {
    std::string name = (fs::temp_directory_path() / "fulcrum_supervisor_XXXXXX").string();
    ASSERT_NE(::mkdtemp(name.data()), nullptr);
    folder_ = name;
    fs::create_directory(folder_ / "bin");
    fs::create_directory(folder_ / "out");
    fs::copy_file(fs::path(FULCRUM_BIN_DIR) / "fulcrum", folder_ / "bin" / "fulcrum");
    std::uint32_t mask = 0;
    for (const NodeId node : kNodes) {
      fs::copy_file(fs::path(FULCRUM_BIN_DIR) / "supervisor_fake_node", folder_ / "bin" / NodeName(node));
      mask |= 1u << static_cast<unsigned>(node);
    }
    scene_ = folder_ / "tiny.fulcrum";
    scene::WriteSceneFile(TinyScene(mask), "name: tiny\n", scene_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  void Order(NodeId node, const std::string& what) const {
    std::ofstream(folder_ / "out" / (std::string(NodeName(node)) + ".do")) << what << "\n";
  }
  runtime::ChildProcess Fulcrum(std::vector<std::string> words) const {
    words.insert(words.end(), {"--domain", std::to_string(kDomain)});
    return runtime::ChildProcess::Start(folder_ / "bin" / "fulcrum", words, folder_ / "fulcrum.log");
  }
  runtime::ChildProcess Up(std::vector<std::string> more = {}) const {
    // No identity of a keyed bus has the rights for the ports of the fake node.
    std::vector<std::string> words{"up", scene_.string(), "--out", (folder_ / "out").string(), "--open-bus"};
    words.insert(words.end(), more.begin(), more.end());
    return Fulcrum(words);
  }
  static runtime::ProcessEnd Wait(runtime::ChildProcess* process) {
    for (;;) {
      if (const auto end = process->Poll()) {
        return *end;
      }
      std::this_thread::sleep_for(5ms);
    }
  }
  /// False after a time limit that only a fault can exceed.
  static bool WaitUntil(const std::function<bool()>& condition) {
    for (int i = 0; i < 6000; ++i) {
      if (condition()) {
        return true;
      }
      std::this_thread::sleep_for(5ms);
    }
    return false;
  }
  std::string Log() const { return ReadAll(folder_ / "fulcrum.log"); }
  fs::path Session() const { return folder_ / "out" / "latest"; }
  std::string NodeLog(NodeId node) const {
    return ReadAll(Session() / "logs" / (std::string(NodeName(node)) + ".log"));
  }
  static std::size_t Count(const std::string& text, const std::string& what) {
    std::size_t count = 0;
    for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) {
      ++count;
    }
    return count;
  }
  bool Joined(NodeId node, std::size_t times = 1) const { return Count(NodeLog(node), "joined session") >= times; }
  bool AllJoined() const { return Joined(NodeId::kPhysics) && Joined(NodeId::kThermal); }

  /// Process ids of the fake node of this test.
  std::vector<pid_t> PidsOf(NodeId node) const {
    std::vector<pid_t> pids;
    std::error_code error;
    for (const auto& entry : fs::directory_iterator("/proc", error)) {
      std::error_code no_link;
      const fs::path program = fs::read_symlink(entry.path() / "exe", no_link);
      if (!no_link && program == folder_ / "bin" / NodeName(node)) {
        pids.push_back(std::stoi(entry.path().filename()));
      }
    }
    return pids;
  }
  /// Waits until the supervisor has received a Health "running" of another process of `node` than `killed`.
  static bool SupervisorHasHeard(NodeId node, pid_t killed) {
    bus::DdsParticipant bus(testing::ReaderOf(kDomain));
    const auto healths = bus.MakeInput<Health>();
    Health health;
    bool runs = false;
    int turns = 0;  // Of the supervisor, with a Health of its own each, since this test has heard the node.
    return WaitUntil([&] {
      while (healths->TakeNext(&health)) {
        runs |= health.node == node && health.pid != killed && health.state == HealthState::kRunning;
        turns += runs && health.node == NodeId::kSupervisor ? 1 : 0;
      }
      return turns >= 3;
    });
  }
  static std::vector<std::string> SharedMemory() {
    std::vector<std::string> names;
    std::error_code error;
    const fs::path folder = "/dev/shm/fulcrum-" + std::to_string(::getuid()) + "-" + std::to_string(kDomain);
    if (fs::exists(folder)) {
      names.push_back(folder.string());
    }
    for (const auto& entry : fs::directory_iterator(folder, error)) {
      names.push_back(entry.path().filename());
    }
    return names;
  }

  struct Motion {
    runtime::ProcessEnd end;
    double seconds = 0;  ///< From the first sample of the session that had a reader to the last.
  };
  /// Publishes in place of haptics and physics: tool 0 moves in a circle at 40 mm/s, tool 1 presses with 12.5 N. Ends
  /// the session when it has been read for 2.5 s.
  static Motion PublishMotion(runtime::ChildProcess* session) {
    bus::DdsParticipant bus(testing::WriterOf(kDomain, "hands"));
    const auto manifests = bus.MakeInput<SceneManifest>();
    const auto tools = bus.MakeOutput<ToolState>();
    const auto models = bus.MakeOutput<ContactModel>();
    bus::Stamper tool_stamper(runtime::MonotonicNs()), model_stamper(runtime::MonotonicNs());
    ToolState tool;
    tool.tools[0].kind = ToolKind::kGrasper;
    ContactModel model;
    model.devices[1].count = 1;
    model.devices[1].contacts[0].kind = ContactKind::kSurface;
    model.devices[1].contacts[0].f_ref = Vec3f(0, 0, 12.5f);
    SceneManifest manifest;
    std::int64_t begin_ns = 0, last_ns = 0;
    bool ending = false;
    for (;;) {
      if (const auto end = session->Poll()) {
        return {*end, 1e-9 * static_cast<double>(last_ns - begin_ns)};
      }
      const std::int64_t now = runtime::MonotonicNs();
      (void)manifests->TakeLatest(&manifest);
      const bool is_read = manifest.session_start_ns != 0 && now > manifest.session_start_ns && tools->has_readers();
      if (begin_ns == 0 && is_read) begin_ns = now;
      if (begin_ns != 0 && !ending) last_ns = now;
      if (begin_ns != 0 && !ending && now - begin_ns > 2'500'000'000) {
        session->Signal(SIGINT);
        ending = true;
      }
      const double angle = 1e-9 * static_cast<double>(now % 1'000'000'000'000) * 0.040 / 0.020;
      tool.stamp = tool_stamper.Next(now);
      tool.tools[0].p_WT = 0.020f * Vec3f(static_cast<float>(std::cos(angle)), static_cast<float>(std::sin(angle)), 0);
      model.stamp = model_stamper.Next(now);
      model.tool_stamp_ns = now;
      tools->Write(tool);
      models->Write(model);
      std::this_thread::sleep_for(2ms);
    }
  }

  fs::path folder_, scene_;
};

TEST_F(SupervisorTest, RunsForTheTimeAskedAndLeavesReportAndNothingElse) {
  runtime::ChildProcess up = Up({"--seconds", "1"});
  EXPECT_EQ(Wait(&up).exit_code, 0) << Log();
  EXPECT_EQ(SharedMemory(), std::vector<std::string>{});
  for (const char* file : {"summary.json", "report.html", "configuration.yaml", "cart.yaml", "scene.fulcrum"}) {
    EXPECT_TRUE(fs::exists(Session() / file)) << file;
  }
  const std::string summary = ReadAll(Session() / "summary.json");
  EXPECT_NE(summary.find("\"ok\": true"), std::string::npos) << summary;
  EXPECT_NE(summary.find("\"max_displacement_mm\": 12.5"), std::string::npos) << summary;
  EXPECT_NE(summary.find("\"physics_node.restarts\": 0"), std::string::npos) << summary;
  for (const NodeId node : kNodes) {
    EXPECT_TRUE(PidsOf(node).empty());
  }
}

TEST_F(SupervisorTest, KilledNodeIsRestartedRejoinsAndTheRunEndsWell) {
  runtime::ChildProcess up = Up();
  ASSERT_TRUE(WaitUntil([&] { return AllJoined(); })) << Log();
  const auto pids = PidsOf(NodeId::kPhysics);
  ASSERT_EQ(pids.size(), 1u);
  ::kill(pids[0], SIGKILL);
  ASSERT_TRUE(WaitUntil([&] { return Joined(NodeId::kPhysics, 2); })) << Log();
  EXPECT_TRUE(SupervisorHasHeard(NodeId::kPhysics, pids[0]));
  up.Signal(SIGINT);
  EXPECT_EQ(Wait(&up).exit_code, 0) << Log();
  EXPECT_NE(Log().find("physics_node killed by signal 9"), std::string::npos) << Log();
  const std::string summary = ReadAll(Session() / "summary.json");
  EXPECT_NE(summary.find("\"physics_node.restarts\": 1"), std::string::npos) << summary;
  EXPECT_EQ(summary.find("\"physics_node.longest_rejoin_s\": 0,"), std::string::npos) << summary;
  EXPECT_EQ(SharedMemory(), std::vector<std::string>{});
}

TEST_F(SupervisorTest, CrashLoopEndsTheSessionWithTheCause) {
  Order(NodeId::kThermal, "crash");
  runtime::ChildProcess up = Up();
  EXPECT_EQ(Wait(&up).exit_code, 1) << Log();
  EXPECT_NE(Log().find("thermal_node killed by signal 6"), std::string::npos) << Log();
  EXPECT_NE(Log().find("for good"), std::string::npos) << Log();
  EXPECT_TRUE(PidsOf(NodeId::kPhysics).empty());
  EXPECT_EQ(SharedMemory(), std::vector<std::string>{});
}

TEST_F(SupervisorTest, KeepGoingRunsOnWithoutTheNodeThatFailed) {
  Order(NodeId::kThermal, "exit 4");
  runtime::ChildProcess up = Up({"--seconds", "1", "--keep-going"});
  EXPECT_EQ(Wait(&up).exit_code, 4) << Log();
  EXPECT_TRUE(Joined(NodeId::kPhysics)) << Log();
  EXPECT_NE(ReadAll(Session() / "summary.json").find("\"thermal_node.failed\": true"), std::string::npos);
}

TEST_F(SupervisorTest, MismatchIsNotTriedAgain) {
  Order(NodeId::kPhysics, "mismatch");
  runtime::ChildProcess up = Up();
  EXPECT_EQ(Wait(&up).exit_code, 3) << Log();
  EXPECT_NE(Log().find("the scene is another one"), std::string::npos) << Log();
  EXPECT_EQ(Count(Log(), "starting it again"), 0u) << Log();
}

TEST_F(SupervisorTest, NodeThatHangsInItsStepStillEndsWithTheSession) {
  Order(NodeId::kPhysics, "hang");
  runtime::ChildProcess up = Up();
  ASSERT_TRUE(WaitUntil([&] { return Count(NodeLog(NodeId::kPhysics), "hanging") == 1; })) << Log();
  up.Signal(SIGTERM);
  EXPECT_EQ(Wait(&up).exit_code, 0) << Log();
  EXPECT_TRUE(PidsOf(NodeId::kPhysics).empty());
  EXPECT_EQ(SharedMemory(), std::vector<std::string>{});
}

TEST_F(SupervisorTest, ARecorderMayTakeLongerToEndThanOtherNodes) {
  fs::copy_file(folder_ / "bin" / NodeName(NodeId::kPhysics), folder_ / "bin" / "recorder");
  Order(NodeId::kRecorder, "end 6000");
  Order(NodeId::kPhysics, "end 6000");
  runtime::ChildProcess up = Up({"--seconds", "1", "--record"});
  Wait(&up);
  EXPECT_EQ(Count(NodeLog(NodeId::kRecorder), "has ended by itself"), 1u) << Log();
  EXPECT_EQ(Count(NodeLog(NodeId::kPhysics), "has ended by itself"), 0u) << Log();
}

TEST_F(SupervisorTest, ChildrenDieWithAKilledSupervisorAndNothingIsLeft) {
  runtime::ChildProcess up = Up();
  ASSERT_TRUE(WaitUntil([&] { return AllJoined(); })) << Log();
  up.Signal(SIGKILL);
  Wait(&up);
  EXPECT_TRUE(WaitUntil([&] { return PidsOf(NodeId::kPhysics).empty() && PidsOf(NodeId::kThermal).empty(); }));
  EXPECT_TRUE(WaitUntil([&] { return SharedMemory().empty(); })) << "the watching process has swept it";
  runtime::ChildProcess again = Up({"--seconds", "0.5"});
  EXPECT_EQ(Wait(&again).exit_code, 0) << Log();
  EXPECT_EQ(SharedMemory(), std::vector<std::string>{});
}

TEST_F(SupervisorTest, SecondSessionInTheSameDomainIsRefused) {
  runtime::ChildProcess up = Up();
  ASSERT_TRUE(WaitUntil([&] { return AllJoined(); })) << Log();
  runtime::ChildProcess second = Up();
  EXPECT_EQ(Wait(&second).exit_code, 2) << Log();
  EXPECT_NE(Log().find("a session runs in domain 21"), std::string::npos) << Log();
  up.Signal(SIGTERM);
  EXPECT_EQ(Wait(&up).exit_code, 0) << Log();
}

TEST_F(SupervisorTest, StatusRestartAndDownReachTheSupervisor) {
  runtime::ChildProcess up = Up();
  ASSERT_TRUE(WaitUntil([&] { return AllJoined(); })) << Log();
  runtime::ChildProcess status = Fulcrum({"status"});
  EXPECT_EQ(Wait(&status).exit_code, 0) << Log();
  EXPECT_NE(Log().find("scene \"tiny\""), std::string::npos) << Log();
  EXPECT_NE(Log().find("thermal_node"), std::string::npos) << Log();

  runtime::ChildProcess restart = Fulcrum({"restart", "thermal_node"});
  EXPECT_EQ(Wait(&restart).exit_code, 0) << Log();
  EXPECT_TRUE(WaitUntil([&] { return Joined(NodeId::kThermal, 2); })) << Log();
  runtime::ChildProcess unknown = Fulcrum({"restart", "kitchen_node"});
  EXPECT_EQ(Wait(&unknown).exit_code, 1) << Log();

  runtime::ChildProcess down = Fulcrum({"down"});
  EXPECT_EQ(Wait(&down).exit_code, 0) << Log();
  EXPECT_EQ(Wait(&up).exit_code, 0) << Log();
  runtime::ChildProcess nothing = Fulcrum({"down"});
  EXPECT_EQ(Wait(&nothing).exit_code, 2) << Log();
}

TEST_F(SupervisorTest, ADegradedNodeHasTheNewestPastDumpedOnce) {
  fs::copy_file(fs::path(FULCRUM_BIN_DIR) / "recorder", folder_ / "bin" / "recorder");
  Order(NodeId::kThermal, "flicker");
  runtime::ChildProcess up = Up({"--seconds", "120", "--keep-last", "30"});
  const std::string dumped = "dump.mcap: thermal_node is degraded: a plug is loose";
  EXPECT_TRUE(WaitUntil([&] { return Count(NodeLog(NodeId::kRecorder), dumped) > 0; })) << NodeLog(NodeId::kRecorder);
  std::this_thread::sleep_for(1s);  // It degrades five times more.
  up.Signal(SIGINT);
  EXPECT_EQ(Wait(&up).exit_code, 0) << Log();
  EXPECT_EQ(Count(NodeLog(NodeId::kRecorder), dumped), 1u) << NodeLog(NodeId::kRecorder);
  EXPECT_TRUE(fs::exists(Session() / "dump.mcap"));
  EXPECT_FALSE(fs::exists(Session() / "dump-2.mcap"))
      << "it recovered and degraded again within the 30 s after the first dump";
}

TEST_F(SupervisorTest, ADegradedNodeAfterACommandIsNoFault) {
  fs::copy_file(fs::path(FULCRUM_BIN_DIR) / "recorder", folder_ / "bin" / "recorder");
  runtime::ChildProcess up = Up({"--keep-last", "30"});
  ASSERT_TRUE(WaitUntil([&] { return AllJoined(); })) << Log();
  Order(NodeId::kThermal, "flicker");
  runtime::ChildProcess restart = Fulcrum({"restart", "thermal_node"});
  EXPECT_EQ(Wait(&restart).exit_code, 0) << Log();
  ASSERT_TRUE(WaitUntil([&] { return Joined(NodeId::kThermal, 2); })) << Log();
  std::this_thread::sleep_for(500ms);
  up.Signal(SIGINT);
  EXPECT_EQ(Wait(&up).exit_code, 0) << Log();
  EXPECT_FALSE(fs::exists(Session() / "dump.mcap")) << NodeLog(NodeId::kRecorder);
}

// Another build of a node runs in its place. If it cannot be executed, nothing changes; if it ends before its first
// Health, the previous build runs again.
TEST_F(SupervisorTest, SwapReplacesANodeAndABadReplacementGivesItBack) {
  const fs::path other = folder_ / "other" / NodeName(NodeId::kThermal);
  fs::create_directory(folder_ / "other");
  fs::create_symlink(fs::path(FULCRUM_BIN_DIR) / "supervisor_fake_node", other);
  runtime::ChildProcess up = Up({"--allow-swap-command"});
  ASSERT_TRUE(WaitUntil([&] { return AllJoined(); })) << Log();
  const std::vector<pid_t> before = PidsOf(NodeId::kThermal);
  ASSERT_EQ(before.size(), 1u);

  runtime::ChildProcess nonsense = Fulcrum({"swap", "thermal_node", "--with", "/nonexistent"});
  EXPECT_EQ(Wait(&nonsense).exit_code, 1) << Log();
  EXPECT_NE(Log().find("/nonexistent: is not an executable program; nothing was changed"), std::string::npos) << Log();
  EXPECT_EQ(PidsOf(NodeId::kThermal), before);

  runtime::ChildProcess swap = Fulcrum({"swap", "thermal_node", "--with", other.string()});
  EXPECT_EQ(Wait(&swap).exit_code, 0) << Log();
  ASSERT_TRUE(WaitUntil([&] { return Joined(NodeId::kThermal, 2); })) << Log();
  EXPECT_TRUE(PidsOf(NodeId::kThermal).empty()) << "the other build runs, and nothing else";
  EXPECT_EQ(Count(Log(), "thermal_node was replaced by command"), 1u) << Log();

  runtime::ChildProcess bad = Fulcrum({"swap", "thermal_node", "--with", "/bin/false"});
  EXPECT_EQ(Wait(&bad).exit_code, 0) << Log();
  ASSERT_TRUE(WaitUntil([&] { return Joined(NodeId::kThermal, 3); })) << Log();
  EXPECT_NE(Log().find("thermal_node was replaced by /bin/false, which ended with exit code 1"), std::string::npos)
      << Log();
  EXPECT_NE(Log().find("the previous program is started again"), std::string::npos) << Log();

  const fs::path text = folder_ / "other" / "text";
  std::ofstream(text) << "not a program";
  fs::permissions(text, fs::perms::owner_all);
  runtime::ChildProcess worse = Fulcrum({"swap", "thermal_node", "--with", text.string()});
  EXPECT_EQ(Wait(&worse).exit_code, 0) << Log();
  ASSERT_TRUE(WaitUntil([&] { return Joined(NodeId::kThermal, 4); })) << Log();
  EXPECT_NE(Log().find("cannot start " + text.string()), std::string::npos) << Log();

  up.Signal(SIGINT);
  EXPECT_EQ(Wait(&up).exit_code, 0) << Log();
  EXPECT_EQ(SharedMemory(), std::vector<std::string>{});
}

TEST_F(SupervisorTest, ScriptThatAsksForACutWithoutOneIsAFailure) {
  std::uint32_t mask = 0;
  for (const NodeId node : {NodeId::kHandleBridge, NodeId::kHaptics, NodeId::kPhysics, NodeId::kThermal}) {
    fs::copy_file(fs::path(FULCRUM_BIN_DIR) / "supervisor_fake_node", folder_ / "bin" / NodeName(node),
                  fs::copy_options::skip_existing);
    mask |= 1u << static_cast<unsigned>(node);
  }
  scene::SceneData data = TinyScene(mask);
  data.fixed.script_duration_s = 4;
  const Vec3f here = data.fixed.tools[1].p_WP - Vec3f(0, 0, 0.05f);
  data.script = {{0, 1, here, 0, kPedalCut, 35}, {4, 1, here, 0, kPedalNone, 0}};
  scene::WriteSceneFile(data, "name: tiny\n", scene_);
  runtime::ChildProcess up = Up();
  EXPECT_EQ(Wait(&up).exit_code, 1) << Log();
  EXPECT_NE(Log().find("nothing was cut"), std::string::npos) << Log();
}

TEST_F(SupervisorTest, AssessedSessionIsScoredAndRemembered) {
  const std::string database = (folder_ / "trainees.sqlite").string();
  const auto end_of = [&](const std::vector<std::string>& words) {
    runtime::ChildProcess up = Up(words);
    return Wait(&up).exit_code;
  };
  EXPECT_EQ(end_of({"--seconds", "1", "--hands", "script", "--trainee", "Ann", "--database", database}), 2);
  EXPECT_NE(Log().find("no section `assessment`"), std::string::npos) << Log();
  EXPECT_FALSE(fs::exists(database));

  scene::SceneData data = TinyScene(1u << static_cast<unsigned>(NodeId::kPhysics));
  data.fixed.assessment.on = 1;
  scene::WriteSceneFile(data, "name: tiny\n", scene_);
  runtime::ChildProcess up = Up({"--seconds", "120", "--hands", "script", "--trainee", "Ann", "--database", database});
  const Motion motion = PublishMotion(&up);
  EXPECT_EQ(motion.end.exit_code, 0) << Log();
  EXPECT_NE(Log().find("! force too high · score "), std::string::npos) << Log();
  const std::string json = ReadAll(Session() / "assessment.json");
  EXPECT_NE(json.find("\"peak_force_N\": 12.5,"), std::string::npos) << json;
  EXPECT_NE(json.find("\"peak_force_N.passed\": false"), std::string::npos) << json;
  const std::size_t path = json.find("\"path_length_mm\": ");
  ASSERT_NE(path, std::string::npos) << json;
  // 40 mm/s, between the time at which discovery has completed on both sides and the end of the session.
  const double path_mm = std::stod(json.substr(path + 18));
  EXPECT_GT(path_mm, 0.6 * 40 * motion.seconds);
  EXPECT_LT(path_mm, 1.25 * 40 * motion.seconds);
  EXPECT_NE(ReadAll(Session() / "assessment.json").find("\"trainee\": \"Ann\""), std::string::npos);
  EXPECT_NE(ReadAll(Session() / "report.html").find("Score sheet of Ann"), std::string::npos);
  EXPECT_NE(ReadAll(Session() / "summary.json").find("\"score_pct\": "), std::string::npos);
  const auto trainee = [&](std::vector<std::string> words) {
    words.insert(words.begin(), "trainee");
    words.insert(words.end(), {"--database", database});
    runtime::ChildProcess process =
        runtime::ChildProcess::Start(folder_ / "bin" / "fulcrum", words, folder_ / "trainee.log");
    return Wait(&process).exit_code;
  };
  EXPECT_EQ(trainee({"Ann", "--svg", (folder_ / "ann.svg").string()}), 0);
  EXPECT_NE(ReadAll(folder_ / "trainee.log").find(" tiny "), std::string::npos) << ReadAll(folder_ / "trainee.log");
  EXPECT_NE(ReadAll(folder_ / "ann.svg").find("Ann, 1 session"), std::string::npos);
  fs::remove(folder_ / "trainee.log");
  EXPECT_EQ(trainee({"Bob"}), 2);
  EXPECT_NE(ReadAll(folder_ / "trainee.log").find("Ann: 1 session"), std::string::npos);

  std::ofstream(database) << std::string(9000, 'x');
  EXPECT_EQ(end_of({"--seconds", "1", "--hands", "script", "--trainee", "Ann", "--database", database}), 2);
  EXPECT_NE(Log().find("is not a database of trainees, or damaged"), std::string::npos) << Log();
  EXPECT_EQ(ReadAll(database), std::string(9000, 'x'));
}

TEST_F(SupervisorTest, BadUseSaysWhatIsWrong) {
  const std::vector<std::pair<std::vector<std::string>, std::string>> cases{
      {{"up"}, "SCENE is missing"},
      {{"up", "no-such-scene"}, "no scene \"no-such-scene\""},
      {{"up", scene_.string(), "--seconds", "-1"}, "--seconds"},
      {{"up", scene_.string(), "--sekonds", "1"}, "sekonds"},
      {{"up", scene_.string(), "--database", "x"}, "--database goes with --trainee"},
      {{"up", scene_.string(), "--trainee", "Ann"}, "the scene's script would operate"},
      {{"restart"}, "NODE is missing"},
      {{"jump"}, "unknown command"},
  };
  for (const auto& [words, expected] : cases) {
    runtime::ChildProcess fulcrum = Fulcrum(words);
    EXPECT_EQ(Wait(&fulcrum).exit_code, 2) << expected;
    EXPECT_NE(Log().find(expected), std::string::npos) << Log();
  }
}

}  // namespace
}  // namespace fulcrum::supervisor
