// Topics on the link: one Outgoing per topic that the other host reads, one Incoming per topic that arrives from there.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "services/transport/bus/dds/far_participant.h"
#include "services/transport/bus/dds/participant.h"
#include "services/transport/link/allow_list.h"
#include "services/transport/link/codec/packet.h"
#include "services/transport/link/codec/patch_codec.h"
#include "services/transport/link/codec/tissue_codec.h"
#include "services/transport/link/epoch_map.h"

namespace fulcrum::link {

/// What a channel needs of its link. Times are those of the present cycle of the link's thread.
struct LinkContext {
  /// Sends a packet; `put` appends its body.
  std::function<bool(bus::FarLane, PacketKind, const std::function<void(std::vector<std::uint8_t>*)>& put)> send;
  Side side;  ///< Which nodes run here.
  /// The other host only makes pictures: streams of 1000 samples a second are thinned.
  bool for_pictures = false;
  double picture_rate_Hz = 30;
  EpochMap epochs;
  std::int64_t now_ns = 0;
  std::int64_t offset_ns = 0;  ///< Their clock minus ours.
};

/// What became of a received sample.
enum class Taken : std::uint8_t {
  kYes,
  kBad,      ///< Not a valid packet of this channel, or not a valid message.
  kForeign,  ///< Of a node that does not run on the other host.
};

class Outgoing {
 public:
  virtual ~Outgoing() = default;
  /// Sends the samples that have come. Returns the time of the next call if no sample comes before [ns].
  virtual std::int64_t Pump(LinkContext* link) = 0;
  /// Sends again what a late joiner gets, because the other side has lost it.
  virtual void Repeat() {}
  virtual void Repeat(std::span<const std::uint32_t> /*chunks*/) {}
  /// Number of the last sample or chunk sent: for MakeOutgoing when the topic is wanted again.
  [[nodiscard]] virtual std::uint32_t number() const = 0;
};

class Incoming {
 public:
  virtual ~Incoming() = default;
  /// Decodes a packet's body.
  [[nodiscard]] virtual Taken Take(std::span<const std::uint8_t> body, LinkContext* link) = 0;
  /// The node that the last foreign sample named.
  [[nodiscard]] virtual NodeId foreigner() const { return NodeId::kSupervisor; }
  /// Publishes again what names a time of the whole session, if the estimate of the clock offset has moved since: call
  /// in each cycle.
  virtual void Follow(LinkContext* /*link*/) {}
  /// Resets the state: the link on the other side has restarted.
  virtual void Restart() = 0;
  /// Whether the topic has a reader on this host now.
  [[nodiscard]] virtual bool wanted() const = 0;
  /// Whether the whole state is to be requested from the other side. Resets the flag.
  virtual bool TakeAll() { return false; }
  virtual std::vector<std::uint32_t> TakeQuestions() { return {}; }
  [[nodiscard]] virtual std::uint64_t lost() const { return 0; }
};

/// @param notify called on a thread of the bus when a sample has come.
/// @param number that of the last sample or chunk of this topic that was sent to the present peer; 0: none. Numbers
/// never begin anew while the link runs, because the other side takes a smaller number for a late packet.
[[nodiscard]] std::unique_ptr<Outgoing> MakeOutgoing(TopicId topic, bus::DdsParticipant* bus,
                                                     std::function<void()> notify, std::uint32_t number);
[[nodiscard]] std::unique_ptr<Incoming> MakeIncoming(TopicId topic, bus::DdsParticipant* bus);

/// Kind of packet that carries the topic.
[[nodiscard]] constexpr PacketKind KindOf(TopicId topic) {
  return topic == TopicId::kTissueFrame        ? PacketKind::kTissue
         : topic == TopicId::kTemperaturePatch ? PacketKind::kPatch
                                               : PacketKind::kSample;
}

}  // namespace fulcrum::link
