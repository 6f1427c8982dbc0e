#include "services/apps/replayer/live.h"

#include <algorithm>
#include <chrono>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <thread>
#include <type_traits>

#include "services/apps/replayer/session_facts.h"
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

/// Output of one topic.
class Channel {
 public:
  virtual ~Channel() = default;
  /// Decodes a message and shifts its times by `by_ns`; false: the message is not to be sent.
  virtual bool Prepare(std::span<const std::uint8_t> bytes, std::int64_t by_ns, LiveResult* result) = 0;
  virtual bool Send() = 0;
};

template <class T>
class ChannelOf final : public Channel {
 public:
  ChannelOf(bus::DdsParticipant* participant, const std::vector<NodeId>& nodes)
      : output_(participant->MakeOutput<T>()), nodes_(nodes) {}

  bool Prepare(std::span<const std::uint8_t> bytes, std::int64_t by_ns, LiveResult* result) override {
    if (!bus::DecodeCdr(bytes, &message_) || !bus::PassesGate(message_)) {
      ++result->undecodable;
      return false;
    }
    if constexpr (requires { message_.node; }) {
      if (std::find(nodes_.begin(), nodes_.end(), message_.node) == nodes_.end()) return false;
    }
    ForEachTime(&message_, [by_ns](std::string_view, auto& time) {
      time += static_cast<std::remove_reference_t<decltype(time)>>(by_ns);
    });
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

}  // namespace

namespace {

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

  LiveResult result;
  recording::McapMessage message{};
  std::optional<std::int64_t> first_ns;
  std::int64_t moved_ns = 0;  // Offset from the clock of the recording to the present clock.
  const std::int64_t begin_ns = runtime::MonotonicNs();
  while (!stop() && messages.Next(&message)) {
    const std::int64_t then_ns = static_cast<std::int64_t>(message.log_time_ns) - ClockOffset(reader);
    if (!first_ns) {
      first_ns = then_ns + static_cast<std::int64_t>(1e9 * settings.from_s);
      moved_ns = begin_ns - *first_ns;
    }
    const bus::TopicRole* role = bus::RoleNamed(reader.channels().at(message.channel).topic);
    const auto channel = role == nullptr ? channels.end() : channels.find(role->id);
    if (channel == channels.end()) continue;
    // Before --from, only the topics that late joiners receive are sent.
    if (then_ns < *first_ns && !role->quality.late_joiners_served) continue;
    if (!channel->second->Prepare(message.data, moved_ns, &result)) continue;
    const std::int64_t due_ns = std::max(begin_ns, then_ns + moved_ns);
    for (std::int64_t now = runtime::MonotonicNs(); now < due_ns && !stop(); now = runtime::MonotonicNs()) {
      std::this_thread::sleep_for(std::chrono::nanoseconds(std::min(due_ns - now, kLongestSleep_ns)));
    }
    result.latest_s = std::max(result.latest_s, 1e-9 * static_cast<double>(runtime::MonotonicNs() - due_ns));
    ++(channel->second->Send() ? result.published : result.failed);
  }
  std::this_thread::sleep_for(kLeave);
  return result;
}

}  // namespace fulcrum::replay
