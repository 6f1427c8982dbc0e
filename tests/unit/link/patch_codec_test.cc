#include "services/transport/link/codec/patch_codec.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/link/wire.h"

namespace fulcrum::link {
namespace {

using test::Bytes;
using test::Chunk;
using test::Encode;
using Result = PatchReceiver::Result;

/// A hot spot of `radius` texels about the middle.
TemperaturePatch Spot(std::uint64_t slot, double radius, std::uint64_t sequence) {
  TemperaturePatch patch;
  patch.header.stamp = {sequence, 9, static_cast<std::int64_t>(sequence)};
  patch.header.slot = static_cast<std::uint16_t>(slot);
  patch.header.origin_x = 512;
  patch.header.origin_y = 256;
  patch.header.max_temperature_C = 80;
  for (int y = 0; y < kPatchTexels; ++y) {
    for (int x = 0; x < kPatchTexels; ++x) {
      const double d = std::hypot(x - 128, y - 128) / radius;
      const double heat = d < 2 ? std::exp(-d * d) - std::exp(-4.0) : 0;
      for (const double value : {34 + 150 * heat, 255 * heat, 128 * heat, d < 0.2 ? 0.0 : 255.0}) {
        patch.texels.push_back(static_cast<std::uint8_t>(value));
      }
    }
  }
  return patch;
}

TEST(PatchCodec, TexelsArriveAsTheyAre) {
  PatchSender sender;
  PatchReceiver receiver;
  for (std::uint64_t i = 1; i <= 10; ++i) {
    const TemperaturePatch patch = Spot(i % 3, 10 + 2.0 * static_cast<double>(i), i);
    Result last = Result::kBad;
    for (const Chunk& chunk : Encode(&sender, patch)) {
      EXPECT_LE(chunk.size(), kChunk_B);
      last = receiver.Take(chunk);
    }
    ASSERT_EQ(last, Result::kFrame) << i;
    EXPECT_EQ(receiver.patch().texels, patch.texels);
    EXPECT_EQ(receiver.patch().header.slot, patch.header.slot);
    EXPECT_EQ(receiver.patch().header.origin_x, patch.header.origin_x);
    EXPECT_EQ(receiver.patch().header.stamp.sequence, i);
  }
}

TEST(PatchCodec, OnlyWhatChangedIsTold) {
  PatchSender sender;
  const std::size_t first = Bytes(Encode(&sender, Spot(0, 20, 1)));
  EXPECT_LT(first, 40'000u);
  EXPECT_LT(Bytes(Encode(&sender, Spot(0, 20, 2))), 1500u);
  const std::size_t grown = Bytes(Encode(&sender, Spot(0, 21, 3)));
  EXPECT_GT(grown, 1500u);
  EXPECT_LT(grown, first);
}

TEST(PatchCodec, NoiseFits) {
  PatchSender sender;
  PatchReceiver receiver;
  TemperaturePatch patch = Spot(1, 20, 1);
  std::mt19937 random(3);
  for (std::uint8_t& texel : patch.texels) texel = static_cast<std::uint8_t>(random());
  Result last = Result::kBad;
  for (const Chunk& chunk : Encode(&sender, patch)) {
    EXPECT_LE(chunk.size(), kChunk_B);
    last = receiver.Take(chunk);
  }
  ASSERT_EQ(last, Result::kFrame);
  EXPECT_EQ(receiver.patch().texels, patch.texels);
}

TEST(PatchCodec, HealsFromLossWithoutAnotherPatch) {
  PatchSender sender;
  PatchReceiver receiver;
  const TemperaturePatch patch = Spot(0, 40, 1);
  std::vector<Chunk> chunks = Encode(&sender, patch);
  ASSERT_GT(chunks.size(), 3u);
  chunks.erase(chunks.begin() + 1);
  for (const Chunk& chunk : chunks) EXPECT_EQ(receiver.Take(chunk), Result::kPart);
  for (const std::uint32_t chunk : receiver.missing().TakeQuestions(8)) sender.Repeat(chunk);
  Result last = Result::kBad;
  sender.Flush([&](std::span<const std::uint8_t> chunk) { last = receiver.Take(chunk); });
  ASSERT_EQ(last, Result::kFrame);
  EXPECT_EQ(receiver.patch().texels, patch.texels);
}

TEST(PatchCodec, ASlotThatChangesItsSurfaceBeginsAnew) {
  PatchSender sender;
  PatchReceiver receiver;
  std::uint64_t sequence = 0;
  for (const BurntSurface surface : {BurntSurface::kMembrane, BurntSurface::kSolids, BurntSurface::kMembrane}) {
    TemperaturePatch patch = Spot(2, surface == BurntSurface::kSolids ? 30 : 12, ++sequence);
    patch.header.surface = surface;
    Result last = Result::kBad;
    for (const Chunk& chunk : Encode(&sender, patch)) last = receiver.Take(chunk);
    ASSERT_EQ(last, Result::kFrame);
    EXPECT_EQ(receiver.patch().header.surface, surface);
    EXPECT_EQ(receiver.patch().texels, patch.texels);
  }
}

TEST(PatchCodec, ASlotThatMovesBeginsAnew) {
  PatchSender sender;
  PatchReceiver receiver;
  for (const Chunk& chunk : Encode(&sender, Spot(2, 30, 1))) (void)receiver.Take(chunk);
  TemperaturePatch moved = Spot(2, 12, 2);
  moved.header.origin_x = 768;
  Result last = Result::kBad;
  for (const Chunk& chunk : Encode(&sender, moved)) last = receiver.Take(chunk);
  ASSERT_EQ(last, Result::kFrame);
  EXPECT_EQ(receiver.patch().texels, moved.texels);
  EXPECT_EQ(receiver.patch().header.origin_x, 768u);
}

TEST(PatchCodec, AReplacedSenderContinuesTheNumbers) {
  PatchReceiver receiver;
  std::uint32_t chunks = 0;
  for (std::uint64_t sequence = 1; sequence <= 20; ++sequence) {
    PatchSender sender(chunks);
    const TemperaturePatch patch = Spot(0, 10 + static_cast<double>(sequence), sequence);
    Result last = Result::kBad;
    for (const Chunk& chunk : Encode(&sender, patch)) last = receiver.Take(chunk);
    ASSERT_EQ(last, Result::kFrame) << sequence;
    EXPECT_EQ(receiver.patch().texels, patch.texels);
    EXPECT_GT(sender.chunks(), chunks);
    chunks = sender.chunks();
  }
  EXPECT_EQ(receiver.missing().lost(), 0u);
}

}  // namespace
}  // namespace fulcrum::link
