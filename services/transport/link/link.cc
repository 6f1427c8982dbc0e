#include "services/transport/link/link.h"

#include <algorithm>
#include <chrono>
#include <fstream>
#include <utility>

#include "services/base/core/error.h"
#include "services/base/core/tick.h"
#include "services/base/runtime/cyclic_thread.h"
#include "services/transport/bus/access.h"
#include "services/transport/bus/schema.h"
#include "services/transport/bus/topics.h"

namespace fulcrum::link {
namespace {

using bus::FarLane;
using runtime::MonotonicNs;

constexpr std::int64_t kMilli = 1'000'000;
constexpr std::int64_t kPulsePeriod = 50 * kMilli;
// After this time without a pulse the other side counts as disconnected and has missed what was sent.
constexpr std::int64_t kSilence = kSecond_ns;
// A cable that is reconnected within the lease of the participants needs no action. After about the lease, one side may
// have dropped the other but not vice versa, and the library takes long to repair that. New participants match at once.
constexpr std::int64_t kPatience = 3 * kSecond_ns;
constexpr std::int64_t kUnplugged = 200 * kMilli;  ///< Between two looks at an interface without a cable.
// A topic is carried on for this long after its last reader has left, because the reader may be restarting.
constexpr std::int64_t kUnwanted = 2 * kSecond_ns;
constexpr std::int64_t kLongestSleep = 20 * kMilli;
// Pieces of the scene that are sent per pulse: twice what SceneFetch requests. A request without answer is repeated.
constexpr int kMostPieces = 16;
constexpr std::uint32_t kAllNodes = (1u << kNodeCount) - 1;

constexpr std::size_t At(TopicId topic) { return static_cast<std::size_t>(topic); }
constexpr std::uint32_t BitOf(std::size_t topic) { return 1u << topic; }

}  // namespace

Link::Link(const LinkSettings& settings)
    : settings_(settings), epoch_(static_cast<std::uint64_t>(MonotonicNs())), refused_(settings.far.peer) {
  context_.picture_rate_Hz = settings.picture_rate_Hz;
  context_.side.here = settings.far.side;
  if (settings.offer) session_key_ = SessionKeyOf(settings.offer->session_id);
  context_.send = [this](FarLane lane, PacketKind kind, const std::function<void(std::vector<std::uint8_t>*)>& put) {
    return Send(lane, kind, put);
  };
  Connect();
  thread_ = std::jthread([this](const std::stop_token& stop) { Run(stop); });
}

Link::~Link() {
  thread_.request_stop();
  inbox_.Wake();
  thread_.join();
  far_.reset();
}

void Link::Connect() {
  if (far_) {
    refused_.Add(far_->refusals());
    dropped_ += far_->dropped();
  }
  far_.reset();
  connected_ns_ = MonotonicNs();
  bus::FarSettings far = settings_.far;
  // While the cable is disconnected the route can lead to another network.
  if (far.follows_route) far.address = bus::AddressTowards(far.peer);
  if (bus::IsUnplugged(far.address)) {
    error_ = "the interface with the address " + far.address + " is down or has no cable";
    return;
  }
  error_.clear();
  far_ = std::make_unique<bus::FarParticipant>(
      far, [this](FarLane lane, std::span<const std::uint8_t> bytes) { inbox_.Put(lane, bytes, MonotonicNs()); });
  connected_ns_ = MonotonicNs();  // Making a participant with keys can take a while.
}

void Link::Join(bus::DdsParticipant* local, std::uint32_t far_nodes) {
  const std::lock_guard lock(mutex_);
  local_ = local;
  context_.side.native = kAllNodes & ~far_nodes;
  joined_session_ = session_key_;
  context_.for_pictures = (far_nodes & kAllNodes) == 1u << static_cast<unsigned>(NodeId::kRender);
  for (std::size_t topic = 0; topic < channels_.size(); ++topic) {
    if (!context_.side.MayArrive(static_cast<TopicId>(topic))) continue;
    channels_[topic].in = MakeIncoming(static_cast<TopicId>(topic), local);
  }
}

void Link::Leave() {
  const std::lock_guard lock(mutex_);
  for (Channel& channel : channels_) channel = Channel();
  local_ = nullptr;
  joined_session_ = 0;
}

void Link::SendBye() {
  const std::lock_guard lock(mutex_);
  bye_ = true;
  next_pulse_ns_ = 0;
  inbox_.Wake();
}

LinkStatus Link::status() {
  const std::lock_guard lock(mutex_);
  const std::int64_t now = MonotonicNs();
  LinkStatus status = rates_;
  status.connected = heard_ns_ != 0 && now - heard_ns_ < kSilence;
  status.silence_s = 1e-9 * static_cast<double>(now - (heard_ns_ != 0 ? heard_ns_ : connected_ns_));
  status.known = clock_.known();
  if (clock_.known()) {
    status.offset_us = 1e-3 * static_cast<double>(clock_.OffsetAt(now));
    status.round_trip_us = 1e-3 * static_cast<double>(clock_.delay_ns());
    status.drift_ppm = clock_.drift_ppm();
  }
  for (const Channel& channel : channels_) status.lost += channel.in ? channel.in->lost() : 0;
  status.lost += overflowed_;
  status.insecure = settings_.far.keys.empty();
  status.refused = refused_.count() + dropped_ + (far_ ? far_->dropped() : 0);
  status.rebuilt = rebuilt_;
  status.error = !mismatch_.empty() ? mismatch_
                 : !error_.empty()  ? error_
                 : heard_ns_ == 0   ? "the other host " + settings_.far.peer + " has not answered yet in link domain " +
                                        std::to_string(settings_.far.domain)
                 : !status.connected ? "the other host " + settings_.far.peer +
                                           " does not answer; check the cable and the link on that host"
                                     : std::string();
  return status;
}

Link::Session Link::session() {
  const std::lock_guard lock(mutex_);
  return session_;
}

std::string Link::mismatch() {
  const std::lock_guard lock(mutex_);
  // A side that was heard before has the right keys: a handshake that does not finish is retried.
  return !mismatch_.empty() || !far_ || heard_ns_ != 0 ? mismatch_ : far_->mismatch();
}

bus::Refusals Link::refusals() {
  const std::lock_guard lock(mutex_);
  if (far_) refused_.Add(far_->refusals());
  return refused_.named();
}

bool Link::FetchScene(const Offer& offer, const std::filesystem::path& cache, double* progress) {
  if (IsScene(CachedScene(cache, offer.scene_hash), offer.scene_hash)) return true;
  const std::lock_guard lock(mutex_);
  if (!fetch_ || fetch_->scene_hash() != offer.scene_hash) fetch_.emplace(offer);
  *progress = fetch_->progress();
  if (!fetch_->complete()) return false;
  const SceneFetch fetched = std::move(*fetch_);
  fetch_.reset();
  StoreScene(fetched, cache);
  return true;
}

// ------------------------------------------------------------------------------------------------------- the thread

void Link::Run(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    std::int64_t due = 0;
    {
      const std::lock_guard lock(mutex_);
      TakePackets(MonotonicNs());
      const std::int64_t now = MonotonicNs();
      WatchSilence(now);
      SendPulse(now);
      CountRates(now);
      due = std::min({PumpChannels(now), next_pulse_ns_, now + kLongestSleep});
    }
    inbox_.WaitUntil(due);
  }
}

