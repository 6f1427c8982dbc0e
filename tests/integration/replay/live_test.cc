// The replayer on the bus: readers accept its messages as those of a node that has just started.
#include "services/apps/replayer/live.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <future>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "services/base/core/error.h"
#include "services/base/runtime/cyclic_thread.h"
#include "services/records/recording/mcap_reader.h"
#include "services/records/recording/mcap_writer.h"
#include "services/transport/bus/convert/cdr.h"
#include "services/transport/bus/dds/participant.h"
#include "services/transport/bus/dds/shared_memory.h"
#include "services/transport/bus/input_account.h"
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
      expected.stamp.epoch = tools.samples[0].stamp.epoch;
      ASSERT_TRUE(Same(now, expected)) << "ToolState #" << now.stamp.sequence;
    }
    EXPECT_GE(tools.samples.at(0).stamp.epoch, static_cast<std::uint64_t>(begin_ns)) << "later than any process before";
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

/// A recording of some samples without content. It is removed with the object.
class MadeRecording {
 public:
  static constexpr std::int64_t kFirst_ns = 5'000'000'000'000;

  explicit MadeRecording(const std::string& name)
      : file_(std::filesystem::temp_directory_path() / ("fulcrum_live_" + name + std::to_string(::getpid()))),
        writer_(file_, "", "test") {}
  ~MadeRecording() { std::filesystem::remove(file_); }
  MadeRecording(const MadeRecording&) = delete;
  MadeRecording& operator=(const MadeRecording&) = delete;

  /// @param time_s after the first message. @param epoch_s start of the process, after the first message as well.
  template <class T>
  void Write(T sample, std::uint64_t sequence, double time_s, double epoch_s) {
    const std::int64_t time_ns = At(time_s);
    bus::MutableStampOf(&sample) = {sequence, static_cast<std::uint64_t>(At(epoch_s)), time_ns};
    std::vector<std::uint8_t> bytes;
    ASSERT_TRUE(bus::EncodeCdr(sample, &bytes));
    const auto [channel, fresh] = channels_.try_emplace({bus::RoleOf<T>().name, At(epoch_s)});
    if (fresh) channel->second = writer_.AddChannel(0, bus::RoleOf<T>().name, "cdr", {});
    writer_.Write(channel->second, static_cast<std::uint32_t>(sequence), static_cast<std::uint64_t>(time_ns),
                  static_cast<std::uint64_t>(time_ns), std::as_bytes(std::span(bytes)));
  }
  [[nodiscard]] std::filesystem::path Close() {
    writer_.Close();
    return file_;
  }
  static std::int64_t At(double time_s) { return kFirst_ns + std::llround(1e9 * time_s); }

 private:
  std::filesystem::path file_;
  recording::McapWriter writer_;
  std::map<std::pair<std::string, std::int64_t>, std::uint16_t> channels_;
};

const std::vector<NodeId> kAll{NodeId::kHaptics, NodeId::kPhysics, NodeId::kThermal};

class LiveSamples : public ::testing::Test {
 protected:
  LiveSamples() { bus::RemoveSharedMemory(bus::SharedMemoryDirectory(kDomain)); }
  ~LiveSamples() override { bus::RemoveSharedMemory(bus::SharedMemoryDirectory(kDomain)); }

  /// Replays on another thread and reads meanwhile.
  template <class Take>
  static LiveResult Replay(const LiveSettings& settings, const Take& take) {
    auto replay = std::async(std::launch::async, [&] { return ReplayLive(settings, [] { return false; }); });
    while (replay.wait_for(std::chrono::milliseconds(1)) != std::future_status::ready) take();
    take();
    return replay.get();
  }
};

TEST_F(LiveSamples, AreAcceptedAfterThoseOfANodeThatStartedAMomentAgo) {
  // Two processes of haptics, which had run for 100 s when the recording began: it is a dump, for example.
  MadeRecording samples("epochs");
  std::uint64_t sequence = 0;
  for (int ms = 0; ms < 900; ms += 10) samples.Write(ToolState(), 5000 + ++sequence, 1e-3 * ms, -100);
  for (int ms = 900; ms < 1200; ms += 10) samples.Write(ToolState(), ++sequence, 1e-3 * ms, 0.899);
  TickManifest tick;
  tick.node = NodeId::kPhysics;
  tick.consumed = {{TopicId::kToolState, static_cast<std::uint64_t>(MadeRecording::At(0.899)), sequence}};
  samples.Write(tick, 1, 1.2, -90);

  bus::DdsParticipant participant({.domain = kDomain, .node_name = "test", .shared_memory = {}});
  Heard<ToolState> tools(&participant);
  Heard<TickManifest> ticks(&participant);
  std::uint64_t live_epoch = 0;
  {
    bus::DdsParticipant node({.domain = kDomain, .node_name = "node", .shared_memory = {}});
    const auto output = node.MakeOutput<ToolState>();
    bus::Stamper stamper(runtime::MonotonicNs());
    ASSERT_TRUE(fulcrum::testing::WaitFor(kPatience_s, [&] {
      ToolState state;
      state.stamp = stamper.Next(runtime::MonotonicNs());
      live_epoch = state.stamp.epoch;
      (void)output->Write(state);
      tools.Take();
      return !tools.samples.empty();
    }));
  }
  tools.Take();
  tools.samples.clear();
  const LiveResult result =
      Replay({.recording = samples.Close(), .domain = kDomain, .from_s = 0.6, .nodes = kAll}, [&] {
        tools.Take();
        ticks.Take();
      });
  EXPECT_GT(result.published, 55u);
  EXPECT_EQ(result.failed, 0u);
  EXPECT_GT(tools.samples.size(), 30u) << "best effort loses few samples over the loopback";
  std::vector<std::uint64_t> epochs;
  for (const ToolState& state : tools.samples) {
    if (epochs.empty() || epochs.back() != state.stamp.epoch) epochs.push_back(state.stamp.epoch);
  }
  ASSERT_EQ(epochs.size(), 2u) << "one restart";
  EXPECT_GT(epochs[0], live_epoch);
  EXPECT_GT(epochs[1], epochs[0]);
  ASSERT_EQ(ticks.samples.size(), 1u);
  EXPECT_EQ(ticks.samples[0].consumed.at(0).epoch, epochs[1]) << "it names the sample that was sent";
}

TEST_F(LiveSamples, BeforeTheStartAreThoseOfALateJoinerOnly) {
  MadeRecording samples("past");
  CauteryContact contact;
  TissueFrame frame;
  for (std::uint64_t i = 1; i <= 100; ++i) {
    samples.Write(ToolState(), i, 0.001 * static_cast<double>(i), -1);
    samples.Write(contact, i, 0.001 * static_cast<double>(i), -1);
    samples.Write(frame, i, 0.001 * static_cast<double>(i), -1);
  }
  for (std::uint64_t i = 101; i <= 105; ++i) samples.Write(ToolState(), i, 0.01 * static_cast<double>(i), -1);
  const std::filesystem::path file = samples.Close();
  const auto published = [&](double from_s) {
    return Replay({.recording = file, .domain = kDomain, .from_s = from_s, .nodes = kAll}, [] {}).published;
  };
  EXPECT_EQ(published(1.0), 64u + 4u + 5u);
  try {
    (void)published(2);
    ADD_FAILURE() << "the recording has 1.05 s";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("1.05 s after its first message"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace fulcrum::replay
