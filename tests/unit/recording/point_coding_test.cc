// Arrays of points in few bytes: rounded to a step or exact, whatever they contain.
#include "services/records/recording/point_coding.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <random>
#include <vector>

#include "services/records/recording/mcap_reader.h"
#include "services/records/recording/mcap_writer.h"

namespace fulcrum::recording {
namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr std::size_t kHead_B = 12, kValues = 600;
constexpr float kStep = 2e-6F;
constexpr std::size_t kFields_B = 16;  ///< Step, kind, count, length.

Bytes MessageOf(std::uint8_t head, const std::vector<float>& values) {
  Bytes message(kHead_B + sizeof(float) * kValues);
  std::fill_n(message.begin(), kHead_B, head);
  if (!values.empty()) std::memcpy(message.data() + kHead_B, values.data(), sizeof(float) * values.size());
  return message;
}
std::vector<float> ValuesOf(const Bytes& message) {
  std::vector<float> values((message.size() - kHead_B) / sizeof(float));
  std::memcpy(values.data(), message.data() + kHead_B, sizeof(float) * values.size());
  return values;
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

/// Points of a sheet that moves as a whole and trembles; the last third of the array is not used.
std::vector<float> Moving(int frame, std::mt19937* random) {
  std::normal_distribution<double> tremble(0, 3e-6);
  std::vector<float> values(2 * kValues / 3);
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double place = 1e-3 * static_cast<double>(i / 3) - 0.1;
    values[i] = static_cast<float>(place + 2e-4 * frame * std::sin(3 * place) + tremble(*random));
  }
  return values;
}

TEST(PointCoding, RoundsToHalfAStepAndKeepsTheHead) {
  PointCoder in({kHead_B, kValues, kStep}), out({kHead_B, kValues, kStep});
  std::mt19937 random(1);
  std::size_t most = 0;
  for (int frame = 0; frame < 50; ++frame) {
    const Bytes sent = MessageOf(static_cast<std::uint8_t>(frame), Moving(frame, &random));
    const Bytes coded = Encoded(&in, sent);
    if (frame > 0) most = std::max(most, coded.size());
    const Bytes read = Decoded(&out, coded);
    ASSERT_EQ(read.size(), sent.size());
    EXPECT_TRUE(std::equal(sent.begin(), sent.begin() + kHead_B, read.begin()));
    const std::vector<float> before = ValuesOf(sent), after = ValuesOf(read);
    for (std::size_t i = 0; i < kValues; ++i) {
      ASSERT_NEAR(after[i], before[i], 0.5 * kStep + 1e-8) << i;
      EXPECT_EQ(after[i], RoundedTo(kStep, before[i]));
      EXPECT_EQ(after[i], RoundedTo(kStep, after[i])) << "rounded again";
    }
  }
  EXPECT_LE(most, kHead_B + kFields_B + 2 * kValues / 3) << "one byte for a value that moves by 100 steps";
}

TEST(PointCoding, WhatDoesNotMoveTakesNoBytes) {
  PointCoder in({kHead_B, kValues, kStep}), out({kHead_B, kValues, kStep});
  std::mt19937 random(1);
  const Bytes sent = MessageOf(1, Moving(0, &random));
  const Bytes first = Decoded(&out, Encoded(&in, sent));
  const Bytes again = Encoded(&in, sent);
  EXPECT_EQ(again.size(), kHead_B + kFields_B);
  EXPECT_EQ(Decoded(&out, again), first);
}

TEST(PointCoding, StepZeroKeepsEveryBit) {
  PointCoder in({kHead_B, kValues, 0}), out({kHead_B, kValues, 0});
  std::mt19937 random(1);
  for (int frame = 0; frame < 20; ++frame) {
    std::vector<float> values = Moving(frame, &random);
    if (frame % 3 == 1) {
      for (float& value : values) value = std::bit_cast<float>(static_cast<std::uint32_t>(random()));
    }
    const Bytes sent = MessageOf(7, values);
    EXPECT_EQ(Decoded(&out, Encoded(&in, sent)), sent) << frame;
  }
}

TEST(PointCoding, WhatCannotBeRoundedIsExact) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInf = std::numeric_limits<float>::infinity();
  PointCoder in({kHead_B, kValues, kStep}), out({kHead_B, kValues, kStep});
  std::mt19937 random(1);
  const Bytes usual = MessageOf(1, Moving(0, &random));
  for (const float strange : {kNan, -kNan, kInf, -kInf, 1e30F, -1000.0F}) {
    std::vector<float> values = Moving(1, &random);
    values[17] = strange;
    const Bytes sent = MessageOf(2, values);
    EXPECT_EQ(Decoded(&out, Encoded(&in, sent)), sent) << strange;
    EXPECT_NEAR(ValuesOf(Decoded(&out, Encoded(&in, usual)))[17], ValuesOf(usual)[17], 0.51 * kStep) << "and after it";
  }
  const Bytes zeros = MessageOf(3, {});
  EXPECT_EQ(Decoded(&out, Encoded(&in, zeros)), zeros);
  EXPECT_EQ(Decoded(&out, Encoded(&in, zeros)), zeros);
}

