#include "services/transport/link/channels.h"

#include <algorithm>
#include <limits>
#include <map>
#include <type_traits>
#include <utility>

#include "services/base/core/message_time.h"
#include "services/transport/bus/access.h"
#include "services/transport/bus/convert/cdr.h"
#include "services/transport/bus/gate.h"
#include "services/transport/bus/topics.h"
#include "services/transport/link/codec/byte_delta.h"

namespace fulcrum::link {
namespace {

using bus::FarLane;

/// Shortest interval between samples of poses, jaw angles and contacts that are sent to a host that only makes pictures
/// [ns].
constexpr std::int64_t kThinned_ns = 10'000'000;
/// SceneManifest is published again when the clock offset has moved by this much: all stamps follow the present offset,
/// so that the session times of the two hosts part by what the start of the session does not follow. Less than the
/// shortest period of a node, so that the session time of a node never goes back [ns].
constexpr std::int64_t kStartMoves_ns = 500'000;
constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::max();
/// Largest message of the bus, except for those that are divided into chunks.
constexpr std::size_t kLargestSample_B = bus::kOrderedPacket_B;
static_assert(kChunk_B + 20 <= bus::kStreamPacket_B, "a chunk and the head of its packet go as one");

/// Health is reliable on the bus so that a late joiner gets the newest. Between hosts only the newest matters, and ten
/// samples a second of each node must not queue while the cable is disconnected.
constexpr FarLane LaneOf(TopicId topic) {
  return bus::QualityOf(topic).delivery != bus::Delivery::kBestEffort && topic != TopicId::kHealth ? FarLane::kOrdered
                                                                                                   : FarLane::kStream;
}

/// Whether a message originates on this host and is meant for the other one. Never true for a republished message.
template <class T>
bool Leaves(const T& message, const LinkContext& link) {
  if constexpr (requires { message.node; }) {
    return link.side.IsNative(message.node);
  } else {
    return true;  // One owner, which runs on this host: otherwise there is no Outgoing.
  }
}

/// Replaces the epochs by which a TickManifest names samples by those of the host that sent the samples.
template <class T>
void NameAsThere(T* message, const LinkContext& link) {
  if constexpr (std::is_same_v<T, TickManifest>) {
    for (ConsumedInput& input : message->consumed) input.epoch = link.epochs.ToTheirs(input.topic, input.epoch);
  }
}

/// Converts the other host's clock and epochs to ours. False if the sample is of a process that has been replaced.
template <class T>
bool MoveHere(T* message, LinkContext* link) {
  constexpr TopicId kTopic = bus::kTopicOf<T>;
  Stamp& stamp = bus::MutableStampOf(message);
  const std::optional<std::uint64_t> epoch =
      link->epochs.ToOurs(kTopic, stamp.epoch, bus::RoleOf(kTopic).one_owner(), link->now_ns);
  if (!epoch) return false;
  ForEachTime(message, [link](std::string_view name, auto& time) {
    // Wrapping arithmetic: the number was received and may have any value; the gate checks the result.
    if (name != "epoch") {
      time = static_cast<std::remove_reference_t<decltype(time)>>(static_cast<std::uint64_t>(time) -
                                                                  static_cast<std::uint64_t>(link->offset_ns));
    }
  });
  stamp.epoch = *epoch;
  if constexpr (std::is_same_v<T, TickManifest>) {
    for (ConsumedInput& input : message->consumed) {
      // The sender has already used the epoch of this host for a topic of this host.
      const std::optional<NodeId> owner = bus::OwnerOf(input.topic);
      if (input.sequence == 0 || !owner || link->side.IsNative(*owner)) continue;
      input.epoch = link->epochs.ToOurs(input.topic, input.epoch, false, link->now_ns).value_or(input.epoch);
    }
  }
  return true;
}

// ------------------------------------------------------------------------------------------------------- outgoing

/// Sends each sample unchanged.
template <class T>
class OutgoingSamples final : public Outgoing {
 public:
  OutgoingSamples(std::unique_ptr<bus::Input<T>> input, std::uint32_t number)
      : input_(std::move(input)), number_(number) {}

