#include "services/apps/replayer/lock_step.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <set>
#include <string>

#include "services/apps/replayer/lock_step_report.h"
#include "services/base/core/error.h"
#include "services/records/recording/mcap_reader.h"
#include "services/scene/builder/build.h"
#include "services/scene/builder/scene_settings.h"
#include "tests/unit/replay/recorded_cart.h"

namespace fulcrum::replay {
namespace {

using testing::CartStory;

/// The small scene with a short script: touched, grasped, pulled and cut within two seconds.
scene::SceneData HurriedScene() {
  scene::SceneData data = scene::BuildProcedural(scene::Small());
  for (ScriptKey& key : data.script) key.time_s *= 0.4f;
  data.fixed.hash = scene::ContentHash(data.View());
  return data;
}

class LockStepTest : public ::testing::Test {
 protected:
  LockStepTest() : data_(HurriedScene()), view_(data_.View()) {
    folder_ = std::filesystem::temp_directory_path() / ("fulcrum_replay_test_" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder_ / "again");
  }
  ~LockStepTest() override { std::filesystem::remove_all(folder_); }

  /// Length that was cut [m].
  float Record(const CartStory& story) { return testing::RecordCart(view_, folder_, story); }

  LockStepResult Replay(const std::vector<NodeId>& nodes) {
    std::filesystem::remove_all(folder_ / "again");
    std::filesystem::create_directories(folder_ / "again");
    LockStepSettings settings;
    settings.recording = folder_ / "recording.mcap";
    settings.folder = folder_ / "again";
    settings.nodes = nodes;
    return ReplayInLockStep(settings, view_, SimulatedCart(), {});
  }

  /// Nodes of the last replay that wrote a checkpoint.
  [[nodiscard]] std::set<std::string> Keepers() const {
    std::set<std::string> keepers;
    for (const auto& file : std::filesystem::directory_iterator(folder_ / "again")) {
      keepers.insert(file.path().stem().string());
    }
    return keepers;
  }

  static config::CartConfig SimulatedCart() { return {}; }