TEST(PointCoding, MessagesOfAnotherLengthAreKeptAsSent) {
  PointCoder in({kHead_B, kValues, kStep}), out({kHead_B, kValues, kStep});
  for (const std::size_t size : {std::size_t{0}, std::size_t{5}, kHead_B, kHead_B + 4 * kValues + 1}) {
    const Bytes sent(size, 9);
    EXPECT_EQ(Decoded(&out, Encoded(&in, sent)), sent) << size;
  }
}

TEST(PointCoding, DecodesNothingThatRefersToAMissingMessage) {
  PointCoder in({kHead_B, kValues, kStep}), out({kHead_B, kValues, kStep});
  std::mt19937 random(1);
  (void)Encoded(&in, MessageOf(1, Moving(0, &random)));
  const Bytes second = Encoded(&in, MessageOf(1, Moving(1, &random)));
  in.Restart();
  const Bytes key = Encoded(&in, MessageOf(1, Moving(2, &random)));
  Bytes message;
  EXPECT_FALSE(out.Decode(second, &message));
  EXPECT_TRUE(out.Decode(key, &message));
  for (std::size_t size = 0; size < key.size(); ++size) {
    PointCoder fresh({kHead_B, kValues, kStep});
    EXPECT_FALSE(fresh.Decode(std::span(key).first(size), &message)) << size;
  }
}

TEST(PointCoding, WhatFollowsADamagedMessageIsNotDecodedFromTheOneBeforeIt) {
  std::mt19937 random(1);
  PointCoder in({kHead_B, kValues, kStep});
  const Bytes key = Encoded(&in, MessageOf(1, Moving(0, &random)));
  const Bytes second = Encoded(&in, MessageOf(1, Moving(1, &random)));
  const Bytes third = Encoded(&in, MessageOf(1, Moving(2, &random)));
  const auto damaged = [&second](std::size_t at, std::uint8_t value) {
    Bytes bytes = second;
    bytes[kHead_B + at] = value;
    return bytes;
  };
  const Bytes cut(second.begin(), second.end() - 1);
  // Step, kind, number of values.
  for (const Bytes& bad : {cut, damaged(0, 1), damaged(4, 4), damaged(4, 200), damaged(8, 0), damaged(11, 255)}) {
    PointCoder out({kHead_B, kValues, kStep});
    Bytes message;
    ASSERT_TRUE(out.Decode(key, &message));
    EXPECT_FALSE(out.Decode(bad, &message));
    EXPECT_FALSE(out.Decode(third, &message));
    EXPECT_TRUE(out.Decode(key, &message));
  }
}

TEST(PointCoding, TheFormatIsThatOfTheHeader) {
  PointCoder coder({1, 6, 0.5F});
  const auto coded = [&](const std::vector<float>& values) {
    Bytes message(1 + sizeof(float) * 6, 42);
    std::memcpy(message.data() + 1, values.data(), sizeof(float) * 6);
    Bytes bytes = Encoded(&coder, message);
    return Bytes(bytes.begin() + 5, bytes.end());  // Without head and step.
  };
  // Words 2 -4 0, 4 -4 300; the neighbours' differences 2 0 300.
  EXPECT_EQ(coded({1, -2, 0, 2, -2, 150}), (Bytes{0, 0, 0, 0, 6, 0,         0, 0, 12, 0, 0, 0,  //
                                                  4, 7, 0, 4, 0, 600 & 255, 0, 0, 0,  0, 0, 600 >> 8}));
  EXPECT_EQ(coded({1, -2, 0, 2, -2, 149.5F}), (Bytes{1, 0, 0, 0, 6, 0, 0, 0, 6, 0, 0, 0, 0, 0, 0, 0, 0, 1}));
  // All points move by 3 -1 0 steps.
  EXPECT_EQ(coded({2.5F, -2.5F, 0, 3.5F, -2.5F, 149.5F}),
            (Bytes{2, 0, 0, 0, 6, 0, 0, 0, 6, 0, 0, 0, 6, 1, 0, 0, 0, 0}));
}

