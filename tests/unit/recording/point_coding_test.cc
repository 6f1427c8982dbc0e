// Blocks of points in few bytes, whatever they contain.
#include "services/records/recording/point_coding.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <random>
#include <vector>

#include "services/base/core/tissue_blocks.h"
#include "services/records/recording/mcap_reader.h"
#include "services/records/recording/mcap_writer.h"

namespace fulcrum::recording {
namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr std::size_t kHead_B = 12, kBlocks = 3, kWords = kBlocks * 3 * kBlockVertices;
constexpr std::size_t kFields_B = 12;  ///< Kind, number of blocks, length.
constexpr PointCoding kCoding{kHead_B};

Bytes MessageOf(std::uint8_t head, const std::vector<float>& positions) {
  const auto blocks = static_cast<std::uint32_t>(BlocksFor(positions.size() / 3));
  Bytes message(kHead_B + sizeof blocks + blocks * sizeof(TissueBlock), head);
  std::memcpy(message.data() + kHead_B, &blocks, sizeof blocks);
  EXPECT_TRUE(PackPositions(positions, reinterpret_cast<std::byte*>(message.data()) + kHead_B + sizeof blocks));
  return message;
}
Bytes Encoded(PointCoder* coder, const Bytes& message) {
  Bytes coded;
  coder->Encode(message, &coded);
  return coded;
}
Bytes Decoded(PointCoder* coder, const Bytes& coded) {
  Bytes message;
  EXPECT_TRUE(coder->Decode(coded, &message));
  return message;
}

/// Points of a sheet that moves as a whole and trembles; the last block is not full.
std::vector<float> Moving(int frame, std::mt19937* random) {
  std::normal_distribution<double> tremble(0, 3e-6);
  std::vector<float> values(kWords - 60);
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double place = 1e-3 * static_cast<double>(i / 3) - 0.1;
    values[i] = static_cast<float>(place + 4e-4 * frame * std::sin(3 * place) + tremble(*random));
  }
  return values;
}

TEST(PointCoding, KeepsEveryBit) {
  PointCoder in(kCoding), out(kCoding);
  std::mt19937 random(1);
  std::size_t most = 0;
  for (int frame = 0; frame < 50; ++frame) {
    const Bytes sent = MessageOf(static_cast<std::uint8_t>(frame), Moving(frame, &random));
    const Bytes coded = Encoded(&in, sent);
    if (frame > 0) most = std::max(most, coded.size());
    EXPECT_EQ(Decoded(&out, coded), sent);
  }
  EXPECT_LE(most, kHead_B + kFields_B + kWords) << "one byte for a value that moves by 100 steps";
}

TEST(PointCoding, WhatDoesNotMoveTakesNoBytes) {
  PointCoder in(kCoding), out(kCoding);
  std::mt19937 random(1);
  const Bytes sent = MessageOf(1, Moving(0, &random));
  const Bytes first = Decoded(&out, Encoded(&in, sent));
  const Bytes again = Encoded(&in, sent);
  EXPECT_EQ(again.size(), kHead_B + kFields_B);
  EXPECT_EQ(Decoded(&out, again), first);
}

TEST(PointCoding, WhatIsNotOfThisCodingIsKeptAsSent) {
  PointCoder in(kCoding), out(kCoding);
  std::mt19937 random(1);
  const Bytes usual = MessageOf(1, Moving(0, &random));
  std::vector<Bytes> strange;
  for (const std::size_t size : {std::size_t{0}, std::size_t{5}, kHead_B, usual.size() - 1, usual.size() + 1}) {
    strange.emplace_back(size, 9);
    strange.push_back(usual);
    strange.back().resize(size);
  }
  const auto with = [&](std::size_t at, std::uint32_t value) {
    strange.push_back(usual);
    std::memcpy(strange.back().data() + kHead_B + 4 + at, &value, sizeof value);
  };
  for (const std::uint32_t shift : {1U, 15U, 16U, 31U, 77U, 0xffffffffU}) with(12, shift);
  for (std::size_t at = 16; at < 400; at += 2) {
    Bytes bytes = usual;  // An offset is raised, perhaps the one that is 0.
    bytes[kHead_B + 4 + at] ^= 0x55U;
    strange.push_back(bytes);
  }
  with(0, 0x7fffffffU);
  for (const Bytes& sent : strange) {
    EXPECT_EQ(Decoded(&out, Encoded(&in, sent)), sent);
    EXPECT_EQ(Decoded(&out, Encoded(&in, usual)), usual) << "and after it";
  }
  for (int i = 0; i < 200; ++i) {
    Bytes sent = usual;
    for (std::size_t k = kHead_B + 4; k < sent.size(); ++k) sent[k] = static_cast<std::uint8_t>(random());
    EXPECT_EQ(Decoded(&out, Encoded(&in, sent)), sent) << i;
  }
}