void Link::TakePackets(std::int64_t now) {
  const Inbox::Content inbox = inbox_.Take();
  overflowed_ += inbox.overflowed;
  context_.now_ns = now;
  context_.offset_ns = clock_.OffsetAt(now);
  for (const Inbox::Packet& packet : inbox.packets) Take(packet);
  if (!clock_.known()) return;
  for (const Channel& channel : channels_) {
    if (channel.in) channel.in->Follow(&context_);
  }
}

bool Link::IsOfSession(const Envelope& envelope) const {
  switch (envelope.kind) {
    case PacketKind::kOffer:
      return true;  // Begins a session.
    case PacketKind::kPulse:
      // A host that has not joined a session has none yet.
      return session_key_ == 0 || envelope.session == 0 || envelope.session == session_key_;
    default:
      return session_key_ == 0 || envelope.session == session_key_;
  }
}

bool Link::IsOfPeer(std::uint64_t epoch, std::int64_t now) {
  if (epoch == their_epoch_) return true;
  // An older epoch belongs to a link that was restarted meanwhile. But after a reboot of the host its clock starts at 0
  // again.
  const bool back_in_time = epoch < their_epoch_;
  if (back_in_time && now - heard_ns_ < kSilence) return false;
  if (back_in_time) context_.epochs = EpochMap();
  their_epoch_ = epoch;
  clock_ = ClockFilter();
  heard_sent_ns_ = heard_pulse_ns_ = 0;
  proved_ = proved_ && settings_.far.side == bus::FarSide::kCart;
  wished_ = 0;
  for (Channel& channel : channels_) {
    if (channel.in) channel.in->Restart();
  }
  return true;
}

