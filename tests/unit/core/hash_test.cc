#include "services/base/core/hash.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace fulcrum {
namespace {

std::uint64_t HashOf(const std::vector<std::uint8_t>& bytes) {
  Hash64 hash;
  hash.Add(std::span<const std::uint8_t>(bytes));
  return hash.value();
}

TEST(Hash64, EveryBitOfTheInputChangesIt) {
  std::vector<std::uint8_t> bytes(37, 0x5a);
  std::set<std::uint64_t> seen{HashOf(bytes)};
  for (auto& byte : bytes) {
    for (int bit = 0; bit < 8; ++bit) {
      byte = static_cast<std::uint8_t>(byte ^ (1 << bit));
      EXPECT_TRUE(seen.insert(HashOf(bytes)).second);
      byte = static_cast<std::uint8_t>(byte ^ (1 << bit));
    }
  }
}

TEST(Hash64, LengthCounts) {
  std::set<std::uint64_t> seen;
  for (std::size_t n = 0; n < 40; ++n) {
    EXPECT_TRUE(seen.insert(HashOf(std::vector<std::uint8_t>(n, 0))).second) << n << " zero bytes";
  }
}

std::uint64_t LongHashOf(const std::vector<std::uint8_t>& bytes) {
  Hash64 hash;
  hash.AddLong(std::span<const std::uint8_t>(bytes));
  return hash.value();
}

TEST(Hash64, EveryBitAndTheLengthOfALongArrayChangeIt) {
  for (std::size_t size = 0; size < 70; ++size) {
    std::vector<std::uint8_t> bytes(size, 0x5a);
    std::set<std::uint64_t> seen{LongHashOf(bytes), LongHashOf(std::vector<std::uint8_t>(size + 1, 0x5a))};
    EXPECT_EQ(seen.size(), 2u) << size;
    for (auto& byte : bytes) {
      for (int bit = 0; bit < 8; ++bit) {
        byte = static_cast<std::uint8_t>(byte ^ (1 << bit));
        EXPECT_TRUE(seen.insert(LongHashOf(bytes)).second) << size;
        byte = static_cast<std::uint8_t>(byte ^ (1 << bit));
      }
    }
  }
}

TEST(Hash64, WordsOfALongArrayDoNotChangePlaces) {
  std::vector<std::uint8_t> bytes(96);
  for (std::size_t word = 0; word < 12; ++word) bytes[8 * word] = static_cast<std::uint8_t>(word);
  std::set<std::uint64_t> seen{LongHashOf(bytes)};
  for (std::size_t a = 0; a < 12; ++a) {
    for (std::size_t b = a + 1; b < 12; ++b) {
      std::swap(bytes[8 * a], bytes[8 * b]);
      EXPECT_TRUE(seen.insert(LongHashOf(bytes)).second) << a << " and " << b;
      std::swap(bytes[8 * a], bytes[8 * b]);
    }
  }
}

TEST(Hash64, OrderCounts) {
  Hash64 ab;
  ab.AddValue(1.0f);
  ab.AddValue(2.0f);
  Hash64 ba;
  ba.AddValue(2.0f);
  ba.AddValue(1.0f);
  EXPECT_NE(ab.value(), ba.value());
}

TEST(Hash64, NegativeZeroIsAnotherState) {
  // A state hash compares bits, so that a difference in the sign of zero is detected in a replay.
  Hash64 positive;
  positive.AddValue(0.0f);
  Hash64 negative;
  negative.AddValue(-0.0f);
  EXPECT_NE(positive.value(), negative.value());
}

}  // namespace
}  // namespace fulcrum
