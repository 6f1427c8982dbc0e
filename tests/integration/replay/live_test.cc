// The replayer on the bus: its messages reach a reader in another process with stamps of the present time.
#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <thread>
#include <vector>

#include "services/base/runtime/cyclic_thread.h"
#include "services/records/recording/mcap_reader.h"
#include "services/transport/bus/convert/cdr.h"
#include "services/transport/bus/dds/participant.h"
#include "services/transport/bus/dds/shared_memory.h"
#include "services/transport/bus/topics.h"
#include "tests/integration/replay/short_session.h"
#include "tests/support/cart.h"
#include "tests/support/program.h"
#include "tests/unit/bus/same.h"

namespace fulcrum::replay {
namespace {

constexpr int kDomain = 33;
constexpr double kPatience_s = 30;

/// Messages of one topic by sequence; with several writers, those of `node`.
template <class T>
std::map<std::uint64_t, T> Recorded(const std::filesystem::path& file) {
  std::map<std::uint64_t, T> messages;
  recording::McapReader reader(file);
  recording::McapMessage message{};
  while (reader.Next(&message)) {
    T sample;
    if (reader.channels().at(message.channel).topic == bus::RoleOf<T>().name && bus::DecodeCdr(message.data, &sample)) {
      messages.emplace(bus::StampOf(sample).sequence, sample);
    }
  }
  return messages;
}

/// Samples received of one topic.
template <class T>
struct Heard {
  explicit Heard(bus::DdsParticipant* participant) : input(participant->MakeInput<T>()) {}
  void Take() {
    while (input->TakeNext(&sample)) {
      samples.push_back(sample);
      if (bus::StampOf(sample).stamp_ns > runtime::MonotonicNs()) ++of_the_future;
    }
  }
  std::unique_ptr<bus::Input<T>> input;
  T sample;
  std::vector<T> samples;
  int of_the_future = 0;
};

TEST(Live, ReadersGetTheRecordedMessagesAsOfNow) {
  const testing::ShortSession session("live_test");
  bus::RemoveSharedMemory(bus::SharedMemoryDirectory(kDomain));
  const std::int64_t begin_ns = runtime::MonotonicNs();
  {
    bus::DdsParticipant participant({.domain = kDomain, .node_name = "test", .shared_memory = {}});
    Heard<ToolState> tools(&participant);
    Heard<TopologyState> topology(&participant);
    Heard<SceneManifest> sessions(&participant);
    Heard<TickManifest> ticks(&participant);
    Heard<TissueFrame> frames(&participant);
    fulcrum::testing::Program replayer(
        "replayer", {session.recording(), "--live", "--except", "physics", "--domain", std::to_string(kDomain)});
    std::optional<int> code;
    const auto take_all = [&] {
      tools.Take();
      topology.Take();
      sessions.Take();
      ticks.Take();
      frames.Take();
    };
    ASSERT_TRUE(fulcrum::testing::WaitFor(kPatience_s, [&] {
      code = replayer.Poll();
      // Between two looks at the process, often enough that the reader of 1000 samples a second does not overflow.
      for (int i = 0; i < 50 && !code; ++i) {
        take_all();
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      }
      take_all();
      return code.has_value();
    })) << replayer.Said();
    EXPECT_EQ(*code, 0) << replayer.Said();

    // One shift applies to all samples and moves them to the present time.
    ASSERT_FALSE(sessions.samples.empty());
    const auto manifests = Recorded<SceneManifest>(session.recording());
    const std::int64_t shift_ns = sessions.samples[0].session_start_ns - manifests.begin()->second.session_start_ns;
    EXPECT_GE(sessions.samples[0].session_start_ns, begin_ns);
    EXPECT_EQ(sessions.samples[0].scene_hash, manifests.begin()->second.scene_hash);

    const auto then = Recorded<ToolState>(session.recording());
    EXPECT_GT(tools.samples.size(), then.size() / 2) << "best effort loses few samples over the loopback";
    EXPECT_EQ(tools.of_the_future, 0);
    for (const ToolState& now : tools.samples) {
      ASSERT_TRUE(then.contains(now.stamp.sequence));
      ToolState expected = then.at(now.stamp.sequence);
      expected.stamp.stamp_ns += shift_ns;
      expected.stamp.epoch += static_cast<std::uint64_t>(shift_ns);
      ASSERT_TRUE(Same(now, expected)) << "ToolState #" << now.stamp.sequence;
    }
    ASSERT_FALSE(topology.samples.empty());
    const auto last = Recorded<TopologyState>(session.recording()).rbegin()->second;
    EXPECT_EQ(topology.samples.back().revision, last.revision);
    EXPECT_EQ(topology.samples.back().dead_edges, last.dead_edges);
    EXPECT_EQ(topology.samples.back().stamp.stamp_ns, last.stamp.stamp_ns + shift_ns);

    // Physics was left out, also on the topics that it shares with other nodes.
    EXPECT_TRUE(frames.samples.empty());
    std::map<NodeId, int> told;
    for (const TickManifest& tick : ticks.samples) ++told[tick.node];
    EXPECT_GT(told[NodeId::kThermal], 0);
    EXPECT_GT(told[NodeId::kHaptics], 0);
    EXPECT_EQ(told[NodeId::kPhysics], 0);
  }
  bus::RemoveSharedMemory(bus::SharedMemoryDirectory(kDomain));
}

}  // namespace
}  // namespace fulcrum::replay
