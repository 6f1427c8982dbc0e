// The ring, the sequence lock and the latest value: single-threaded properties, and two threads against each other
// (also run under the thread sanitizer by the tsan preset).
#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <cstdint>
#include <thread>

#include "services/base/runtime/latest_value.h"
#include "services/base/runtime/seqlock.h"
#include "services/base/runtime/spsc_ring.h"

namespace fulcrum::runtime {
namespace {

TEST(SpscRing, HoldsExactlyItsCapacityInOrder) {
  SpscRing<int, 4> ring;
  int value = -1;
  EXPECT_FALSE(ring.TryPop(&value));
  for (int round = 0; round < 3; ++round) {
    for (int i = 0; i < 4; ++i) EXPECT_TRUE(ring.TryPush(i));
    EXPECT_FALSE(ring.TryPush(99));
    for (int i = 0; i < 4; ++i) {
      ASSERT_TRUE(ring.TryPop(&value));
      EXPECT_EQ(value, i);
    }
    EXPECT_FALSE(ring.TryPop(&value));
  }
}

/// A payload of several words whose parts must agree.
struct Block {
  std::array<std::uint64_t, 9> word{};
  [[nodiscard]] static Block Of(std::uint64_t n) {
    Block block;
    block.word.fill(n);
    return block;
  }
  [[nodiscard]] bool whole() const {
    for (const std::uint64_t w : word) {
      if (w != word[0]) return false;
    }
    return true;
  }
};

TEST(SpscRing, TwoThreadsLoseNothingAndTearNothing) {
  constexpr std::uint64_t kCount = 200'000;
  SpscRing<Block, 16> ring;
  std::thread producer([&] {
    for (std::uint64_t i = 1; i <= kCount; ++i) {
      while (!ring.TryPush(Block::Of(i))) std::this_thread::yield();
    }
  });
  std::uint64_t expected = 1;
  bool whole = true;
  while (expected <= kCount) {
    Block block;
    if (!ring.TryPop(&block)) {
      std::this_thread::yield();
      continue;
    }
    whole = whole && block.whole() && block.word[0] == expected;
    ++expected;
  }
  producer.join();
  EXPECT_TRUE(whole);
}

TEST(SeqLock, StartsWithTheDefaultAndKeepsTheLast) {
  SeqLock<Block> lock;
  EXPECT_EQ(lock.Load().word[8], 0u);
  lock.Store(Block::Of(3));
  lock.Store(Block::Of(4));
  EXPECT_EQ(lock.Load().word[0], 4u);
}

TEST(SeqLock, ReadersNeverSeeATornOrOlderValue) {
  constexpr std::uint64_t kCount = 100'000;
  SeqLock<Block> lock;
  std::atomic<bool> good{true};
  const auto read = [&] {
    std::uint64_t last = 0;
    while (last < kCount) {
      const Block block = lock.Load();
      if (!block.whole() || block.word[0] < last) good = false;
      last = block.word[0];
      std::this_thread::yield();
    }
  };
  std::thread first(read);
  std::thread second(read);
  for (std::uint64_t i = 1; i <= kCount; ++i) lock.Store(Block::Of(i));
  first.join();
  second.join();
  EXPECT_TRUE(good);
}

TEST(LatestValue, GivesTheNewestOnceAndNothingBeforeTheFirst) {
  LatestValue<int> value;
  int got = -1;
  EXPECT_FALSE(value.TryTake(&got));
  EXPECT_EQ(got, -1);
  for (int i = 0; i < 20; ++i) {
    for (int j = 0; j <= i % 5; ++j) value.Store(10 * i + j);
    EXPECT_TRUE(value.TryTake(&got));
    EXPECT_EQ(got, 10 * i + i % 5);
    EXPECT_FALSE(value.TryTake(&got));
  }
}

TEST(LatestValue, TwoThreadsSeeWholeValuesThatNeverGoBack) {
  constexpr std::uint64_t kLast = 100'000;
  LatestValue<Block> value;
  std::thread producer([&] {
    for (std::uint64_t n = 1; n <= kLast; ++n) value.Store(Block::Of(n));
  });
  Block block;
  std::uint64_t newest = 0, torn = 0, backward = 0;
  while (newest < kLast) {
    if (!value.TryTake(&block)) {
      std::this_thread::yield();
      continue;
    }
    if (!block.whole()) ++torn;
    if (block.word[0] <= newest) ++backward;
    newest = block.word[0];
  }
  producer.join();
  EXPECT_EQ(torn, 0u);
  EXPECT_EQ(backward, 0u);
}

}  // namespace
}  // namespace fulcrum::runtime