  std::int64_t Pump(LinkContext* link) override {
    if (std::exchange(repeat_, false)) {
      for (const auto& [epoch, message] : newest_) Send(message, link);
    }
    if constexpr (kThinnable) {
      if (link->for_pictures) return PumpThinned(link);
    }
    while (input_->TakeNext(&message_)) {
      if (!Leaves(message_, *link)) continue;
      NameAsThere(&message_, *link);
      if constexpr (bus::kQualityOf<T>.late_joiners_served) {
        newest_[bus::StampOf(message_).epoch] = message_;
        if (newest_.size() > kMostWriters) newest_.erase(newest_.begin());
      }
      Send(message_, link);
    }
    return kNever;
  }
  void Repeat() override { repeat_ = true; }
  [[nodiscard]] std::uint32_t number() const override { return number_; }

 private:
  static constexpr std::size_t kMostWriters = 16;
  /// Topics of which a picture needs only the newest sample.
  static constexpr bool kThinnable =
      std::is_same_v<T, ToolState> || std::is_same_v<T, HandleState> || std::is_same_v<T, CauteryContact>;

  std::int64_t PumpThinned(LinkContext* link) {
    if (link->now_ns < due_ns_) return due_ns_;
    due_ns_ = std::max(due_ns_ + kThinned_ns, link->now_ns);
    if (input_->TakeLatest(&message_)) {
      // A sample that is left out on purpose is not a loss.
      message_.stamp.sequence = std::uint64_t{number_} + 1;
      Send(message_, link);
    }
    return due_ns_;
  }

  void Send(const T& message, LinkContext* link) {
    if (!bus::EncodeCdr(message, &cdr_)) return;
    ++number_;
    // A sample that does not fit a datagram is sent in fragments.
    constexpr std::size_t kRoom = 64;
    const FarLane lane = cdr_.size() + kRoom > bus::kStreamPacket_B ? FarLane::kOrdered : LaneOf(bus::kTopicOf<T>);
    (void)link->send(lane, PacketKind::kSample, [&](std::vector<std::uint8_t>* out) {
      PutSample({bus::kTopicOf<T>, number_, 0}, {}, cdr_, out);
    });
  }

  std::unique_ptr<bus::Input<T>> input_;
  T message_;
  std::map<std::uint64_t, T> newest_;  ///< By epoch: what a late joiner gets.
  std::uint32_t number_;
  std::int64_t due_ns_ = 0;
  bool repeat_ = false;
  std::vector<std::uint8_t> cdr_;
};

/// Sends the newest state as the difference from the one before.
class OutgoingTopology final : public Outgoing {
 public:
  OutgoingTopology(std::unique_ptr<bus::Input<TopologyState>> input, std::uint32_t number)
      : input_(std::move(input)), number_(number) {}

  std::int64_t Pump(LinkContext* link) override {
    const bool whole = std::exchange(repeat_, false);
    if (input_->TakeLatest(&state_)) {
      if (!bus::EncodeCdr(state_, &cdr_)) return kNever;
      known_ = true;
    } else if (!whole || !known_) {
      return kNever;
    }
    const SampleHead head{TopicId::kTopologyState, number_ + 1, whole ? 0 : number_};
    if (link->send(FarLane::kOrdered, PacketKind::kSample, [&](std::vector<std::uint8_t>* out) {
          PutSample(head, whole ? std::span<const std::uint8_t>() : sent_, cdr_, out);
        })) {
      ++number_;
      sent_ = cdr_;
    }
    return kNever;
  }
  void Repeat() override { repeat_ = true; }
  [[nodiscard]] std::uint32_t number() const override { return number_; }

 private:
  std::unique_ptr<bus::Input<TopologyState>> input_;
  TopologyState state_;
  bool known_ = false, repeat_ = true;
  std::uint32_t number_;
  std::vector<std::uint8_t> cdr_, sent_;
};

SendChunk ChunkSender(LinkContext* link, PacketKind kind) {
  return [link, kind](std::span<const std::uint8_t> chunk) {
    (void)link->send(FarLane::kStream, kind,
                     [&](std::vector<std::uint8_t>* out) { out->insert(out->end(), chunk.begin(), chunk.end()); });
  };
}

constexpr std::int64_t kTissueAgain_ns = 100'000'000;

/// Sends the blocks that moved, at the picture rate.
class OutgoingTissue final : public Outgoing {
 public:
  OutgoingTissue(std::unique_ptr<bus::Input<TissueFrame>> input, std::uint32_t number)
      : input_(std::move(input)), sender_(number) {}

