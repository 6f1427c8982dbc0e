#include "services/apps/replayer/live.h"

#include <algorithm>
#include <chrono>
#include <deque>
#include <iterator>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <thread>
#include <type_traits>
#include <utility>
#include <vector>

#include "services/apps/replayer/report_format.h"
#include "services/apps/replayer/session_facts.h"
#include "services/base/core/error.h"
#include "services/base/core/message_time.h"
#include "services/base/runtime/cyclic_thread.h"
#include "services/records/recording/time_order.h"
#include "services/transport/bus/access.h"
#include "services/transport/bus/convert/cdr.h"
#include "services/transport/bus/dds/participant.h"
#include "services/transport/bus/dds/shared_memory.h"
#include "services/transport/bus/gate.h"
#include "services/transport/bus/topics.h"

namespace fulcrum::replay {
namespace {

// One round of discovery, so that readers match the writers before the first message.
constexpr auto kDiscovery = std::chrono::milliseconds(300);
// Time in which the last messages reach their readers before the writers are removed.
constexpr auto kLeave = std::chrono::milliseconds(200);
// Longest single sleep, so that a stop signal takes effect during gaps of the recording.
constexpr std::int64_t kLongestSleep_ns = 50'000'000;

/// Shifts the times in messages from the clock of the recording to the present one.
///
/// Epochs are not shifted by the clock: a reader refuses an epoch that is older than that of the node which it has
/// heard so far, and one of the future. The first epoch becomes the begin of the replay, each later one the time at
/// which the replay first sends it. Their order stays.
class PresentTimes {
 public:
  PresentTimes(std::int64_t begin_ns, std::int64_t by_ns) : begin_ns_(begin_ns), by_ns_(by_ns) {}

  /// Time at which a message of this time of the recording is due [ns].
  [[nodiscard]] std::int64_t DueOf(std::int64_t then_ns) const { return std::max(begin_ns_, then_ns + by_ns_); }

  /// Shifts all times of a message that is due at `due_ns`.
  template <class T>
  void Shift(T* message, std::int64_t due_ns) {
    ForEachTime(message, [&](std::string_view name, auto& time) {
      using Time = std::remove_reference_t<decltype(time)>;
      time = name == "epoch" ? static_cast<Time>(EpochOf(static_cast<std::uint64_t>(time), due_ns))
                             : static_cast<Time>(time + static_cast<Time>(by_ns_));
    });
  }

 private:
  std::uint64_t EpochOf(std::uint64_t recorded, std::int64_t due_ns) {
    if (const auto known = epochs_.find(recorded); known != epochs_.end()) return known->second;
    auto present = static_cast<std::uint64_t>(epochs_.empty() ? begin_ns_ : due_ns);
    if (const auto later = epochs_.upper_bound(recorded); later != epochs_.end()) {
      present = later->second - 1;
    } else if (!epochs_.empty()) {
      present = std::max(present, epochs_.rbegin()->second + 1);
    }
    epochs_.emplace(recorded, present);
    return present;
  }

  std::int64_t begin_ns_, by_ns_;
  std::map<std::uint64_t, std::uint64_t> epochs_;  ///< By the recorded epoch.
};

/// Output of one topic.
class Channel {
 public:
  virtual ~Channel() = default;
  /// Decodes a message and shifts its times; false: the message is not to be sent.
  virtual bool Prepare(std::span<const std::uint8_t> bytes, std::int64_t due_ns, PresentTimes* times,
                       LiveResult* result) = 0;
  virtual bool Send() = 0;
};

template <class T>
class ChannelOf final : public Channel {
 public:
  ChannelOf(bus::DdsParticipant* participant, const std::vector<NodeId>& nodes)
      : output_(participant->MakeOutput<T>()), nodes_(nodes) {}

  bool Prepare(std::span<const std::uint8_t> bytes, std::int64_t due_ns, PresentTimes* times,
               LiveResult* result) override {
    if (!bus::DecodeCdr(bytes, &message_) || !bus::PassesGate(message_)) {
      ++result->undecodable;
      return false;
    }
    if constexpr (requires { message_.node; }) {
      if (std::find(nodes_.begin(), nodes_.end(), message_.node) == nodes_.end()) return false;
    }
    times->Shift(&message_, due_ns);
    // A time before the start of this machine, which readers refuse.
    if (!bus::PassesGate(message_)) {
      ++result->failed;
      return false;
    }
    return true;
  }
  bool Send() override { return output_->Write(message_); }

 private:
  std::unique_ptr<typename bus::OutputOf<T>::type> output_;
  const std::vector<NodeId>& nodes_;
  T message_;
};

bool IsSent(TopicId topic, const std::vector<NodeId>& nodes) {
  const std::optional<NodeId> owner = bus::OwnerOf(topic);
  return !owner || std::find(nodes.begin(), nodes.end(), *owner) != nodes.end();
}

/// Vertices of the recording's frames: by UDP, on an encrypted bus, a sample has the size of the writer's type.
int TissueVertices(const std::filesystem::path& file) {
  recording::McapReader reader(file);
  recording::McapMessage message{};
  TissueFrame frame;
  while (reader.Next(&message)) {
    const bus::TopicRole* role = bus::RoleNamed(reader.channels().at(message.channel).topic);
    if (role != nullptr && role->id == TopicId::kTissueFrame && bus::DecodeCdr(message.data, &frame)) {
      return static_cast<int>(frame.header.vertex_count);
    }
  }
  return kMaxTissueVertices;
}

/// The newest messages of each writer before the start, as a late joiner receives them.
class Past {
 public:
  struct Message {
    TopicId topic;
    std::int64_t then_ns;  ///< Clock of the recording.
    std::vector<std::uint8_t> bytes;
  };

