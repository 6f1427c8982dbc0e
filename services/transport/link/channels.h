// Topics on their way over the link: one Outgoing per topic that the other host reads, one Incoming per topic that
// comes from there.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "services/transport/bus/dds/far_participant.h"
#include "services/transport/bus/dds/participant.h"
#include "services/transport/link/codec/packet.h"
#include "services/transport/link/codec/patch_codec.h"
#include "services/transport/link/codec/tissue_codec.h"
#include "services/transport/link/epoch_map.h"

namespace fulcrum::link {

/// What a channel needs of its link. The clock is that of the turn at hand.
struct LinkContext {
  /// Sends a packet; `put` appends its body.
  std::function<bool(bus::FarLane, PacketKind, const std::function<void(std::vector<std::uint8_t>*)>& put)> send;
  std::uint32_t native = 0;  ///< Bit per NodeId: nodes of this host.
  /// Only pictures are made there: streams of a thousand a second are thinned.
  bool for_pictures = false;
  double picture_rate_Hz = 30;
  EpochMap epochs;
  std::int64_t now_ns = 0;
  std::int64_t offset_ns = 0;  ///< Theirs minus ours.

  [[nodiscard]] bool IsNative(NodeId node) const { return (native >> static_cast<unsigned>(node) & 1u) != 0; }
};

class Outgoing {
 public:
  virtual ~Outgoing() = default;
  /// Sends what has come; returns when it wants to be called at the latest although nothing comes [ns].
  virtual std::int64_t Pump(LinkContext* link) = 0;
  /// What a late joiner is given, again: the other side has lost it.
  virtual void Repeat() {}
  virtual void Repeat(std::span<const std::uint32_t> /*chunks*/) {}
};

class Incoming {
 public:
  virtual ~Incoming() = default;
  /// Takes a packet's body; false when it is none of ours.
  virtual bool Take(std::span<const std::uint8_t> body, LinkContext* link) = 0;
  /// The link on the other side is another one from here on.
  virtual void Restart() = 0;
  /// Somebody on this host reads it, as of now.
  [[nodiscard]] virtual bool wanted() const = 0;
  /// What the other side is to be asked for, once.
  virtual bool TakeAll() { return false; }
  virtual std::vector<std::uint32_t> TakeQuestions() { return {}; }
  [[nodiscard]] virtual std::uint64_t lost() const { return 0; }
};

/// @param notify called on a thread of the bus when something has come.
[[nodiscard]] std::unique_ptr<Outgoing> MakeOutgoing(TopicId topic, bus::DdsParticipant* bus,
                                                     std::function<void()> notify);
[[nodiscard]] std::unique_ptr<Incoming> MakeIncoming(TopicId topic, bus::DdsParticipant* bus);

/// What a channel of the topic understands.
[[nodiscard]] constexpr PacketKind KindOf(TopicId topic) {
  return topic == TopicId::kTissueFrame        ? PacketKind::kTissue
         : topic == TopicId::kTemperaturePatch ? PacketKind::kPatch
                                               : PacketKind::kSample;
}

}  // namespace fulcrum::link