TEST(PointCoding, ABlockWiderThanItsOffsetsIsKept) {
  PointCoder in(kCoding), out(kCoding);
  for (const float wide_m : {0.3F, 0.5F, 3.0F, 900.0F}) {
    std::vector<float> values(kWords, 0.01F);
    values[30] = wide_m;
    values[40] = -wide_m / 7;
    const Bytes sent = MessageOf(2, values);
    EXPECT_EQ(Decoded(&out, Encoded(&in, sent)), sent) << wide_m;
  }
}

TEST(PointCoding, DecodesNothingThatRefersToAMissingMessage) {
  PointCoder in(kCoding), out(kCoding);
  std::mt19937 random(1);
  (void)Encoded(&in, MessageOf(1, Moving(0, &random)));
  const Bytes second = Encoded(&in, MessageOf(1, Moving(1, &random)));
  in.Restart();
  const Bytes key = Encoded(&in, MessageOf(1, Moving(2, &random)));
  Bytes message;
  EXPECT_FALSE(out.Decode(second, &message));
  EXPECT_TRUE(out.Decode(key, &message));
  for (std::size_t size = 0; size < key.size(); ++size) {
    PointCoder fresh(kCoding);
    EXPECT_FALSE(fresh.Decode(std::span(key).first(size), &message)) << size;
  }
}

TEST(PointCoding, WhatFollowsADamagedMessageIsNotDecodedFromTheOneBeforeIt) {
  std::mt19937 random(1);
  PointCoder in(kCoding);
  const Bytes key = Encoded(&in, MessageOf(1, Moving(0, &random)));
  const Bytes second = Encoded(&in, MessageOf(1, Moving(1, &random)));
  const Bytes third = Encoded(&in, MessageOf(1, Moving(2, &random)));
  const auto damaged = [&second](std::size_t at, std::uint8_t value) {
    Bytes bytes = second;
    bytes[kHead_B + at] = value;
    return bytes;
  };
  const Bytes cut(second.begin(), second.end() - 1);
  // Kind, number of blocks.
  for (const Bytes& bad : {cut, damaged(0, 4), damaged(0, 200), damaged(4, 0), damaged(7, 255)}) {
    PointCoder out(kCoding);
    Bytes message;
    ASSERT_TRUE(out.Decode(key, &message));
    EXPECT_FALSE(out.Decode(bad, &message));
    EXPECT_FALSE(out.Decode(third, &message));
    EXPECT_TRUE(out.Decode(key, &message));
  }
}

TEST(PointCoding, TheFormatIsThatOfTheHeader) {
  PointCoder coder({1});
  constexpr std::uint32_t kWordsOfBlock = 192;
  const auto coded = [&](const std::array<std::int32_t, 6>& steps) {
    BlockSteps all;  // The first point, and the second one for all others.
    for (std::size_t i = 0; i < all.size(); ++i) all[i] = steps[i < 3 ? i : 3 + i % 3];
    const TissueBlock block = Pack(all);
    Bytes message{42, 1, 0, 0, 0};
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(&block);
    message.insert(message.end(), bytes, bytes + sizeof block);
    return Encoded(&coder, message);
  };
  const auto expected = [&](std::uint8_t kind, std::uint8_t planes, const Bytes& low, const Bytes& high) {
    Bytes bytes{42, kind, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0};
    const std::uint32_t length = planes * kWordsOfBlock;
    std::memcpy(bytes.data() + 9, &length, sizeof length);
    for (const Bytes* plane : {&low, &high}) {
      if (planes-- == 0) break;
      const std::size_t at = bytes.size();
      bytes.resize(at + kWordsOfBlock);
      std::copy(plane->begin(), plane->end(), bytes.begin() + static_cast<std::ptrdiff_t>(at));
    }
    return bytes;
  };
  // The neighbours' differences 2 0 300.
  EXPECT_EQ(coded({2, -4, 0, 4, -4, 300}), expected(0, 2, {4, 7, 0, 4, 0, 600 & 255}, {0, 0, 0, 0, 0, 600 >> 8}));
  // All points move by 3 -1 0 steps.
  EXPECT_EQ(coded({5, -5, 0, 7, -5, 300}), expected(2, 1, {6, 1, 0}, {}));
}

TEST(PointCoding, MetadataSayItAll) {
  const PointCoding coding{92};
  std::map<std::string, std::string> metadata{{"node", "physics_node"}};
  EXPECT_FALSE(FindPointCoding(metadata).has_value());
  PutPointCoding(coding, &metadata);
  EXPECT_EQ(FindPointCoding(metadata), coding);
  for (const char* value : {"", "-1", "1x", "nan", "99999999999999999999999", "4097"}) {
    auto damaged = metadata;
    damaged["blocks_head_B"] = value;
    EXPECT_FALSE(FindPointCoding(damaged).has_value()) << value;
  }
}

