#include "services/transport/link/codec/byte_delta.h"

#include <gtest/gtest.h>

#include <random>

#include "services/transport/link/codec/bits.h"

namespace fulcrum::link {
namespace {

using Buffer = std::vector<std::uint8_t>;

Buffer There(const Buffer& base, const Buffer& bytes, std::size_t* delta_B = nullptr) {
  Buffer delta, got;
  PutDelta(base, bytes, &delta);
  if (delta_B != nullptr) *delta_B = delta.size();
  EXPECT_TRUE(TakeDelta(base, delta, bytes.size(), &got));
  return got;
}

TEST(ByteDelta, ComesBackWhateverTheBase) {
  std::mt19937 random(1);
  for (int round = 0; round < 300; ++round) {
    const auto some = [&] {
      Buffer bytes(random() % 200);
      for (std::uint8_t& b : bytes) b = random() % 3 == 0 ? static_cast<std::uint8_t>(random()) : 0;
      return bytes;
    };
    const Buffer base = some(), bytes = some();
    EXPECT_EQ(There(base, bytes), bytes);
  }
  EXPECT_EQ(There({}, {}), Buffer());
}

TEST(ByteDelta, TellsOnlyWhatDiffers) {
  Buffer base(80'000, 7), bytes = base;
  std::size_t delta_B = 0;
  EXPECT_EQ(There(base, bytes, &delta_B), bytes);
  EXPECT_LE(delta_B, 4u);
  bytes[10] = 1;
  bytes[70'000] = 2;
  EXPECT_EQ(There(base, bytes, &delta_B), bytes);
  EXPECT_LE(delta_B, 16u);
}

TEST(ByteDelta, RefusesMoreThanTheLargest) {
  Buffer delta, got;
  PutDelta({}, Buffer(100, 1), &delta);
  EXPECT_FALSE(TakeDelta({}, delta, 99, &got));
  EXPECT_FALSE(TakeDelta({}, Buffer{0xff, 0xff, 0xff, 0xff, 0x0f}, 1000, &got));
  EXPECT_FALSE(TakeDelta({}, Buffer{10, 11, 0}, 1000, &got));
  EXPECT_FALSE(TakeDelta({}, Buffer{10, 0, 4, 1}, 1000, &got));
}

TEST(Bits, OfAnyWidth) {
  for (int width = 0; width <= 32; ++width) {
    std::vector<std::uint32_t> values;
    for (std::uint32_t i = 0; i < 37; ++i) {
      values.push_back(width == 0 ? 0 : (i * 2654435761u) >> (32 - width));
    }
    Buffer bytes;
    PutBits(values, width, &bytes);
    std::vector<std::uint32_t> got(values.size());
    ByteReader reader(bytes);
    ASSERT_TRUE(TakeBits(&reader, width, got));
    EXPECT_TRUE(reader.empty());
    EXPECT_EQ(got, values) << width;
  }
}

TEST(Bits, VarintsAndZigzag) {
  for (const std::int32_t value : {0, 1, -1, 63, -64, 64, 1 << 20, -(1 << 30), INT32_MAX, INT32_MIN}) {
    EXPECT_EQ(Unzigzag(Zigzag(value)), value);
    Buffer bytes;
    PutVarint(Zigzag(value), &bytes);
    ByteReader reader(bytes);
    EXPECT_EQ(TakeVarint(&reader), Zigzag(value));
    EXPECT_TRUE(reader.good() && reader.empty());
  }
  const Buffer too_long{0xff, 0xff, 0xff, 0xff, 0xff, 0x01};
  ByteReader reader(too_long);
  EXPECT_EQ(TakeVarint(&reader), 0u);
  EXPECT_FALSE(reader.good());
}

}  // namespace
}  // namespace fulcrum::link