void Link::Take(const Inbox::Packet& packet) {
  traffic_.received_B += packet.bytes.size();
  Envelope envelope;
  std::span<const std::uint8_t> body;
  std::uint8_t version = 0;
  if (!TakeEnvelope(packet.bytes, &envelope, &body, &version)) {
    refused_.Count();
    return;
  }
  if (version != kWireVersion) {
    if (proved_) return refused_.Foreign("packets of version " + std::to_string(version) + " of the link");
    mismatch_ = "link mismatch: the other host uses version " + std::to_string(version) + " of the link, this one " +
                std::to_string(kWireVersion) + "; use the same release on both hosts";
    return;
  }
  if (!IsOfPeer(envelope.epoch, packet.heard_ns)) {
    refused_.Count();
    return;
  }
  if (!IsOfSession(envelope)) {
    refused_.Count();
    // The cart may have begun another session, which its offer names.
    asks_offer_ = settings_.far.side == bus::FarSide::kHost;
    if (envelope.kind != PacketKind::kPulse) return;
  }
  switch (envelope.kind) {
    case PacketKind::kPulse:
      return TakePulse(body, packet.heard_ns);
    case PacketKind::kSample:
    case PacketKind::kTissue:
    case PacketKind::kPatch:
      return TakeChannel(envelope.kind, body);
    case PacketKind::kOffer:
      return TakeOffer(envelope, body);
    case PacketKind::kSceneAsk:
      return ServeScene(body);
    case PacketKind::kSceneChunk: {
      SceneAsk where;
      std::span<const std::uint8_t> bytes;
      const bool host = settings_.far.side == bus::FarSide::kHost;
      // A piece that was requested twice can arrive when the scene is complete.
      if (!host || !TakeSceneChunk(body, &where, &bytes) || (fetch_ && !fetch_->Take(where, bytes))) refused_.Count();
      return;
    }
    case PacketKind::kBye:
      if (settings_.far.side != bus::FarSide::kHost) return refused_.Foreign("an end of the session");
      session_.over = session_.number != 0;
      return;
  }
}

void Link::TakePulse(std::span<const std::uint8_t> body, std::int64_t heard_ns) {
  Pulse pulse;
  if (!link::TakePulse(body, &pulse)) {
    refused_.Count();
    return;
  }
  if (pulse.schema_hash != bus::SchemaHash()) {
    if (proved_) return refused_.Foreign("pulses with another schema");
    mismatch_ = "schema mismatch: the other host uses other topics; use the same release on both hosts";
    return;
  }
  const bool back = heard_ns_ != 0 && heard_ns - heard_ns_ > kSilence;
  heard_ns_ = heard_pulse_ns_ = heard_ns;
  proved_ = true;
  attempts_ = 0;
  heard_sent_ns_ = pulse.sent_ns;
  if (pulse.heard_epoch == epoch_ && pulse.heard_sent_ns != 0) {
    clock_.Add({pulse.heard_sent_ns, pulse.heard_ns, pulse.sent_ns, heard_ns});
    context_.offset_ns = clock_.OffsetAt(context_.now_ns);
  }
  if (local_ != nullptr) FollowWishes(pulse.wanted, heard_ns);
  for (std::size_t topic = 0; topic < channels_.size(); ++topic) {
    Outgoing* out = channels_[topic].out.get();
    if (out == nullptr) continue;
    const auto id = static_cast<TopicId>(topic);
    if (back || (id == TopicId::kTissueFrame && pulse.wants_all_tissue) ||
        (id == TopicId::kTemperaturePatch && pulse.wants_all_patches) ||
        (id == TopicId::kTopologyState && pulse.wants_all_topology)) {
      out->Repeat();
    }
    if (id == TopicId::kTissueFrame) out->Repeat(pulse.missing_tissue);
    if (id == TopicId::kTemperaturePatch) out->Repeat(pulse.missing_patches);
  }
  // A host that was started while this session ends waits for the next one.
  if (pulse.wants_offer && settings_.offer && !bye_ && allowance_.offers > 0) {
    --allowance_.offers;
    (void)Send(FarLane::kOrdered, PacketKind::kOffer,
               [this](std::vector<std::uint8_t>* out) { PutOffer(*settings_.offer, out); });
  }
}

