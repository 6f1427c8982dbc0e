// Written files are read back; truncated, damaged or foreign files are read as far as possible.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <random>
#include <string>
#include <vector>

#include "services/base/core/byte_stream.h"
#include "services/base/core/error.h"
#include "services/records/recording/mcap_format.h"
#include "services/records/recording/mcap_reader.h"
#include "services/records/recording/mcap_writer.h"
#include "services/records/recording/time_order.h"

namespace fulcrum::recording {
namespace {

using Bytes = std::vector<std::uint8_t>;

struct Sample {
  std::string topic;
  std::uint32_t sequence;
  std::uint64_t time_ns;
  Bytes data;
  bool operator==(const Sample&) const = default;
};

class McapTest : public testing::Test {
 protected:
  ~McapTest() override { std::filesystem::remove(file_); }

  /// Two topics; message i is i % 50 bytes long.
  void Fill(McapWriter* writer, int messages) {
    const std::uint16_t schema = writer->AddSchema("fulcrum::ToolState", "omgidl", "struct ToolState {};");
    const std::uint16_t tool = writer->AddChannel(schema, "tool_state", "cdr", {{"rate_Hz", "1000"}});
    const std::uint16_t health = writer->AddChannel(0, "health", "cdr", {});
    for (int i = 0; i < messages; ++i) {
      const bool is_tool = i % 5 != 0;
      const Bytes data(static_cast<std::size_t>(i % 50), static_cast<std::uint8_t>(7 * i));
      const auto number = static_cast<std::uint32_t>(i);
      const std::uint64_t time = 1'000'000'000 + std::uint64_t{number} * 1'000'000;
      writer->Write(is_tool ? tool : health, number, time, time - 5, std::as_bytes(std::span(data)));
      written_.push_back({is_tool ? "tool_state" : "health", number, time, data});
    }
  }
  std::vector<Sample> Read(McapReader* reader) const {
    std::vector<Sample> all;
    McapMessage message;
    while (reader->Next(&message)) {
      all.push_back({reader->channels().at(message.channel).topic, message.sequence, message.log_time_ns,
                     Bytes(message.data.begin(), message.data.end())});
    }
    return all;
  }
  Bytes FileBytes() const {
    std::ifstream in(file_, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  void Put(std::span<const std::uint8_t> bytes) const {
    // A new file each time: some file systems write a replaced file to the disk at once.
    std::filesystem::remove(file_);
    std::ofstream out(file_, std::ios::binary | std::ios::trunc);
    out.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  }
  /// True when `read` is a prefix of the written samples.
  bool IsBeginning(const std::vector<Sample>& read) const {
    return read.size() <= written_.size() && std::equal(read.begin(), read.end(), written_.begin());
  }

  const std::filesystem::path file_ =
      std::filesystem::path(testing::TempDir()) / ("fulcrum_" + std::to_string(getpid()) + ".mcap");
  std::vector<Sample> written_;
};

TEST_F(McapTest, WhatIsWrittenIsReadAgain) {
  {
    McapWriter writer(file_, "fulcrum", "fulcrum 0.1");
    writer.AddMetadata("session", {{"scene", "built-in"}, {"hash", "77"}});
    Fill(&writer, 3000);
    writer.EndChunk();
    EXPECT_EQ(writer.message_count(), 3000u);
    EXPECT_EQ(writer.error(), "");
  }
  McapReader reader(file_);
  EXPECT_EQ(Read(&reader), written_);
  EXPECT_TRUE(reader.closed());
  EXPECT_TRUE(reader.faults().empty());
  EXPECT_EQ(reader.profile(), "fulcrum");
  EXPECT_EQ(reader.metadata().at("session").at("hash"), "77");
  EXPECT_EQ(reader.schemas().at(1).text, "struct ToolState {};");
  EXPECT_EQ(reader.channels().at(0).metadata.at("rate_Hz"), "1000");
  EXPECT_EQ(reader.channels().at(1).schema, 0);
}

TEST_F(McapTest, AMessageMayBeLargerThanAChunk) {
  const Bytes large(3 * ChunkPacker::kChunkBytes + 17, 0x5a);
  {
    McapWriter writer(file_, "", "");
    const std::uint16_t channel = writer.AddChannel(0, "tissue", "cdr", {});
    writer.Write(channel, 0, 1, 1, std::as_bytes(std::span(large)));
    writer.Write(channel, 1, 2, 2, {});
  }
  McapReader reader(file_);
  const std::vector<Sample> read = Read(&reader);
  ASSERT_EQ(read.size(), 2u);
  EXPECT_EQ(read[0].data, large);
  EXPECT_TRUE(read[1].data.empty());
}

/// Three chunks: frames of 5 and 15 ms, tools of 1 … 20 ms, frames of 25 ms.
void FillApart(McapWriter* writer) {
  const std::uint16_t frame = writer->AddChannel(0, "frame", "cdr", {});
  const std::uint16_t tool = writer->AddChannel(0, "tool", "cdr", {});
  const auto write = [&](std::uint16_t channel, std::uint64_t ms, std::size_t size) {
    const Bytes data(size, static_cast<std::uint8_t>(ms));
    writer->Write(channel, static_cast<std::uint32_t>(ms), ms * 1'000'000, 0, std::as_bytes(std::span(data)));
  };
  write(frame, 5, 1000);
  write(frame, 15, 1000);
  writer->EndChunk();
  for (std::uint64_t ms = 1; ms <= 20; ++ms) write(tool, ms, 10);
  writer->EndChunk();
  write(frame, 25, 1000);
}

TEST_F(McapTest, ChunksThatOverlapInTimeAreReadByTime) {
  {
    McapWriter writer(file_, "", "");
    FillApart(&writer);
  }
  TimeOrder messages(file_);
  McapMessage message{};
  std::uint64_t last_ns = 0;
  int count = 0, frames = 0;
  while (messages.Next(&message)) {
    EXPECT_GE(message.log_time_ns, last_ns);
    last_ns = message.log_time_ns;
    const bool is_frame = messages.reader().channels().at(message.channel).topic == "frame";
    EXPECT_EQ(message.data.size(), is_frame ? 1000u : 10u);
    EXPECT_EQ(message.data[0], message.log_time_ns / 1'000'000);
    ++count;
    frames += is_frame ? 1 : 0;
  }
  EXPECT_EQ(count, 23);
  EXPECT_EQ(frames, 3);
}

TEST_F(McapTest, ChunksThatNobodyWantsAreNotUnpacked) {
  {
    McapWriter writer(file_, "", "");
    FillApart(&writer);
  }
  // Marks the first chunk as damaged, which is detected when it is unpacked.
  Bytes bytes = FileBytes();
  const Bytes zstd{0x28, 0xb5, 0x2f, 0xfd};
  const auto packed = std::search(bytes.begin(), bytes.end(), zstd.begin(), zstd.end());
  ASSERT_NE(packed, bytes.end());
  packed[8] ^= 0xff;
  Put(bytes);
  McapReader all(file_);
  EXPECT_EQ(Read(&all).size(), 21u);
  EXPECT_EQ(all.faults().size(), 1u);

  McapReader reader(file_);
  reader.PassOver([](const McapChannel& channel) { return channel.topic == "tool"; });
  const std::vector<Sample> read = Read(&reader);
  ASSERT_EQ(read.size(), 20u);
  for (const Sample& sample : read) EXPECT_EQ(sample.topic, "tool");
  EXPECT_EQ(reader.last_ns(), 25'000'000u) << "skipped chunks count, too";
  EXPECT_TRUE(reader.closed());
  EXPECT_TRUE(reader.faults().empty());
}

TEST_F(McapTest, AfterAKillItReadsUpToTheLastChunk) {
  const std::filesystem::path killed = file_.string() + ".killed";
  {
    McapWriter writer(file_, "", "");
    Fill(&writer, 100);
    writer.EndChunk();
    // The file as the operating system would keep it: nothing closes the writer.
    std::filesystem::copy_file(file_, killed, std::filesystem::copy_options::overwrite_existing);
  }
  McapReader reader(killed);
  EXPECT_EQ(Read(&reader), written_);
  EXPECT_FALSE(reader.closed());
  EXPECT_TRUE(reader.faults().empty());
  std::filesystem::remove(killed);
}

TEST_F(McapTest, CutOffAnywhereItIsReadAsFarAsItGoes) {
  {
    McapWriter writer(file_, "fulcrum", "");
    Fill(&writer, 60);
    writer.EndChunk();
    Fill(&writer, 60);
  }
  const Bytes whole = FileBytes();
  std::size_t most = 0;
  for (std::size_t length = 0; length < whole.size(); ++length) {
    Put(std::span(whole).first(length));
    if (length < kMcapMagic.size()) {
      EXPECT_THROW(McapReader{file_}, InputError);
      continue;
    }
    McapReader reader(file_);
    const std::vector<Sample> read = Read(&reader);
    ASSERT_TRUE(IsBeginning(read)) << "cut at " << length;
    ASSERT_GE(read.size(), most) << "cut at " << length;
    ASSERT_FALSE(reader.closed());
    most = read.size();
  }
  EXPECT_EQ(most, written_.size());
}

TEST_F(McapTest, DamageNeverCrashesAndIsTold) {
  {
    McapWriter writer(file_, "fulcrum", "test");
    for (int chunk = 0; chunk < 4; ++chunk) {
      Fill(&writer, 40);
      writer.EndChunk();
    }
  }
  const Bytes whole = FileBytes();
  std::mt19937 random(5);
  int told = 0;
  for (int trial = 0; trial < 3000; ++trial) {
    Bytes damaged = whole;
    for (std::uint32_t n = 1 + random() % 3; n > 0; --n) {
      std::uint8_t& byte = damaged[kMcapMagic.size() + random() % (whole.size() - kMcapMagic.size())];
      byte = random() % 4 == 0 ? 0xff : static_cast<std::uint8_t>(byte ^ (1u << random() % 8));
    }
    Put(damaged);
    McapReader reader(file_);
    McapMessage message;
    while (reader.Next(&message)) {
      ASSERT_LE(message.data.size(), 50u);
    }
    ASSERT_LE(reader.faults().size(), McapReader::kMostFaults);
    told += reader.faults().empty() ? 0 : 1;
  }
  EXPECT_GT(told, 1000);
}

TEST_F(McapTest, ADamagedChunkCostsItsOwnMessagesOnly) {
  std::vector<std::uint64_t> ends;
  {
    McapWriter writer(file_, "", "");
    for (int chunk = 0; chunk < 3; ++chunk) {
      Fill(&writer, 40);
      writer.EndChunk();
      ends.push_back(writer.bytes_written());
    }
  }
  // A byte within the packed body of the second chunk.
  Bytes damaged = FileBytes();
  damaged[(ends[0] + ends[1]) / 2] ^= 0x40;
  Put(damaged);
  McapReader reader(file_);
  EXPECT_EQ(Read(&reader).size(), 80u);
  ASSERT_EQ(reader.faults().size(), 1u);
  EXPECT_GT(reader.faults()[0].offset, ends[0]);
  EXPECT_LT(reader.faults()[0].offset, ends[1]);
  EXPECT_TRUE(reader.closed());
}

TEST_F(McapTest, AnIndexThatLooksLikeAMessageIsNone) {
  std::uint64_t index = 0;
  {
    McapWriter writer(file_, "", "");
    Fill(&writer, 40);
    writer.EndChunk();
    index = writer.bytes_written();
  }
  Bytes damaged = FileBytes();
  // The last of the indexes behind the chunk.
  const auto is_index = [&](std::uint64_t at) {
    std::uint64_t length = 0;
    std::memcpy(&length, damaged.data() + at + 1, sizeof length);
    return damaged[at] == static_cast<std::uint8_t>(Opcode::kMessageIndex) && at + kRecordHead + length == index;
  };
  std::uint64_t at = index - kRecordHead;
  while (at > 0 && !is_index(at)) --at;
  ASSERT_GT(at, 0u);
  damaged[at] = static_cast<std::uint8_t>(Opcode::kMessage);
  Put(damaged);
  McapReader reader(file_);
  EXPECT_EQ(Read(&reader).size(), 40u);
  ASSERT_EQ(reader.faults().size(), 1u);
  EXPECT_NE(reader.faults()[0].what.find("outside of the chunks"), std::string::npos) << reader.faults()[0].what;
}

TEST_F(McapTest, RecordsOfALaterVersionArePassedOver) {
  Bytes bytes(kMcapMagic.begin(), kMcapMagic.end());
  ByteWriter to(&bytes);
  to.Record(static_cast<Opcode>(0x7e), [&] { to.Text("from the future"); });
  to.Record(Opcode::kChannel, [&] {
    to.Number(std::uint16_t{4});
    to.Number(std::uint16_t{0});
    to.Text("health");
    to.Text("cdr");
    to.Texts({});
    to.Number(std::uint64_t{99});  // A field unknown to this reader.
  });
  to.Record(Opcode::kMessage, [&] {
    to.Number(std::uint16_t{4});
    to.Number(std::uint32_t{1});
    to.Number(std::uint64_t{2});
    to.Number(std::uint64_t{3});
  });
  Put(bytes);
  McapReader reader(file_);
  EXPECT_EQ(Read(&reader).size(), 1u);
  EXPECT_TRUE(reader.faults().empty());
}

TEST_F(McapTest, AFullDiskIsKeptAsErrorAndNothingMoreIsWritten) {
  McapWriter writer("/dev/full", "", "");
  Fill(&writer, 10);
  writer.EndChunk();
  EXPECT_NE(writer.error().find("No space left"), std::string::npos) << writer.error();
  EXPECT_EQ(writer.bytes_written(), 0u);
  writer.Close();
  EXPECT_EQ(writer.bytes_written(), 0u);
}

TEST_F(McapTest, WhatIsNoRecordingIsRefused) {
  EXPECT_THROW(McapReader("/nonexistent.mcap"), InputError);
  EXPECT_THROW(McapWriter("/nonexistent/x.mcap", "", ""), InputError);
  Put(Bytes(100, 'x'));
  EXPECT_THROW(McapReader{file_}, InputError);
}

}  // namespace
}  // namespace fulcrum::recording
