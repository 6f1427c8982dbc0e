// Packets of the other host's link in sequence, each preceded by its length in two bytes. An accepted packet is encoded
// to the same bytes again, and values that are passed on are finite and in range.
#include <cmath>
#include <map>

#include "services/base/config/cart.h"
#include "services/base/core/error.h"
#include "services/transport/bus/convert/cdr.h"
#include "services/transport/bus/gate.h"
#include "services/transport/bus/topics.h"
#include "services/transport/link/codec/byte_delta.h"
#include "services/transport/link/codec/packet.h"
#include "services/transport/link/codec/patch_codec.h"
#include "services/transport/link/codec/tissue_codec.h"
#include "services/transport/link/scene_transfer.h"
#include "tests/fuzz/target.h"
#include "tests/unit/bus/samples.h"
#include "tests/unit/link/wire.h"

namespace fulcrum::fuzz {
namespace {

constexpr std::size_t kLargestSample_B = 128 * 1024;
/// An offer may announce up to 256 MiB, which the receiver provides at once.
constexpr std::uint64_t kLargestFetch_B = 1 << 20;

/// State that one side keeps between packets.
class Receiver {
 public:
  /// False: the packet is invalid.
  bool Take(Input packet) {
    link::Envelope envelope;
    Input body;
    std::uint8_t version = 0;
    if (!TakeEnvelope(packet, &envelope, &body, &version) || version != link::kWireVersion) return false;
    switch (envelope.kind) {
      case link::PacketKind::kPulse:
        return TakePulse(body);
      case link::PacketKind::kSample:
        return TakeSample(body);
      case link::PacketKind::kTissue:
        return TakeTissue(body);
      case link::PacketKind::kPatch:
        return TakePatch(body);
      case link::PacketKind::kOffer:
        return TakeOffer(body);
      case link::PacketKind::kSceneAsk: {
        link::SceneAsk ask;
        return link::TakeSceneAsk(body, &ask);
      }
      case link::PacketKind::kSceneChunk:
        return TakeSceneChunk(body);
      case link::PacketKind::kBye:
        return true;
    }
    throw BrokenPromise("a kind of packet that there is not");
  }

 private:
  static bool TakePulse(Input body) {
    link::Pulse pulse;
    if (!link::TakePulse(body, &pulse)) return false;
    Bytes again;
    PutPulse(pulse, &again);
    Promise(std::equal(again.begin(), again.end(), body.begin(), body.end()), "a pulse is not written as it was read");
    return true;
  }
  bool TakeSample(Input body) {
    link::SampleHead head;
    Input delta;
    if (!link::TakeSample(body, &head, &delta)) return false;
    Bytes& known = samples_[head.topic];
    Bytes bytes;
    if (!link::TakeDelta(head.base == 0 ? Input() : Input(known), delta, kLargestSample_B, &bytes)) return false;
    Promise(bytes.size() <= kLargestSample_B, "a sample larger than the largest");
    known = bytes;
    return bus::WithMessageOf(head.topic, [&]<class T>(std::type_identity<T>) {
      T message;
      return bus::DecodeCdr(bytes, &message) && bus::PassesGate(message);
    });
  }
  bool TakeTissue(Input body) {
    const auto result = tissue_.Take(body);
    if (result == link::TissueReceiver::Result::kFrame) {
      const TissueFrame& frame = tissue_.frame();
      Promise(frame.xyz.size() == std::size_t{3} * frame.header.vertex_count, "a frame with other positions");
      for (const float x : frame.xyz) Promise(std::abs(x) <= bus::kMaxCoordinate_m, "a position far away");
      (void)bus::PassesGate(frame);
    }
    (void)tissue_.missing().TakeQuestions(link::kMostQuestions);
    return result != link::TissueReceiver::Result::kBad;
  }
  bool TakePatch(Input body) {
    const auto result = patches_.Take(body);
    if (result == link::PatchReceiver::Result::kFrame) (void)bus::PassesGate(patches_.patch());
    (void)patches_.missing().TakeQuestions(link::kMostQuestions);
    return result != link::PatchReceiver::Result::kBad;
  }
  bool TakeOffer(Input body) {
    link::Offer offer;
    if (!link::TakeOffer(body, &offer)) return false;
    Bytes again;
    PutOffer(offer, &again);
    Promise(std::equal(again.begin(), again.end(), body.begin(), body.end()), "an offer is not written as it was read");
    Promise(offer.session_id.find('/') == std::string::npos, "a session's name that is a path");
    try {
      (void)config::LoadCartText(offer.cart_yaml, "the offered cart");
    } catch (const InputError&) {
      return false;
    }
    fetch_.reset();
    if (offer.scene_B <= kLargestFetch_B) fetch_ = std::make_unique<link::SceneFetch>(offer);
    return true;
  }
  bool TakeSceneChunk(Input body) {
    link::SceneAsk where;
    Input bytes;
    if (!link::TakeSceneChunk(body, &where, &bytes)) return false;
    if (!fetch_) return true;
    (void)fetch_->TakeAsks(0);
    const bool taken = fetch_->Take(where, bytes);
    if (fetch_->complete()) (void)fetch_->checksum_ok();
    return taken;
  }

