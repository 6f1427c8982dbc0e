#include "services/transport/link/codec/packet.h"

#include <algorithm>

#include "services/base/core/hash.h"
#include "services/transport/bus/gate.h"
#include "services/transport/link/codec/bits.h"
#include "services/transport/link/codec/byte_delta.h"

namespace fulcrum::link {
namespace {

constexpr std::uint8_t kMagic[] = {'F', 'L'};

void PutQuestions(const std::vector<std::uint32_t>& chunks, ByteWriter* w) {
  const std::size_t count = std::min(chunks.size(), kMostQuestions);
  w->Number(static_cast<std::uint8_t>(count));
  for (std::size_t i = 0; i < count; ++i) w->Number(chunks[i]);
}
bool TakeQuestions(ByteReader* r, std::vector<std::uint32_t>* chunks) {
  chunks->clear();
  const std::size_t count = r->Number<std::uint8_t>();
  if (count > kMostQuestions) return false;
  for (std::size_t i = 0; i < count && r->good(); ++i) chunks->push_back(r->Number<std::uint32_t>());
  return r->good();
}

bool IsPrintable(const std::string& text) {
  return std::all_of(text.begin(), text.end(), [](char c) { return c >= ' ' && c <= '~'; });
}

}  // namespace

std::uint64_t SessionKeyOf(const std::string& session_id) {
  Hash64 hash;
  hash.Add(std::string_view(session_id));
  return hash.value();
}

bool IsPlainName(const std::string& text, std::size_t longest) {
  return !text.empty() && text.size() <= longest && text[0] != '.' && text.find('/') == std::string::npos &&
         IsPrintable(text);
}

void PutEnvelope(const Envelope& envelope, std::vector<std::uint8_t>* out) {
  ByteWriter w(out);
  w.Bytes(kMagic, sizeof kMagic);
  w.Number(kWireVersion);
  w.Number(static_cast<std::uint8_t>(envelope.kind));
  w.Number(envelope.epoch);
  w.Number(envelope.session);
}

bool TakeEnvelope(std::span<const std::uint8_t> packet, Envelope* envelope, std::span<const std::uint8_t>* body,
                  std::uint8_t* version) {
  ByteReader r(packet);
  const std::span<const std::uint8_t> magic = r.Take(sizeof kMagic);
  *version = r.Number<std::uint8_t>();
  const auto kind = r.Number<std::uint8_t>();
  envelope->epoch = r.Number<std::uint64_t>();
  *body = {};
  if (!r.good() || !std::equal(magic.begin(), magic.end(), std::begin(kMagic))) return false;
  if (*version != kWireVersion) return true;  // Version 1 had no session here.
  envelope->session = r.Number<std::uint64_t>();
  if (!r.good() || kind >= kPacketKinds || envelope->epoch == 0) return false;
  envelope->kind = static_cast<PacketKind>(kind);
  *body = r.Rest();
  return true;
}

void PutPulse(const Pulse& pulse, std::vector<std::uint8_t>* out) {
  ByteWriter w(out);
  w.Number(pulse.schema_hash);
  w.Number(pulse.sent_ns);
  w.Number(pulse.heard_epoch);
  w.Number(pulse.heard_sent_ns);
  w.Number(pulse.heard_ns);
  w.Number(pulse.wanted);
  w.Number(static_cast<std::uint8_t>((pulse.wants_offer ? 1 : 0) | (pulse.wants_all_tissue ? 2 : 0) |
                                     (pulse.wants_all_patches ? 4 : 0) | (pulse.wants_all_topology ? 8 : 0)));
  PutQuestions(pulse.missing_tissue, &w);
  PutQuestions(pulse.missing_patches, &w);
}

bool TakePulse(std::span<const std::uint8_t> body, Pulse* pulse) {
  ByteReader r(body);
  pulse->schema_hash = r.Number<std::uint64_t>();
  pulse->sent_ns = r.Number<std::int64_t>();
  pulse->heard_epoch = r.Number<std::uint64_t>();
  pulse->heard_sent_ns = r.Number<std::int64_t>();
  pulse->heard_ns = r.Number<std::int64_t>();
  pulse->wanted = r.Number<std::uint32_t>();
  const auto flags = r.Number<std::uint8_t>();
  pulse->wants_offer = (flags & 1u) != 0;
  pulse->wants_all_tissue = (flags & 2u) != 0;
  pulse->wants_all_patches = (flags & 4u) != 0;
  pulse->wants_all_topology = (flags & 8u) != 0;
  return r.good() && pulse->wanted >> kTopicCount == 0 && flags >> 4 == 0 &&
         TakeQuestions(&r, &pulse->missing_tissue) && TakeQuestions(&r, &pulse->missing_patches) && r.empty();
}

void PutSample(const SampleHead& head, std::span<const std::uint8_t> base, std::span<const std::uint8_t> cdr,
               std::vector<std::uint8_t>* out) {
  ByteWriter w(out);
  w.Number(static_cast<std::uint8_t>(head.topic));
  w.Number(head.number);
  w.Number(head.base);
  PutDelta(base, cdr, out);
}

bool TakeSample(std::span<const std::uint8_t> body, SampleHead* head, std::span<const std::uint8_t>* delta) {
  ByteReader r(body);
  const auto topic = r.Number<std::uint8_t>();
  head->number = r.Number<std::uint32_t>();
  head->base = r.Number<std::uint32_t>();
  *delta = r.Rest();
  head->topic = static_cast<TopicId>(topic);
  return r.good() && topic < kTopicCount && head->number != 0 && head->base < head->number;
}

void PutOffer(const Offer& offer, std::vector<std::uint8_t>* out) {
  ByteWriter w(out);
  w.Text(offer.session_id);
  w.Text(offer.scene_name);
  w.Number(offer.scene_hash);
  w.Number(offer.scene_B);
  w.Number(offer.scene_checksum);
  w.Number(offer.nodes);
  w.Text(offer.cart_yaml);
  w.Text(offer.withheld);
}

bool TakeOffer(std::span<const std::uint8_t> body, Offer* offer) {
  ByteReader r(body);
  offer->session_id = r.Text();
  offer->scene_name = r.Text();
  offer->scene_hash = r.Number<std::uint64_t>();
  offer->scene_B = r.Number<std::uint64_t>();
  offer->scene_checksum = r.Number<std::uint64_t>();
  offer->nodes = r.Number<std::uint32_t>();
  offer->cart_yaml = r.Text();
  offer->withheld = r.Text();
  return r.good() && r.empty() && IsPlainName(offer->session_id, bus::kMaxSessionId) &&
         IsPlainName(offer->scene_name, bus::kMaxSceneName) && offer->scene_hash != 0 && offer->scene_B > 0 &&
         offer->scene_B <= kLargestScene_B && offer->nodes >> kNodeCount == 0 && offer->nodes != 0 &&
         offer->cart_yaml.size() <= kLargestCart_B && offer->withheld.size() <= kLongestWithheld_B &&
         IsPrintable(offer->withheld);
}

void PutSceneAsk(const SceneAsk& ask, std::vector<std::uint8_t>* out) {
  ByteWriter w(out);
  w.Number(ask.scene_hash);
  w.Number(ask.offset);
}

bool TakeSceneAsk(std::span<const std::uint8_t> body, SceneAsk* ask) {
  ByteReader r(body);
  ask->scene_hash = r.Number<std::uint64_t>();
  ask->offset = r.Number<std::uint64_t>();
  return r.good() && r.empty() && ask->offset < kLargestScene_B && ask->offset % kSceneChunk_B == 0;
}

void PutSceneChunk(const SceneAsk& where, std::span<const std::uint8_t> bytes, std::vector<std::uint8_t>* out) {
  PutSceneAsk(where, out);
  ByteWriter(out).Bytes(bytes.data(), bytes.size());
}

bool TakeSceneChunk(std::span<const std::uint8_t> body, SceneAsk* where, std::span<const std::uint8_t>* bytes) {
  constexpr std::size_t kAsk_B = 16;
  if (body.size() <= kAsk_B || !TakeSceneAsk(body.first(kAsk_B), where)) return false;
  *bytes = body.subspan(kAsk_B);
  return bytes->size() <= kSceneChunk_B;
}

}  // namespace fulcrum::link
