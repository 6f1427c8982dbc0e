// The bus between real processes: late joiners, kills, restarts, another schema.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <fstream>
#include <set>

#include "tests/integration/bus/support.h"
#include "tests/unit/bus/same.h"
#include "tests/unit/bus/samples.h"

namespace fulcrum::bus {
namespace {

using test::Eventually;
using test::Peer;

constexpr int kDomain = 12;
const std::string kDomainText = std::to_string(kDomain);
const auto* const kClean = testing::AddGlobalTestEnvironment(new test::CleanDomain(kDomain));

DdsParticipant MakeBus() { return DdsParticipant({.domain = kDomain, .node_name = "test", .shared_memory = {}}); }

/// Number of endpoint files. The library also creates a file for a moment to test whether files can be mapped.
int FilesOf(const std::filesystem::path& directory) {
  const auto is_endpoint = [](const auto& entry) {
    return entry.path().filename().string().find("01.0f.") != std::string::npos;
  };
  return static_cast<int>(std::count_if(std::filesystem::directory_iterator(directory), {}, is_endpoint));
}

TEST(DdsProcesses, LateJoinerGetsSceneTopologyAndHealthOfEveryWriter) {
  std::vector<std::unique_ptr<Peer>> peers;
  for (const char* node : {"0", "1", "2", "3"}) {
    peers.push_back(std::make_unique<Peer>(std::vector<std::string>{kDomainText, "state", node}));
  }
  for (auto& peer : peers) ASSERT_EQ(peer->ReadLine(), "ready");

  DdsParticipant bus = MakeBus();
  auto scenes = bus.MakeInput<SceneManifest>();
  auto topologies = bus.MakeInput<TopologyState>();
  auto healths = bus.MakeInput<Health>();
  SceneManifest scene;
  TopologyState topology;
  ASSERT_TRUE(Eventually([&] { return scenes->TakeLatest(&scene); }));
  EXPECT_TRUE(Same(scene, test::Sample<SceneManifest>()));
  ASSERT_TRUE(Eventually([&] { return topologies->TakeLatest(&topology); }));
  EXPECT_TRUE(Same(topology, test::Sample<TopologyState>())) << "86 KB, so sent in fragments";
  std::set<NodeId> heard;
  Health health;
  EXPECT_TRUE(Eventually([&] {
    while (healths->TakeNext(&health)) heard.insert(health.node);
    return heard.size() == 4;
  }));
  EXPECT_EQ(healths->stats().lost, 0u);
}

TEST(DdsProcesses, KilledPublisherIsForgottenAndItsSuccessorHeard) {
  DdsParticipant bus = MakeBus();
  auto frames = bus.MakeInput<TissueFrame>();
  auto tools = bus.MakeInput<ToolState>();
  TissueFrame frame;
  ToolState tool;
  std::set<std::uint64_t> epochs;
  for (int life = 0; life < 3; ++life) {
    Peer frame_peer({kDomainText, "frames"});
    Peer tool_peer({kDomainText, "tools"});
    for (int i = 0; i < 5; ++i) {
      ASSERT_TRUE(Eventually([&] { return frames->TakeLatest(&frame); })) << "process " << life;
      EXPECT_EQ(frame.xyz.front(), static_cast<float>(frame.header.stamp.sequence % 8));
      EXPECT_EQ(frame.xyz.back(), frame.xyz.front());
      ASSERT_TRUE(Eventually([&] { return tools->TakeLatest(&tool); })) << "process " << life;
    }
    epochs.insert(frame.header.stamp.epoch);
    frame_peer.Kill();
    tool_peer.Kill();
    ASSERT_TRUE(Eventually([&] { return !frames->stats().matched && !tools->stats().matched; }));
    while (frames->TakeLatest(&frame) || tools->TakeLatest(&tool)) {
    }
  }
  EXPECT_EQ(epochs.size(), 3u);
  EXPECT_EQ(frames->stats().rejected, 0u);
  EXPECT_EQ(tools->stats().rejected, 0u);
}

TEST(DdsProcesses, SuccessorIsHeardAtOnceThoughThePredecessorIsNotYetForgotten) {
  DdsParticipant bus = MakeBus();
  auto frames = bus.MakeInput<TissueFrame>();
  auto tools = bus.MakeInput<ToolState>();
  TissueFrame frame;
  ToolState tool;
  std::uint64_t frame_epoch = 0, tool_epoch = 0;
  std::int64_t longest_ms = 0;
  for (int life = 0; life < 10; ++life) {
    const auto start = std::chrono::steady_clock::now();
    Peer frame_peer({kDomainText, "frames"});
    Peer tool_peer({kDomainText, "tools"});
    ASSERT_TRUE(Eventually([&] { return frames->TakeLatest(&frame) && frame.header.stamp.epoch > frame_epoch; }));
    ASSERT_TRUE(Eventually([&] { return tools->TakeLatest(&tool) && tool.stamp.epoch > tool_epoch; }));
    frame_epoch = frame.header.stamp.epoch;
    tool_epoch = tool.stamp.epoch;
    const auto elapsed = std::chrono::steady_clock::now() - start;
    longest_ms = std::max<std::int64_t>(longest_ms, std::chrono::floor<std::chrono::milliseconds>(elapsed).count());
  }
  RecordProperty("longest_ms", static_cast<int>(longest_ms));
  EXPECT_EQ(frames->stats().rejected + tools->stats().rejected, 0u);
}

TEST(DdsProcesses, KilledSubscriberDoesNotStopTheWriter) {
  DdsParticipant bus = MakeBus();
  auto frames = bus.MakeOutput<TissueFrame>();
  auto tools = bus.MakeOutput<ToolState>();
  std::uint64_t sequence = 0;
  auto longest = std::chrono::steady_clock::duration::zero();
  const auto publish = [&] {
    ++sequence;
    const auto start = std::chrono::steady_clock::now();
    tools->Write(test::Sample<ToolState>(sequence));
    if (sequence % 10 == 0) {
      frames->WriteInPlace([&](TissueFrame::View view) {
        view.header.stamp = {sequence / 10, 1, 1};
        view.header.vertex_count = kMaxTissueVertices;
        view.xyz.assign(3 * kMaxTissueVertices, 0.5f);
      });
    }
    longest = std::max(longest, std::chrono::steady_clock::now() - start);
    return false;
  };
  for (int life = 0; life < 3; ++life) {
    Peer peer({kDomainText, "subscribe"});
    bool frame_seen = false, tool_seen = false;
    std::thread listener([&] {
      while (!frame_seen || !tool_seen) {
        const std::string line = peer.ReadLine();
        if (line.empty()) return;
        frame_seen |= line.starts_with("frame ");
        tool_seen |= line.starts_with("tool ");
      }
    });
    std::atomic<bool> heard{false};
    std::thread waiter([&] {
      listener.join();
      heard = true;
    });
    EXPECT_TRUE(Eventually([&] { return publish() || heard; })) << "process " << life;
    peer.Kill();
    waiter.join();
    EXPECT_TRUE(frame_seen && tool_seen) << "process " << life;
    ASSERT_TRUE(Eventually([&] { return publish() || !(frames->has_readers() || tools->has_readers()); }));
  }
  RecordProperty("longest_write_us", static_cast<int>(std::chrono::floor<std::chrono::microseconds>(longest).count()));
  EXPECT_EQ(frames->stats().failed, 0u);
  EXPECT_EQ(tools->stats().failed, 0u);
}

TEST(DdsProcesses, FilesOfTheDeadAreSweptAndThoseOfTheLivingStay) {
  const auto directory = SharedMemoryDirectory(kDomain);
  DdsParticipant bus = MakeBus();
  auto frames = bus.MakeInput<TissueFrame>();
  Peer survivor({kDomainText, "frames"});
  TissueFrame frame;
  ASSERT_TRUE(Eventually([&] { return frames->TakeLatest(&frame); }));
  RecordProperty("swept_before", SweepSharedMemory(directory).files);  // left by kills of earlier tests
  const int files_before = FilesOf(directory);
  {
    Peer victim({kDomainText, "subscribe"});
    // It reads, so it has made all its files: one that is not yet locked looks like one of the dead.
    ASSERT_TRUE(victim.ReadLine().starts_with("frame "));
    ASSERT_GT(FilesOf(directory), files_before);
    EXPECT_EQ(SweepSharedMemory(directory).files, 0) << "all live";
  }
  EXPECT_GT(FilesOf(directory), files_before) << "a killed process leaves its files";
  const SweepResult swept = SweepSharedMemory(directory);
  EXPECT_GE(swept.files, 1);
  EXPECT_EQ(FilesOf(directory), files_before);
  ASSERT_TRUE(Eventually([&] { return frames->TakeLatest(&frame); }));  // The other writer continues.
}

TEST(DdsProcesses, AnotherSchemaIsNamedAndExchangesNothing) {
  DdsParticipant bus = MakeBus();
  auto tools = bus.MakeInput<ToolState>();
  EXPECT_EQ(bus.schema_mismatch(), "");
  const auto start = std::chrono::steady_clock::now();
  {
    Peer alien({kDomainText, "alien"});
    ASSERT_TRUE(Eventually([&] { return !bus.schema_mismatch().empty(); }));
    const auto elapsed = std::chrono::steady_clock::now() - start;
    RecordProperty("ms", static_cast<int>(std::chrono::duration_cast<std::chrono::milliseconds>(elapsed).count()));
    const std::string text = bus.schema_mismatch();
    EXPECT_NE(text.find("peer_alien"), std::string::npos) << text;
    EXPECT_NE(text.find(std::to_string(alien.pid())), std::string::npos) << text;
    EXPECT_NE(text.find("00000000000a11e5"), std::string::npos) << text;
    EXPECT_EQ(text.find('\n'), std::string::npos) << text;

    // A peer with this schema is received meanwhile, so the other peer was not silent for lack of time.
    Peer friendly({kDomainText, "tools"});
    ToolState got;
    ASSERT_TRUE(Eventually([&] { return tools->TakeLatest(&got); }));
    friendly.Kill();
    ASSERT_TRUE(Eventually([&] { return !tools->stats().matched; }));
  }
  EXPECT_TRUE(Eventually([&] { return bus.schema_mismatch().empty(); })) << "cleared after the peer has left";
}

}  // namespace
}  // namespace fulcrum::bus