  std::map<TopicId, Bytes> samples_;
  link::TissueReceiver tissue_;
  link::PatchReceiver patches_;
  std::unique_ptr<link::SceneFetch> fetch_;
};

void Append(const Bytes& packet, Bytes* all) {
  all->push_back(static_cast<std::uint8_t>(packet.size() & 0xffu));
  all->push_back(static_cast<std::uint8_t>(packet.size() >> 8));
  all->insert(all->end(), packet.begin(), packet.end());
}

/// One packet: its head, then the bytes that `put` appends.
template <class Put>
void AppendPacket(link::PacketKind kind, Bytes* all, const Put& put) {
  Bytes packet;
  link::PutEnvelope({kind, 5}, &packet);
  put(&packet);
  Append(packet, all);
}

class Link final : public Target {
 public:
  Outcome Offer(Input input) override {
    Receiver receiver;
    bool all_good = input.size() >= 2;
    while (input.size() >= 2) {
      const std::size_t size = std::min<std::size_t>(input[0] + 256u * input[1], input.size() - 2);
      all_good = receiver.Take(input.subspan(2, size)) && all_good;
      input = input.subspan(2 + size);
    }
    return all_good ? Outcome::kAccepted : Outcome::kRefused;
  }

  std::vector<Seed> Seeds() override {
    return {{"pulse", Pulses()},
            {"samples", Samples<TickManifest>()},
            {"handles", Samples<HandleState>()},
            {"tissue", Tissue()},
            {"patch", TemperaturePatches()},
            {"scene", Scene()},
            {"bye", Plain(link::PacketKind::kBye)}};
  }

 private:
  static Bytes Plain(link::PacketKind kind) {
    Bytes all;
    AppendPacket(kind, &all, [](Bytes*) {});
    return all;
  }
  static Bytes Pulses() {
    Bytes all;
    link::Pulse pulse;
    pulse.wanted = 3;
    pulse.missing_tissue = {1, 2};
    AppendPacket(link::PacketKind::kPulse, &all, [&](Bytes* packet) { PutPulse(pulse, packet); });
    return all;
  }
  /// A whole message, then one as the difference from it.
  template <class T>
  static Bytes Samples() {
    Bytes all, base;
    for (std::uint32_t number = 1; number <= 2; ++number) {
      Bytes cdr;
      (void)bus::EncodeCdr(bus::test::Sample<T>(number), &cdr);
      AppendPacket(link::PacketKind::kSample, &all, [&](Bytes* packet) {
        link::PutSample({bus::kTopicOf<T>, number, number - 1}, base, cdr, packet);
      });
      base = cdr;
    }
    return all;
  }
  static Bytes Tissue() {
    Bytes all;
    link::TissueSender sender;
    for (std::uint64_t i = 1; i <= 2; ++i) {
      for (const auto& chunk : link::test::Encode(&sender, link::test::Sheet(5, 8, 1e-3 * static_cast<double>(i), i))) {
        AppendPacket(link::PacketKind::kTissue, &all,
                     [&](Bytes* packet) { packet->insert(packet->end(), chunk.begin(), chunk.end()); });
      }
    }
    return all;
  }
  static Bytes TemperaturePatches() {
    Bytes all;
    link::PatchSender sender;
    TemperaturePatch patch;
    patch.header.stamp = {1, 1, 1};
    patch.texels.assign(std::size_t{4} * kPatchTexels * kPatchTexels, 3);
    for (const auto& chunk : link::test::Encode(&sender, patch)) {
      AppendPacket(link::PacketKind::kPatch, &all,
                   [&](Bytes* packet) { packet->insert(packet->end(), chunk.begin(), chunk.end()); });
    }
    return all;
  }
  static Bytes Scene() {
    Bytes all;
    const Bytes file(100, 7);
    AppendPacket(link::PacketKind::kOffer, &all, [&](Bytes* packet) {
      link::PutOffer({"20260101-120000", "small", 9, file.size(), 1, 2, "name: lab\n", {}}, packet);
    });
    AppendPacket(link::PacketKind::kSceneAsk, &all, [&](Bytes* packet) { link::PutSceneAsk({9, 0}, packet); });
    AppendPacket(link::PacketKind::kSceneChunk, &all, [&](Bytes* packet) {
      link::PutSceneChunk({9, 0}, file, packet);
    });
    return all;
  }
};

}  // namespace

std::unique_ptr<Target> MakeLink() { return std::make_unique<Link>(); }

}  // namespace fulcrum::fuzz
