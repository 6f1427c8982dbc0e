// For any bytes: no crash, no access outside of buffers (the sanitizer builds run this, too), and values that are
// passed on are finite and in range.
#include <gtest/gtest.h>

#include <random>

#include "services/transport/bus/gate.h"
#include "services/transport/link/codec/byte_delta.h"
#include "services/transport/link/codec/packet.h"
#include "tests/unit/link/wire.h"

namespace fulcrum::link {
namespace {

using test::Chunk;
using test::Encode;
using test::Sheet;

/// Truncates the chunk, flips bits, sets bytes to ones or zeros, or extends it.
Chunk Hurt(Chunk chunk, std::mt19937* random) {
  const auto upto = [&](std::size_t n) { return n == 0 ? 0 : (*random)() % n; };
  switch (upto(5)) {
    case 0:
      chunk.resize(upto(chunk.size()));
      break;
    case 1:
      for (std::size_t i = 0; i <= upto(4) && !chunk.empty(); ++i) {
        chunk[upto(chunk.size())] ^= static_cast<std::uint8_t>(1u << upto(8));
      }
      break;
    case 2:
      for (std::size_t at = upto(chunk.size()), i = 0; i < 8 && at + i < chunk.size(); ++i) chunk[at + i] = 0xff;
      break;
    case 3:
      for (std::size_t at = upto(chunk.size()), i = 0; i < 4 && at + i < chunk.size(); ++i) chunk[at + i] = 0;
      break;
    default:
      for (std::size_t i = 0; i < 1 + upto(40); ++i) chunk.push_back(static_cast<std::uint8_t>((*random)()));
  }
  return chunk;
}

constexpr int kRounds = 20'000;

TEST(CodecMutation, Tissue) {
  TissueSender sender;
  std::vector<Chunk> chunks;
  for (std::uint64_t i = 1; i <= 4; ++i) {
    for (Chunk& chunk : Encode(&sender, Sheet(20, 30, 1e-3 * static_cast<double>(i), i))) {
      chunks.push_back(std::move(chunk));
    }
  }
  std::mt19937 random(11);
  TissueReceiver receiver;
  int passed = 0;
  for (int round = 0; round < kRounds; ++round) {
    const Chunk& chunk = chunks[random() % chunks.size()];
    if (receiver.Take(random() % 4 == 0 ? chunk : Hurt(chunk, &random)) != TissueReceiver::Result::kFrame) continue;
    ++passed;
    TissueFrame frame = receiver.frame();
    for (const float x : frame.xyz) ASSERT_LE(std::abs(x), bus::kMaxCoordinate_m);
    ASSERT_EQ(frame.xyz.size(), std::size_t{3} * frame.header.vertex_count);
    ASSERT_TRUE(std::isfinite(frame.header.session_time_s));
  }
  EXPECT_GT(receiver.bad(), 1000u);
  (void)receiver.missing().TakeQuestions(kMostQuestions);
}

TEST(CodecMutation, Patch) {
  PatchSender sender;
  TemperaturePatch patch;
  patch.header.stamp = {1, 1, 1};
  patch.texels.assign(std::size_t{4} * kPatchTexels * kPatchTexels, 3);
  for (std::size_t i = 0; i < 60'000; ++i) patch.texels[i] = static_cast<std::uint8_t>(i * i >> 7);
  const std::vector<Chunk> chunks = Encode(&sender, patch);
  std::mt19937 random(12);
  PatchReceiver receiver;
  for (int round = 0; round < kRounds; ++round) {
    const Chunk& chunk = chunks[random() % chunks.size()];
    if (receiver.Take(random() % 4 == 0 ? chunk : Hurt(chunk, &random)) == PatchReceiver::Result::kFrame) {
      ASSERT_EQ(receiver.patch().texels.size(), patch.texels.size());
      ASSERT_LE(receiver.patch().header.origin_x, static_cast<std::uint32_t>(kAtlasTexels - kPatchTexels));
    }
  }
  EXPECT_GT(receiver.bad(), 1000u);
}

TEST(CodecMutation, PacketsAndDeltas) {
  std::vector<Chunk> packets;
  const auto packet = [&](PacketKind kind, auto put) {
    Chunk bytes;
    PutEnvelope({kind, 5}, &bytes);
    put(&bytes);
    packets.push_back(bytes);
  };
  Pulse pulse;
  pulse.missing_tissue = {1, 2, 3};
  pulse.missing_patches.assign(kMostQuestions, 4);
  Offer offer;
  offer.session_id = "a";
  offer.scene_hash = offer.scene_B = 1;
  offer.nodes = 32;
  offer.cart_yaml.assign(100, 'x');
  packet(PacketKind::kPulse, [&](Chunk* out) { PutPulse(pulse, out); });
  packet(PacketKind::kOffer, [&](Chunk* out) { PutOffer(offer, out); });
  packet(PacketKind::kSample, [&](Chunk* out) {
    PutSample({TopicId::kHealth, 3, 2}, Chunk(50, 1), Chunk(90, 2), out);
  });
  packet(PacketKind::kSceneAsk, [&](Chunk* out) { PutSceneAsk({1, kSceneChunk_B}, out); });
  packet(PacketKind::kSceneChunk, [&](Chunk* out) { PutSceneChunk({1, 0}, Chunk(300, 3), out); });
  std::mt19937 random(13);
  int refused = 0;
  for (int round = 0; round < 5 * kRounds; ++round) {
    const Chunk bytes = Hurt(packets[random() % packets.size()], &random);
    Envelope envelope;
    std::span<const std::uint8_t> body, rest;
    std::uint8_t version = 0;
    if (!TakeEnvelope(bytes, &envelope, &body, &version)) {
      ++refused;
      continue;
    }
    SampleHead head;
    SceneAsk where;
    Chunk got;
    refused += TakePulse(body, &pulse) ? 0 : 1;
    if (TakeOffer(body, &offer)) {
      ASSERT_LE(offer.scene_B, kLargestScene_B);
      ASSERT_EQ(offer.session_id.find('/'), std::string::npos);
    }
    if (TakeSample(body, &head, &rest) && TakeDelta(Chunk(50, 1), rest, 1000, &got)) {
      ASSERT_LE(got.size(), 1000u);
    }
    if (TakeSceneChunk(body, &where, &rest)) {
      ASSERT_LE(rest.size(), kSceneChunk_B);
    }
  }
  EXPECT_GT(refused, kRounds);
}

}  // namespace
}  // namespace fulcrum::link