  std::int64_t Pump(LinkContext* link) override {
    if (link->now_ns < due_ns_) return due_ns_;
    const auto period = static_cast<std::int64_t>(1e9 / link->picture_rate_Hz);
    const SendChunk send = ChunkSender(link, PacketKind::kTissue);
    // At rest frames are rare: the last one is sent again, since with each go some unmoved blocks.
    if (input_->TakeLatest(&frame_) || (encoded_ns_ > 0 && link->now_ns - encoded_ns_ >= kTissueAgain_ns)) {
      sender_.Encode(frame_, send);
      encoded_ns_ = link->now_ns;
    } else {
      sender_.Flush(send);
    }
    // Keeps the time grid, unless the due time is long past.
    due_ns_ = std::max(due_ns_ + period, link->now_ns);
    return due_ns_;
  }
  void Repeat() override { sender_.RepeatAll(); }
  void Repeat(std::span<const std::uint32_t> chunks) override {
    for (const std::uint32_t chunk : chunks) sender_.Repeat(chunk);
  }
  [[nodiscard]] std::uint32_t number() const override { return sender_.chunks(); }

 private:
  std::unique_ptr<bus::Input<TissueFrame>> input_;
  TissueFrame frame_;
  TissueSender sender_;
  std::int64_t due_ns_ = 0, encoded_ns_ = 0;
};

/// Sends the changed tiles of every patch, since each patch has a place of its own in the atlas.
class OutgoingPatches final : public Outgoing {
 public:
  OutgoingPatches(std::unique_ptr<bus::Input<TemperaturePatch>> input, std::uint32_t number)
      : input_(std::move(input)), sender_(number) {}

  std::int64_t Pump(LinkContext* link) override {
    const SendChunk send = ChunkSender(link, PacketKind::kPatch);
    while (input_->TakeNext(&patch_)) sender_.Encode(patch_, send);
    if (std::exchange(repeat_, false)) sender_.Flush(send);
    return kNever;
  }
  void Repeat() override {
    sender_.RepeatAll();
    repeat_ = true;
  }
  void Repeat(std::span<const std::uint32_t> chunks) override {
    for (const std::uint32_t chunk : chunks) sender_.Repeat(chunk);
    repeat_ = true;
  }
  [[nodiscard]] std::uint32_t number() const override { return sender_.chunks(); }

 private:
  std::unique_ptr<bus::Input<TemperaturePatch>> input_;
  TemperaturePatch patch_;
  PatchSender sender_;
  bool repeat_ = false;
};

// ------------------------------------------------------------------------------------------------------- incoming

template <class T>
class IncomingBase : public Incoming {
 public:
  explicit IncomingBase(std::unique_ptr<typename bus::OutputOf<T>::type> output) : output_(std::move(output)) {}
  [[nodiscard]] bool wanted() const override { return output_->has_readers(); }
  [[nodiscard]] NodeId foreigner() const override { return foreigner_; }

 protected:
  Taken Publish(T* message, LinkContext* link) {
    if constexpr (requires { message->node; }) {
      foreigner_ = message->node;
      if (!link->side.MayArriveOf(message->node)) return Taken::kForeign;
    }
    // Before the conversion as well, which uses received enumerators as indices.
    if (!bus::PassesGate(*message) || !MoveHere(message, link) || !bus::PassesGate(*message)) return Taken::kBad;
    (void)output_->Write(*message);
    return Taken::kYes;
  }

 private:
  NodeId foreigner_ = NodeId::kSupervisor;
  std::unique_ptr<typename bus::OutputOf<T>::type> output_;
};

template <class T>
class IncomingSamples final : public IncomingBase<T> {
 public:
  using IncomingBase<T>::IncomingBase;

  Taken Take(std::span<const std::uint8_t> body, LinkContext* link) override {
    SampleHead head;
    std::span<const std::uint8_t> delta;
    if (!TakeSample(body, &head, &delta) || head.topic != bus::kTopicOf<T>) return Taken::kBad;
    // A newer sample arrived first.
    if (LaneOf(bus::kTopicOf<T>) == FarLane::kStream && head.number <= number_) return Taken::kYes;
    if (head.base != 0) {
      if (head.base != number_) {
        if (!all_) ++lost_;
        all_ = true;  // The base of the difference was not received.
        return Taken::kYes;
      }
      if (!TakeDelta(cdr_, delta, kLargestSample_B, &next_)) return Taken::kBad;
    } else if (!TakeDelta({}, delta, kLargestSample_B, &next_)) {
      return Taken::kBad;
    }
    if (bus::kQualityOf<T>.gap_is_loss && number_ != 0 && head.number > number_ + 1) lost_ += head.number - number_ - 1;
    number_ = head.number;
    std::swap(cdr_, next_);
    if (head.base == 0) all_ = false;
    if (!bus::DecodeCdr(std::span<const std::uint8_t>(cdr_), &message_)) return Taken::kBad;
    const Taken taken = this->Publish(&message_, link);
    if constexpr (kNamesSessionStart) {
      published_ = taken == Taken::kYes;
      published_offset_ns_ = link->offset_ns;
    }
    return taken;
  }
  void Follow(LinkContext* link) override {
    if constexpr (kNamesSessionStart) {
      if (!published_ || std::abs(link->offset_ns - published_offset_ns_) <= kStartMoves_ns) return;
      // Converted anew from what was received, of which cdr_ is a copy.
      published_ = bus::DecodeCdr(std::span<const std::uint8_t>(cdr_), &message_) &&
                   this->Publish(&message_, link) == Taken::kYes;
      published_offset_ns_ = link->offset_ns;
    }
  }
  void Restart() override {
    number_ = 0;
    all_ = false;
    published_ = false;
  }
  bool TakeAll() override { return all_; }
  [[nodiscard]] std::uint64_t lost() const override { return lost_; }