  /// @param writer channel of the recording: one for each process and topic.
  void Add(std::uint16_t writer, TopicId topic, std::int64_t then_ns, std::span<const std::uint8_t> bytes) {
    const bus::Quality& quality = bus::QualityOf(topic);
    if (!quality.late_joiners_served) return;
    std::deque<Message>& newest = newest_[writer];
    newest.push_back({topic, then_ns, {bytes.begin(), bytes.end()}});
    if (newest.size() > static_cast<std::size_t>(quality.writer_depth)) newest.pop_front();
  }

  /// All of them by time.
  [[nodiscard]] std::vector<Message> Take() {
    std::vector<Message> all;
    for (auto& [writer, messages] : newest_) std::ranges::move(messages, std::back_inserter(all));
    std::ranges::stable_sort(all, {}, &Message::then_ns);
    return all;
  }

 private:
  std::map<std::uint16_t, std::deque<Message>> newest_;
};

}  // namespace

LiveResult ReplayLive(const LiveSettings& settings, const std::function<bool()>& stop) {
  recording::TimeOrder messages(settings.recording);
  const recording::McapReader& reader = messages.reader();
  const std::filesystem::path memory = bus::SharedMemoryDirectory(settings.domain);
  const bus::Security security =
      settings.security.on() ? settings.security : bus::AnnouncedSecurity(memory, bus::kReplayerIdentity);
  bus::DdsParticipant participant(
      {.domain = settings.domain,
       .node_name = std::string(bus::kReplayerIdentity),
       .shared_memory = memory,
       .security = security,
       .tissue_vertices = security.encrypt ? TissueVertices(settings.recording) : kMaxTissueVertices});
  std::map<TopicId, std::unique_ptr<Channel>> channels;
  for (const bus::TopicRole& role : bus::kTopicRoles) {
    if (!IsSent(role.id, settings.nodes)) continue;
    channels[role.id] = bus::WithMessageOf(role.id, [&]<class T>(std::type_identity<T>) -> std::unique_ptr<Channel> {
      return std::make_unique<ChannelOf<T>>(&participant, settings.nodes);
    });
  }
  std::this_thread::sleep_for(kDiscovery);

  recording::McapMessage message{};
  const auto then_of = [&](const recording::McapMessage& of) {
    return static_cast<std::int64_t>(of.log_time_ns) - ClockOffset(reader);
  };
  /// None: the topic is not sent.
  const auto topic_of = [&](const recording::McapMessage& of) -> std::optional<TopicId> {
    const bus::TopicRole* role = bus::RoleNamed(reader.channels().at(of.channel).topic);
    return role != nullptr && channels.contains(role->id) ? std::optional(role->id) : std::nullopt;
  };

  // All that is before the start is read first, because the clock of the replay runs from its begin on.
  Past past;
  std::optional<std::int64_t> first_ns;
  std::int64_t from_ns = 0, last_ns = 0;
  bool found = false;
  while (!stop() && !found && messages.Next(&message)) {
    last_ns = then_of(message);
    if (!first_ns) {
      first_ns = last_ns;
      from_ns = *first_ns + static_cast<std::int64_t>(1e9 * settings.from_s);
    }
    found = last_ns >= from_ns;
    if (const auto topic = topic_of(message); topic && !found) past.Add(message.channel, *topic, last_ns, message.data);
  }
  LiveResult result;
  if (!found && stop()) return result;
  if (!found) {
    const double length_s = 1e-9 * static_cast<double>(last_ns - first_ns.value_or(last_ns));
    throw InputError(Format("--from %g: %s ends %.2f s after its first message; valid: 0 to %.2f", settings.from_s,
                            settings.recording.c_str(), length_s, length_s));
  }

  const std::int64_t begin_ns = runtime::MonotonicNs();
  PresentTimes times(begin_ns, begin_ns - from_ns);
  const auto send = [&](TopicId topic, std::int64_t then_ns, std::span<const std::uint8_t> bytes) {
    Channel& channel = *channels.at(topic);
    const std::int64_t due_ns = times.DueOf(then_ns);
    if (!channel.Prepare(bytes, due_ns, &times, &result)) return;
    for (std::int64_t now = runtime::MonotonicNs(); now < due_ns && !stop(); now = runtime::MonotonicNs()) {
      std::this_thread::sleep_for(std::chrono::nanoseconds(std::min(due_ns - now, kLongestSleep_ns)));
    }
    result.latest_s = std::max(result.latest_s, 1e-9 * static_cast<double>(runtime::MonotonicNs() - due_ns));
    ++(channel.Send() ? result.published : result.failed);
  };
  for (const Past::Message& before : past.Take()) send(before.topic, before.then_ns, before.bytes);
  do {
    if (const auto topic = topic_of(message)) send(*topic, then_of(message), message.data);
  } while (!stop() && messages.Next(&message));
  std::this_thread::sleep_for(kLeave);
  return result;
}

}  // namespace fulcrum::replay
