#include "services/transport/link/codec/packet.h"

#include <gtest/gtest.h>

#include "services/transport/link/codec/byte_delta.h"

namespace fulcrum::link {
namespace {

using Buffer = std::vector<std::uint8_t>;

Offer SomeOffer() {
  Offer offer;
  offer.session_id = "20260101-120000-small";
  offer.scene_name = "small";
  offer.scene_hash = 42;
  offer.scene_B = 1'000'000;
  offer.scene_checksum = 7;
  offer.nodes = 1u << static_cast<unsigned>(NodeId::kRender);
  offer.cart_yaml = "name: simulated\n";
  offer.withheld = "pedal, devices.tool0.motion";
  return offer;
}

TEST(Packet, EnvelopeComesBackAndAnotherVersionIsTold) {
  Buffer packet;
  PutEnvelope({PacketKind::kTissue, 99, 7}, &packet);
  packet.push_back(5);
  Envelope envelope;
  std::span<const std::uint8_t> body;
  std::uint8_t version = 0;
  ASSERT_TRUE(TakeEnvelope(packet, &envelope, &body, &version));
  EXPECT_EQ(envelope.kind, PacketKind::kTissue);
  EXPECT_EQ(envelope.epoch, 99u);
  EXPECT_EQ(envelope.session, 7u);
  EXPECT_EQ(body.size(), 1u);
  packet[2] = kWireVersion + 1;
  EXPECT_TRUE(TakeEnvelope(packet, &envelope, &body, &version));
  EXPECT_EQ(version, kWireVersion + 1);
  EXPECT_TRUE(body.empty());
  packet[0] = 'X';
  EXPECT_FALSE(TakeEnvelope(packet, &envelope, &body, &version));
}

TEST(Packet, PulseComesBack) {
  Pulse pulse;
  pulse.schema_hash = 1;
  pulse.sent_ns = 2;
  pulse.heard_epoch = 3;
  pulse.heard_sent_ns = 4;
  pulse.heard_ns = 5;
  pulse.wanted = 6;
  pulse.wants_offer = pulse.wants_all_patches = true;
  pulse.missing_tissue = {7, 8};
  pulse.missing_patches = {9};
  Buffer body;
  PutPulse(pulse, &body);
  Pulse got;
  ASSERT_TRUE(TakePulse(body, &got));
  EXPECT_EQ(got.heard_ns, 5);
  EXPECT_EQ(got.wanted, 6u);
  EXPECT_TRUE(got.wants_offer && got.wants_all_patches && !got.wants_all_tissue && !got.wants_all_topology);
  EXPECT_EQ(got.missing_tissue, pulse.missing_tissue);
  EXPECT_EQ(got.missing_patches, pulse.missing_patches);
  pulse.wanted = 1u << kTopicCount;
  body.clear();
  PutPulse(pulse, &body);
  EXPECT_FALSE(TakePulse(body, &got));
}

TEST(Packet, OfferComesBackAndMustBeUsable) {
  Buffer body;
  PutOffer(SomeOffer(), &body);
  Offer got;
  ASSERT_TRUE(TakeOffer(body, &got));
  EXPECT_EQ(got.session_id, SomeOffer().session_id);
  EXPECT_EQ(got.cart_yaml, SomeOffer().cart_yaml);
  EXPECT_EQ(got.withheld, SomeOffer().withheld);
  EXPECT_EQ(got.scene_checksum, 7u);
  const auto refused = [](auto change) {
    Offer offer = SomeOffer();
    change(&offer);
    Buffer bytes;
    PutOffer(offer, &bytes);
    Offer ignored;
    return !TakeOffer(bytes, &ignored);
  };
  EXPECT_TRUE(refused([](Offer* o) { o->session_id = "../../etc"; }));
  EXPECT_TRUE(refused([](Offer* o) { o->session_id = ""; }));
  for (const char* bad : {"../x", "a/b", ".x", "a\x1b[2J",
                          "\xc2\x9b"
                          "2J"}) {
    EXPECT_TRUE(refused([&](Offer* o) { o->session_id = bad; })) << bad;
    EXPECT_TRUE(refused([&](Offer* o) { o->scene_name = bad; })) << bad;
  }
  EXPECT_FALSE(refused([](Offer* o) { o->scene_name = "a scene (2)"; }));
  EXPECT_TRUE(refused([](Offer* o) { o->scene_name.assign(64, 'a'); }));
  EXPECT_TRUE(refused([](Offer* o) { o->withheld = "a\nb"; }));
  EXPECT_TRUE(refused([](Offer* o) { o->withheld.assign(kLongestWithheld_B + 1, 'a'); }));
  EXPECT_TRUE(refused([](Offer* o) { o->scene_B = kLargestScene_B + 1; }));
  EXPECT_TRUE(refused([](Offer* o) { o->scene_B = 0; }));
  EXPECT_TRUE(refused([](Offer* o) { o->nodes = 1u << kNodeCount; }));
  EXPECT_TRUE(refused([](Offer* o) { o->cart_yaml.assign(kLargestCart_B + 1, ' '); }));
}

TEST(Packet, SamplesAndPiecesOfASceneComeBack) {
  Buffer body;
  const Buffer cdr{1, 2, 3};
  PutSample({TopicId::kToolState, 5, 4}, Buffer{1, 2}, cdr, &body);
  SampleHead head;
  std::span<const std::uint8_t> delta;
  ASSERT_TRUE(TakeSample(body, &head, &delta));
  EXPECT_EQ(head.topic, TopicId::kToolState);
  EXPECT_EQ(head.base, 4u);
  Buffer got;
  ASSERT_TRUE(TakeDelta(Buffer{1, 2}, delta, 100, &got));
  EXPECT_EQ(got, cdr);

  body.clear();
  PutSceneChunk({42, 2 * kSceneChunk_B}, cdr, &body);
  SceneAsk where;
  std::span<const std::uint8_t> piece;
  ASSERT_TRUE(TakeSceneChunk(body, &where, &piece));
  EXPECT_EQ(where.offset, 2 * kSceneChunk_B);
  EXPECT_EQ(Buffer(piece.begin(), piece.end()), cdr);
  body.clear();
  PutSceneAsk({42, 17}, &body);
  EXPECT_FALSE(TakeSceneAsk(body, &where));
}

}  // namespace
}  // namespace fulcrum::link