void Link::TakeChannel(PacketKind kind, std::span<const std::uint8_t> body) {
  TopicId topic = kind == PacketKind::kTissue ? TopicId::kTissueFrame : TopicId::kTemperaturePatch;
  if (kind == PacketKind::kTissue) traffic_.tissue_B += body.size();
  if (kind == PacketKind::kSample) {
    SampleHead head;
    std::span<const std::uint8_t> ignored;
    if (!TakeSample(body, &head, &ignored) || KindOf(head.topic) != PacketKind::kSample) {
      refused_.Count();
      return;
    }
    topic = head.topic;
  }
  const std::string label(bus::TopicLabel(topic));
  if (!context_.side.MayArrive(topic)) return refused_.Foreign(label);
  // Without the offset the stamp would be of another clock; no topic has been requested yet either. Nor for a session
  // that was not joined.
  if (!clock_.known() || session_key_ != joined_session_) return;
  Incoming* in = channels_[At(topic)].in.get();
  switch (in == nullptr ? Taken::kBad : in->Take(body, &context_)) {
    case Taken::kYes:
      return;
    case Taken::kBad:
      refused_.Count();
      return;
    case Taken::kForeign: {
      const NodeId node = in->foreigner();
      const bool known = static_cast<unsigned>(node) < static_cast<unsigned>(kNodeCount);
      return refused_.Foreign(label + " of " + (known ? NodeName(node) : "an unknown node"));
    }
  }
}

void Link::TakeOffer(const Envelope& envelope, std::span<const std::uint8_t> body) {
  if (settings_.far.side != bus::FarSide::kHost) return refused_.Foreign("an offer of a session");
  Offer offer;
  if (!link::TakeOffer(body, &offer) || envelope.session != SessionKeyOf(offer.session_id)) {
    refused_.Count();
    return;
  }
  if (session_.number == 0 || offer.session_id != session_.offer.session_id) {
    ++session_.number;
    session_.over = false;
  }
  session_key_ = envelope.session;
  asks_offer_ = false;
  session_.offer = std::move(offer);
}

void Link::ServeScene(std::span<const std::uint8_t> body) {
  if (settings_.offer && allowance_.pieces <= 0) return;  // Requested again after a second.
  --allowance_.pieces;
  SceneAsk ask;
  if (!TakeSceneAsk(body, &ask) || !settings_.offer || ask.scene_hash != settings_.offer->scene_hash ||
      ask.offset >= settings_.offer->scene_B) {
    refused_.Count();
    return;
  }
  std::ifstream stream(settings_.scene, std::ios::binary);
  std::vector<char> piece(std::min<std::uint64_t>(kSceneChunk_B, settings_.offer->scene_B - ask.offset));
  stream.seekg(static_cast<std::streamoff>(ask.offset));
  if (!stream.read(piece.data(), static_cast<std::streamsize>(piece.size()))) {
    error_ = settings_.scene.string() + ": can no longer be read";
    return;
  }
  (void)Send(FarLane::kOrdered, PacketKind::kSceneChunk, [&](std::vector<std::uint8_t>* out) {
    PutSceneChunk(ask, {reinterpret_cast<const std::uint8_t*>(piece.data()), piece.size()}, out);
  });
}

void Link::FollowWishes(std::uint32_t wanted, std::int64_t now) {
  for (std::size_t topic = 0; topic < channels_.size(); ++topic) {
    Channel& channel = channels_[topic];
    if ((wanted & BitOf(topic)) != 0) {
      channel.unwanted_since_ns = 0;
      // A new reader on the other host has not received the earlier samples.
      if (channel.out != nullptr && (wished_ & BitOf(topic)) == 0) channel.out->Repeat();
      if (channel.out == nullptr && context_.side.MayLeave(static_cast<TopicId>(topic))) {
        channel.out = MakeOutgoing(
            static_cast<TopicId>(topic), local_, [this] { inbox_.Wake(); }, channel.number);
      }
    } else if (channel.out != nullptr) {
      if (channel.unwanted_since_ns == 0) channel.unwanted_since_ns = now;
      if (now - channel.unwanted_since_ns <= kUnwanted) continue;
      channel.number = channel.out->number();
      channel.out.reset();
    }
  }
  wished_ = wanted;
}