 private:
  static constexpr bool kNamesSessionStart = std::is_same_v<T, SceneManifest>;

  T message_;
  std::vector<std::uint8_t> cdr_, next_;
  std::uint32_t number_ = 0;
  bool all_ = false;
  bool published_ = false;                ///< kNamesSessionStart only: cdr_ was published,
  std::int64_t published_offset_ns_ = 0;  ///< with this clock offset.
  std::uint64_t lost_ = 0;
};

/// Receives a topic that is sent in chunks.
template <class T, class Receiver>
class IncomingChunks final : public IncomingBase<T> {
 public:
  using IncomingBase<T>::IncomingBase;

  Taken Take(std::span<const std::uint8_t> body, LinkContext* link) override {
    switch (receiver_.Take(body)) {
      case TissueReceiver::Result::kBad:
        return Taken::kBad;
      case TissueReceiver::Result::kPart:
        return Taken::kYes;
      case TissueReceiver::Result::kFrame:
        break;
    }
    if constexpr (std::is_same_v<T, TissueFrame>) {
      message_ = receiver_.frame();
    } else {
      message_ = receiver_.patch();
      // Incomplete frames are held back, which is not a loss on this host's bus.
      message_.header.stamp.sequence = ++number_;
    }
    return this->Publish(&message_, link);
  }
  void Restart() override {
    lost_before_ = lost();
    receiver_ = Receiver();
  }
  bool TakeAll() override { return receiver_.missing().TakeAll(); }
  std::vector<std::uint32_t> TakeQuestions() override { return receiver_.missing().TakeQuestions(kMostQuestions); }
  [[nodiscard]] std::uint64_t lost() const override { return lost_before_ + receiver_.missing().lost(); }

 private:
  T message_;
  Receiver receiver_;
  std::uint64_t lost_before_ = 0;
  std::uint64_t number_ = 0;
};

}  // namespace

std::unique_ptr<Outgoing> MakeOutgoing(TopicId topic, bus::DdsParticipant* bus, std::function<void()> notify,
                                       std::uint32_t number) {
  return bus::WithMessageOf(topic, [&]<class T>(std::type_identity<T>) -> std::unique_ptr<Outgoing> {
    auto input = bus->MakeInput<T>(std::move(notify));
    if constexpr (std::is_same_v<T, TissueFrame>) {
      return std::make_unique<OutgoingTissue>(std::move(input), number);
    } else if constexpr (std::is_same_v<T, TemperaturePatch>) {
      return std::make_unique<OutgoingPatches>(std::move(input), number);
    } else if constexpr (std::is_same_v<T, TopologyState>) {
      return std::make_unique<OutgoingTopology>(std::move(input), number);
    } else {
      return std::make_unique<OutgoingSamples<T>>(std::move(input), number);
    }
  });
}

std::unique_ptr<Incoming> MakeIncoming(TopicId topic, bus::DdsParticipant* bus) {
  return bus::WithMessageOf(topic, [&]<class T>(std::type_identity<T>) -> std::unique_ptr<Incoming> {
    auto output = bus->MakeOutput<T>();
    if constexpr (std::is_same_v<T, TissueFrame>) {
      return std::make_unique<IncomingChunks<T, TissueReceiver>>(std::move(output));
    } else if constexpr (std::is_same_v<T, TemperaturePatch>) {
      return std::make_unique<IncomingChunks<T, PatchReceiver>>(std::move(output));
    } else {
      return std::make_unique<IncomingSamples<T>>(std::move(output));
    }
  });
}

}  // namespace fulcrum::link
