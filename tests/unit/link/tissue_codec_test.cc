#include "services/transport/link/codec/tissue_codec.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/unit/link/wire.h"

namespace fulcrum::link {
namespace {

using test::Bytes;
using test::Chunk;
using test::Encode;
using test::ErrorOf;
using test::Sheet;
using Result = TissueReceiver::Result;

constexpr int kRows = 120, kCols = 160;  // About the paper's scene.

TEST(TissueCodec, PositionsArriveWithinTheStatedError) {
  TissueSender sender;
  TissueReceiver receiver;
  for (std::uint64_t i = 1; i <= 60; ++i) {
    const TissueFrame frame = Sheet(kRows, kCols, 1.3e-4 * static_cast<double>(i), i);
    Result last = Result::kBad;
    for (const Chunk& chunk : Encode(&sender, frame)) {
      EXPECT_LE(chunk.size(), kChunk_B);
      last = receiver.Take(chunk);
    }
    ASSERT_EQ(last, Result::kFrame) << i;
    EXPECT_LE(ErrorOf(receiver.frame(), frame), kTissueError_m);
    EXPECT_EQ(receiver.frame().header.stamp.sequence, i);
    EXPECT_EQ(receiver.frame().header.session_time_s, frame.header.session_time_s);
  }
  EXPECT_EQ(receiver.missing().lost(), 0u);
}

TEST(TissueCodec, TheStatedErrorIsReachedAndNotMuchMore) {
  // A vertex that creeps keeps its sent position until it is kTissueSlack steps away.
  TissueSender sender;
  TissueReceiver receiver;
  double worst = 0;
  for (std::uint64_t i = 1; i <= 200; ++i) {
    TissueFrame frame = Sheet(4, 8, 0, i);
    for (float& x : frame.xyz) x += static_cast<float>(0.1e-6 * static_cast<double>(i));
    for (const Chunk& chunk : Encode(&sender, frame)) (void)receiver.Take(chunk);
    worst = std::max(worst, ErrorOf(receiver.frame(), frame));
  }
  EXPECT_LE(worst, kTissueError_m);
  EXPECT_GT(worst, 0.5 * kTissueError_m);
}

TEST(TissueCodec, WhatDoesNotMoveCostsLittle) {
  TissueSender sender;
  const std::size_t first = Bytes(Encode(&sender, Sheet(kRows, kCols, 0.001, 1)));
  const std::size_t still = Bytes(Encode(&sender, Sheet(kRows, kCols, 0.001, 2)));
  const std::size_t moving = Bytes(Encode(&sender, Sheet(kRows, kCols, 0.0015, 3)));
  EXPECT_LT(first, std::size_t{6} * kRows * kCols);
  // 50 kB/s at 30 Hz.
  EXPECT_LT(still, 1600u);
  EXPECT_GT(moving, still);
  EXPECT_LT(moving, first / 4);
}

TEST(TissueCodec, FewerBytesWhenNoiseIsBelowTheStep) {
  TissueSender sender;
  (void)Encode(&sender, Sheet(kRows, kCols, 0, 1));
  TissueFrame noisy = Sheet(kRows, kCols, 0, 2);
  for (std::size_t i = 0; i < noisy.xyz.size(); ++i) noisy.xyz[i] += i % 2 == 0 ? 1e-6f : -1e-6f;
  EXPECT_LT(Bytes(Encode(&sender, noisy)), 1600u);
}

TEST(TissueCodec, AFrameWithHolesIsHeldBackUntilTheyAreFilled) {
  TissueSender sender;
  TissueReceiver receiver;
  std::vector<Chunk> chunks = Encode(&sender, Sheet(kRows, kCols, 0, 1));
  ASSERT_GT(chunks.size(), 4u);
  chunks.erase(chunks.begin() + 2);
  for (const Chunk& chunk : chunks) EXPECT_EQ(receiver.Take(chunk), Result::kPart);
  EXPECT_TRUE(receiver.missing().TakeAll());
  const std::vector<std::uint32_t> asked = receiver.missing().TakeQuestions(10);
  EXPECT_EQ(asked, (std::vector<std::uint32_t>{3}));
  for (const std::uint32_t chunk : asked) sender.Repeat(chunk);
  const TissueFrame next = Sheet(kRows, kCols, 0, 2);
  Result last = Result::kBad;
  for (const Chunk& chunk : Encode(&sender, next)) last = receiver.Take(chunk);
  EXPECT_EQ(last, Result::kFrame);
  EXPECT_LE(ErrorOf(receiver.frame(), next), kTissueError_m);
}

TEST(TissueCodec, FlushTellsAgainWhenNoFrameComes) {
  TissueSender sender;
  TissueReceiver receiver;
  const TissueFrame frame = Sheet(20, 20, 0.001, 1);
  (void)Encode(&sender, frame);  // All chunks are lost.
  sender.RepeatAll();
  Result last = Result::kBad;
  sender.Flush([&](std::span<const std::uint8_t> chunk) { last = receiver.Take(chunk); });
  EXPECT_EQ(last, Result::kFrame);
  EXPECT_LE(ErrorOf(receiver.frame(), frame), kTissueError_m);
  int more = 0;
  sender.Flush([&](std::span<const std::uint8_t>) { ++more; });
  EXPECT_EQ(more, 0);
}

TEST(TissueCodec, HealsFromLossAndReorderWhenAskedForWhatIsMissing) {
  TissueSender sender;
  TissueReceiver receiver;
  std::mt19937 random(7);
  std::bernoulli_distribution lost(0.05);
  for (std::uint64_t i = 1; i <= 120; ++i) {
    // The tissue moves for a while and then stays.
    const double depth = 1e-4 * static_cast<double>(std::min<std::uint64_t>(i, 80));
    std::vector<Chunk> chunks = Encode(&sender, Sheet(40, 50, depth, i));
    if (chunks.size() > 1) std::swap(chunks[0], chunks[1]);
    for (const Chunk& chunk : chunks) {
      if (!lost(random)) (void)receiver.Take(chunk);
    }
    if (receiver.missing().TakeAll()) sender.RepeatAll();
    for (const std::uint32_t chunk : receiver.missing().TakeQuestions(kChunk_B)) sender.Repeat(chunk);
  }
  EXPECT_GT(receiver.missing().lost(), 0u);
  EXPECT_LE(ErrorOf(receiver.frame(), Sheet(40, 50, 8e-3, 120)), kTissueError_m);
}

TEST(TissueCodec, ALateChunkDoesNotUndoANewerOne) {
  TissueSender sender;
  TissueReceiver receiver;
  for (const Chunk& chunk : Encode(&sender, Sheet(8, 8, 0, 1))) (void)receiver.Take(chunk);
  const std::vector<Chunk> second = Encode(&sender, Sheet(8, 8, 0.002, 2));
  const TissueFrame third = Sheet(8, 8, 0.004, 3);
  for (const Chunk& chunk : Encode(&sender, third)) (void)receiver.Take(chunk);
  for (const Chunk& chunk : second) EXPECT_EQ(receiver.Take(chunk), Result::kPart);
  EXPECT_LE(ErrorOf(receiver.frame(), third), kTissueError_m);
}

TEST(TissueCodec, AnotherSceneBeginsAnew) {
  TissueSender sender;
  TissueReceiver receiver;
  for (const Chunk& chunk : Encode(&sender, Sheet(8, 8, 0, 1))) (void)receiver.Take(chunk);
  const TissueFrame other = Sheet(9, 9, 0.001, 2);
  Result last = Result::kBad;
  for (const Chunk& chunk : Encode(&sender, other)) last = receiver.Take(chunk);
  EXPECT_EQ(last, Result::kFrame);
  EXPECT_LE(ErrorOf(receiver.frame(), other), kTissueError_m);
}

TEST(TissueCodec, TheLargestFrameAndTheFarthestPlacesFit) {
  TissueSender sender;
  TissueReceiver receiver;
  TissueFrame frame;
  frame.header.stamp = {1, 1, 1};
  frame.header.vertex_count = kMaxTissueVertices;
  for (int i = 0; i < 3 * kMaxTissueVertices; ++i) frame.xyz.push_back(i % 2 == 0 ? 10.0f : -10.0f);
  Result last = Result::kBad;
  for (const Chunk& chunk : Encode(&sender, frame)) last = receiver.Take(chunk);
  ASSERT_EQ(last, Result::kFrame);
  EXPECT_LE(ErrorOf(receiver.frame(), frame), kTissueError_m);
}

TEST(TissueCodec, AReplacedSenderContinuesTheNumbers) {
  TissueReceiver receiver;
  std::uint32_t chunks = 0;
  for (std::uint64_t sequence = 1; sequence <= 20; ++sequence) {
    // Each frame has a sender of its own, and the frames several chunks.
    TissueSender sender(chunks);
    const TissueFrame frame = Sheet(60, 80, 0.001 * static_cast<double>(sequence), sequence);
    TissueReceiver::Result last = TissueReceiver::Result::kBad;
    for (const Chunk& chunk : Encode(&sender, frame)) last = receiver.Take(chunk);
    ASSERT_EQ(last, TissueReceiver::Result::kFrame) << sequence;
    EXPECT_LE(ErrorOf(receiver.frame(), frame), kTissueError_m);
    EXPECT_GT(sender.chunks(), chunks);
    chunks = sender.chunks();
  }
  EXPECT_EQ(receiver.missing().lost(), 0u);
}

}  // namespace
}  // namespace fulcrum::link