TEST(PointCoding, MetadataSayItAll) {
  const PointCoding coding{92, 76800, 2e-6F};
  std::map<std::string, std::string> metadata{{"node", "physics_node"}};
  EXPECT_FALSE(FindPointCoding(metadata).has_value());
  PutPointCoding(coding, &metadata);
  EXPECT_EQ(FindPointCoding(metadata), coding);
  for (const char* key : {"points_head_B", "points_values", "points_step"}) {
    for (const char* value : {"", "-1", "1x", "nan", "99999999999999999999999"}) {
      auto damaged = metadata;
      damaged[key] = value;
      EXPECT_FALSE(FindPointCoding(damaged).has_value()) << key << " " << value;
    }
  }
  for (const auto& [key, value] :
       {std::pair{"points_head_B", "4097"}, {"points_values", "262145"}, {"points_step", "1.1"}}) {
    auto too_large = metadata;
    too_large[key] = value;
    EXPECT_FALSE(FindPointCoding(too_large).has_value()) << key;
  }
}

/// Zeros pack to nothing: a small file must not yield gigabytes.
TEST(PointCoding, AChunkYieldsNoMoreThanAChunkMayHold) {
  const std::filesystem::path file = std::filesystem::path(testing::TempDir()) / ("bomb_" + std::to_string(getpid()));
  const PointCoding coding{0, PointCoding::kMostValues, 0};
  std::map<std::string, std::string> metadata;
  PutPointCoding(coding, &metadata);
  constexpr std::uint32_t kMessages = 400;  // Of a megabyte.
  {
    McapWriter writer(file, "", "");
    writer.AddChannel(0, "points", "cdr", metadata);
    ChunkPacker packer;  // Without coding, for messages that are coded already: a key of no values.
    Bytes records;
    for (std::uint32_t i = 0; i < kMessages; ++i) {
      records.resize(records.size() + kMessageHead + kFields_B);
      PutMessageHead(0, i, i, i, kFields_B, records.data() + records.size() - kMessageHead - kFields_B);
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
  EXPECT_LE(read_B, McapReader::kMostChunkBytes + coding.message_B());
  EXPECT_FALSE(reader.faults().empty());
  std::filesystem::remove(file);
}

/// Each restart of a node makes a channel.
TEST(PointCoding, AFileMayHaveAnyNumberOfCodedChannels) {
  const std::filesystem::path file = std::filesystem::path(testing::TempDir()) / ("many_" + std::to_string(getpid()));
  std::map<std::string, std::string> metadata;
  PutPointCoding({kHead_B, kValues, kStep}, &metadata);
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
    EXPECT_EQ(message.data.size(), kHead_B + sizeof(float) * kValues);
  }
  EXPECT_TRUE(reader.faults().empty());
  EXPECT_EQ(read, 2 * kWriters);
  std::filesystem::remove(file);
}

TEST(PointCoding, EachChunkOfAFileCanBeReadAlone) {
  const std::filesystem::path file = std::filesystem::path(testing::TempDir()) / ("points_" + std::to_string(getpid()));
  std::map<std::string, std::string> metadata;
  PutPointCoding({kHead_B, kValues, kStep}, &metadata);
  std::mt19937 random(1);
  constexpr std::uint32_t kFrames = 40;
  std::vector<Bytes> rounded;
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
      std::vector<float> values = ValuesOf(message);
      for (float& value : values) value = RoundedTo(kStep, value);
      rounded.push_back(MessageOf(static_cast<std::uint8_t>(i), values));
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
      EXPECT_EQ(Bytes(message.data.begin(), message.data.end()), rounded[message.sequence]);
    }
  }
  EXPECT_EQ(reader.faults().size(), 1u);
  EXPECT_EQ(read["points"], kFrames - 10);
  EXPECT_EQ(read["plain"], kFrames - 10);
  std::filesystem::remove(file);
}

}  // namespace
}  // namespace fulcrum::recording