/// Zeros pack to nothing: a small file must not yield gigabytes.
TEST(PointCoding, AChunkYieldsNoMoreThanAChunkMayHold) {
  const std::filesystem::path file = std::filesystem::path(testing::TempDir()) / ("bomb_" + std::to_string(getpid()));
  const PointCoding coding{0};
  std::map<std::string, std::string> metadata;
  PutPointCoding(coding, &metadata);
  constexpr std::uint32_t kMessages = 100;  // Of 6.5 MB.
  {
    McapWriter writer(file, "", "");
    writer.AddChannel(0, "points", "cdr", metadata);
    ChunkPacker packer;  // Without coding, for messages that are coded already: a key whose residuals take no bytes.
    Bytes records;
    for (std::uint32_t i = 0; i < kMessages; ++i) {
      records.resize(records.size() + kMessageHead + kFields_B);
      PutMessageHead(0, i, i, i, kFields_B, records.data() + records.size() - kMessageHead - kFields_B);
      constexpr std::uint32_t kBlocksOfEach = PointCoding::kMostBlocks;
      std::memcpy(records.data() + records.size() - 8, &kBlocksOfEach, sizeof kBlocksOfEach);
    }
    PackedChunk chunk;
    packer.Pack(records, records.size(), &chunk);
    writer.Append(chunk);
  }
  McapReader reader(file);
  McapMessage message{};
  std::uint64_t read_B = 0;
  while (reader.Next(&message)) read_B += message.data.size();
  EXPECT_GT(read_B, std::uint64_t{200} << 20);
  EXPECT_LE(read_B, McapReader::kMostChunkBytes + 4 + PointCoding::kMostBlocks * sizeof(TissueBlock));
  EXPECT_FALSE(reader.faults().empty());
  std::filesystem::remove(file);
}

/// Each restart of a node makes a channel.
TEST(PointCoding, AFileMayHaveAnyNumberOfCodedChannels) {
  const std::filesystem::path file = std::filesystem::path(testing::TempDir()) / ("many_" + std::to_string(getpid()));
  std::map<std::string, std::string> metadata;
  PutPointCoding(kCoding, &metadata);
  std::mt19937 random(1);
  constexpr std::uint32_t kWriters = 200;
  {
    McapWriter writer(file, "", "");
    for (std::uint32_t i = 0; i < kWriters; ++i) {
      metadata["writer"] = std::to_string(i);
      const std::uint16_t points = writer.AddChannel(0, "points", "cdr", metadata);
      for (std::uint32_t k = 0; k < 2; ++k) {
        const Bytes message = MessageOf(1, Moving(static_cast<int>(k), &random));
        writer.Write(points, k, i, i, std::as_bytes(std::span(message)));
      }
      if (i % 10 == 9) writer.EndChunk();
    }
  }
  McapReader reader(file);
  McapMessage message{};
  std::uint32_t read = 0;
  while (reader.Next(&message)) {
    ++read;
    EXPECT_EQ(message.data.size(), MessageOf(1, Moving(0, &random)).size());
  }
  EXPECT_TRUE(reader.faults().empty());
  EXPECT_EQ(read, 2 * kWriters);
  std::filesystem::remove(file);
}

TEST(PointCoding, EachChunkOfAFileCanBeReadAlone) {
  const std::filesystem::path file = std::filesystem::path(testing::TempDir()) / ("points_" + std::to_string(getpid()));
  std::map<std::string, std::string> metadata;
  PutPointCoding(kCoding, &metadata);
  std::mt19937 random(1);
  constexpr std::uint32_t kFrames = 40;
  std::vector<Bytes> sent;
  std::vector<std::uint64_t> begins;  // Of chunks.
  {
    McapWriter writer(file, "", "");
    const std::uint16_t plain = writer.AddChannel(0, "plain", "cdr", {});
    const std::uint16_t points = writer.AddChannel(0, "points", "cdr", metadata);
    for (std::uint32_t i = 0; i < kFrames; ++i) {
      if (i % 10 == 0) {
        writer.EndChunk();
        begins.push_back(writer.bytes_written());
      }
      const Bytes message = MessageOf(static_cast<std::uint8_t>(i), Moving(static_cast<int>(i), &random));
      writer.Write(points, i, i, i, std::as_bytes(std::span(message)));
      writer.Write(plain, i, i, i, std::as_bytes(std::span(message)));
      sent.push_back(message);
    }
  }
  {  // A damaged chunk loses its own messages only.
    std::fstream bytes(file, std::ios::in | std::ios::out | std::ios::binary);
    bytes.seekp(static_cast<std::streamoff>(begins[1] + 200));
    bytes.put('x').put('y');
  }
  McapReader reader(file);
  McapMessage message{};
  std::map<std::string, std::uint32_t> read;
  while (reader.Next(&message)) {
    const std::string& topic = reader.channels().at(message.channel).topic;
    ++read[topic];
    if (topic == "points") {
      EXPECT_EQ(Bytes(message.data.begin(), message.data.end()), sent[message.sequence]);
    }
  }
  EXPECT_EQ(reader.faults().size(), 1u);
  EXPECT_EQ(read["points"], kFrames - 10);
  EXPECT_EQ(read["plain"], kFrames - 10);
  std::filesystem::remove(file);
}

}  // namespace
}  // namespace fulcrum::recording