std::int64_t Link::PumpChannels(std::int64_t now) {
  context_.now_ns = now;
  std::int64_t due = now + kLongestSleep;
  for (Channel& channel : channels_) {
    if (channel.out != nullptr) due = std::min(due, channel.out->Pump(&context_));
  }
  return due;
}

bool Link::IsWanted(TopicId topic, const Incoming& in) const {
  // Both sides send Health, and our own input reads our own output, so the existence of a reader proves nothing.
  return topic == TopicId::kHealth || in.wanted();
}

void Link::SendPulse(std::int64_t now) {
  if (now < next_pulse_ns_) return;
  next_pulse_ns_ = now + kPulsePeriod;
  allowance_ = {.offers = 1, .pieces = kMostPieces};
  Pulse pulse;
  pulse.schema_hash = bus::SchemaHash();
  pulse.heard_epoch = their_epoch_;
  pulse.heard_sent_ns = heard_sent_ns_;
  pulse.heard_ns = heard_pulse_ns_;
  pulse.wants_offer = settings_.far.side == bus::FarSide::kHost && (session_.number == 0 || asks_offer_);
  for (std::size_t topic = 0; topic < channels_.size() && clock_.known(); ++topic) {
    Channel& channel = channels_[topic];
    const auto id = static_cast<TopicId>(topic);
    if (channel.in == nullptr || !IsWanted(id, *channel.in)) continue;
    pulse.wanted |= BitOf(topic);
    if (id == TopicId::kTissueFrame) {
      pulse.wants_all_tissue = channel.in->TakeAll();
      pulse.missing_tissue = channel.in->TakeQuestions();
    } else if (id == TopicId::kTemperaturePatch) {
      pulse.wants_all_patches = channel.in->TakeAll();
      pulse.missing_patches = channel.in->TakeQuestions();
    } else if (id == TopicId::kTopologyState) {
      pulse.wants_all_topology = channel.in->TakeAll();
    }
  }
  (void)Send(FarLane::kStream, PacketKind::kPulse, [&](std::vector<std::uint8_t>* out) {
    pulse.sent_ns = MonotonicNs();
    PutPulse(pulse, out);
  });
  if (bye_) (void)Send(FarLane::kOrdered, PacketKind::kBye, [](std::vector<std::uint8_t>*) {});
  if (!fetch_) return;
  for (const SceneAsk& ask : fetch_->TakeAsks(now)) {
    (void)Send(FarLane::kOrdered, PacketKind::kSceneAsk,
               [&](std::vector<std::uint8_t>* out) { PutSceneAsk(ask, out); });
  }
}

void Link::WatchSilence(std::int64_t now) {
  // A side that never answered may be one that is being refused, which takes longer to detect. All attempts
  // but the first get twice the time: on a busy machine a handshake can take longer than kPatience, and the two sides
  // would end each other's handshakes for good.
  const std::int64_t patience = heard_ns_ == 0 || attempts_ > 0 ? 2 * kPatience : kPatience;
  if (now - std::max(heard_ns_, connected_ns_) < (far_ ? patience : kUnplugged)) return;
  try {
    Connect();
    if (!far_) return;
    ++attempts_;
    rebuilt_ += heard_ns_ != 0 ? 1 : 0;
  } catch (const std::exception& error) {
    error_ = error.what();  // The interface may be down: retried.
  }
}

void Link::CountRates(std::int64_t now) {
  const double elapsed_s = 1e-9 * static_cast<double>(now - rates_ns_);
  if (elapsed_s < 1) return;
  const auto rate = [&](std::uint64_t Traffic::*bytes) {
    return 1e-3 * static_cast<double>(traffic_.*bytes - traffic_before_.*bytes) / elapsed_s;
  };
  rates_.sent_kB_per_s = rate(&Traffic::sent_B);
  rates_.received_kB_per_s = rate(&Traffic::received_B);
  rates_.tissue_kB_per_s = rate(&Traffic::tissue_B);
  traffic_before_ = traffic_;
  rates_ns_ = now;
}

bool Link::Send(FarLane lane, PacketKind kind, const std::function<void(std::vector<std::uint8_t>*)>& put) {
  if (far_ == nullptr) return false;
  packet_.clear();
  PutEnvelope({kind, epoch_, session_key_}, &packet_);
  put(&packet_);
  traffic_.sent_B += packet_.size();
  if (kind == PacketKind::kTissue) traffic_.tissue_B += packet_.size();
  return far_->Send(lane, packet_);
}

}  // namespace fulcrum::link