  scene::SceneData data_;
  SceneView view_;
  std::filesystem::path folder_;
};

/// Time of a sample in the session.
std::int64_t Milliseconds(const ToolState& tools) {
  return (tools.stamp.stamp_ns - testing::kCartStart_ns) / 1'000'000;
}

const std::vector<NodeId> kAll{NodeId::kPhysics, NodeId::kThermal, NodeId::kHaptics};

TEST_F(LockStepTest, ComesToTheSameStates) {
  EXPECT_GT(Record({.seconds = 2, .late_physics_s = 1.0, .threads = 2}), 1e-3f);
  const LockStepResult result = Replay(kAll);
  EXPECT_TRUE(result.good()) << ReportText(result);
  ASSERT_EQ(result.nodes.size(), 3u);
  EXPECT_EQ(result.nodes[0].compared, 199u);
  EXPECT_EQ(result.nodes[1].compared, 200u);
  EXPECT_GT(result.nodes[2].ticks, 2000u - haptics::kTicksPerManifest) << "all up to the last manifest";
  EXPECT_GE(result.nodes[2].compared, 199u);
  EXPECT_EQ(Keepers(), std::set<std::string>{}) << "no node is restarted";
}

TEST_F(LockStepTest, GoesOnAcrossRestarts) {
  EXPECT_GT(Record({.seconds = 2, .kill_physics_s = 1.234, .kill_haptics_s = 0.8}), 1e-3f);
  const LockStepResult result = Replay(kAll);
  EXPECT_TRUE(result.good()) << ReportText(result);
  EXPECT_EQ(result.nodes[0].starts, 2u);
  EXPECT_EQ(result.nodes[2].starts, 2u);
  EXPECT_EQ(Keepers(), std::set<std::string>{"physics_node"});
}

TEST_F(LockStepTest, FindsTheCheckpointOfAProcessThatDiedBeforeItSealedItsLast) {
  Record({.seconds = 1.6, .kill_physics_s = 1.201, .kill_before_seal = true});
  const LockStepResult result = Replay({NodeId::kPhysics});
  EXPECT_TRUE(result.good()) << ReportText(result);
  EXPECT_EQ(result.nodes[0].starts, 2u);
}

/// Tears, and a physics node that is killed during them, are replayed from the samples named in the manifests.
TEST_F(LockStepTest, ReplaysWhatTractionTears) {
  data_.fixed.physics.tear_stretch = 1.8f;
  data_.fixed.hash = scene::ContentHash(data_.View());
  view_ = data_.View();
  Record({.seconds = 2, .kill_physics_s = 1.234});
  const LockStepResult result = Replay(kAll);
  EXPECT_TRUE(result.good()) << ReportText(result);
  recording::McapReader reader(folder_ / "recording.mcap");
  recording::McapMessage message{};
  int tears = 0;
  while (reader.Next(&message)) tears += reader.channels().at(message.channel).topic == "fulcrum/TearState" ? 1 : 0;
  EXPECT_GE(tears, 2) << "a tear, and its repetition after the restart";
}

TEST_F(LockStepTest, NamesWhatDiffersFirst) {
  CartStory story{.seconds = 1};
  story.tool_change = [](ToolState* tools) {
    if (Milliseconds(*tools) >= 700) tools->tools[0].p_WT.x() += 1e-4f;
    return true;
  };
  Record(story);
  const LockStepResult result = Replay({NodeId::kPhysics, NodeId::kThermal});
  EXPECT_FALSE(result.good());
  ASSERT_TRUE(result.nodes[0].departure) << ReportText(result);
  EXPECT_EQ(result.nodes[0].departure->tick, 70u);
  EXPECT_NE(result.nodes[0].departure->field.find("TissueFrame.xyz["), std::string::npos) << ReportText(result);
  EXPECT_TRUE(result.nodes[1].good()) << "thermal has its own inputs";
}

TEST_F(LockStepTest, SaysWhatTheRecordingLacks) {
  CartStory story{.seconds = 1};
  std::string left_out = "none";
  story.tool_change = [&left_out](ToolState* tools) {
    if (Milliseconds(*tools) != 500) return true;
    left_out = "ToolState #" + std::to_string(tools->stamp.sequence) + " ";
    return false;
  };
  story.manifest_change = [](TickManifest* m) { return m->node != NodeId::kHaptics || m->stamp.sequence != 50; };
  Record(story);
  LockStepResult result = Replay({NodeId::kPhysics, NodeId::kHaptics});
  EXPECT_FALSE(result.good());
  EXPECT_NE(result.nodes[0].missing.find(left_out), std::string::npos) << ReportText(result);
  EXPECT_EQ(result.nodes[0].missing.find("the last of its process"), std::string::npos) << ReportText(result);
  EXPECT_NE(result.nodes[1].missing.find("lacks 1 manifests of haptics_node"), std::string::npos) << ReportText(result);

  story = {.seconds = 1};
  story.manifest_change = [](TickManifest* m) { return m->node != NodeId::kThermal || m->tick >= 3; };
  Record(story);
  result = Replay({NodeId::kThermal});
  EXPECT_NE(result.nodes[0].missing.find("lacks 3 ticks of thermal_node"), std::string::npos) << ReportText(result);
}

TEST_F(LockStepTest, TellsASampleThatAKilledProcessDidNotSendToTheRecorder) {
  CartStory story{.seconds = 1, .kill_haptics_s = 0.801};
  std::string left_out = "none";
  story.tool_change = [&left_out](ToolState* tools) {
    if (Milliseconds(*tools) != 800) return true;
    left_out = "ToolState #" + std::to_string(tools->stamp.sequence) + " ";
    return false;
  };
  Record(story);
  const LockStepResult result = Replay({NodeId::kPhysics});
  EXPECT_NE(result.nodes[0].missing.find(left_out), std::string::npos) << ReportText(result);
  EXPECT_NE(result.nodes[0].missing.find("the last of its process"), std::string::npos) << ReportText(result);
}

/// Position in a recording [B].
std::uint64_t MiddleOfLastChunk(const std::filesystem::path& recording) {
  constexpr char kChunk = 6;
  std::ifstream in(recording, std::ios::binary);
  std::uint64_t middle = 0, at = 8;  // Behind the magic bytes.
  for (;;) {
    char kind = 0;
    std::uint64_t length = 0;
    in.seekg(static_cast<std::streamoff>(at));
    if (!in.get(kind) || !in.read(reinterpret_cast<char*>(&length), sizeof length)) return middle;
    at += 1 + sizeof length;
    if (kind == kChunk) middle = at + length / 2;
    at += length;
  }
}

TEST_F(LockStepTest, ARecordingThatIsCutShortInARecordIsIncomplete) {
  Record({.seconds = 2});
  ASSERT_TRUE(Replay({NodeId::kThermal}).good());
  const std::filesystem::path recording = folder_ / "recording.mcap";
  std::filesystem::resize_file(recording, MiddleOfLastChunk(recording));
  const LockStepResult result = Replay({NodeId::kThermal});
  EXPECT_TRUE(result.nodes[0].good()) << "what can be read is the same: " << ReportText(result);
  EXPECT_FALSE(result.good());
  EXPECT_NE(ReportText(result).find("INCOMPLETE RECORDING: at byte"), std::string::npos) << ReportText(result);
}

TEST_F(LockStepTest, AnotherSceneIsRefused) {
  Record({.seconds = 0.1});
  view_.hash ^= 1;
  EXPECT_THROW(Replay({NodeId::kThermal}), MismatchError);
}

}  // namespace
}  // namespace fulcrum::replay
