// The recorder without a bus: samples in, files out.
#include "services/records/recorder/recorder.h"

#include <gtest/gtest.h>

#include <cstring>
#include <thread>
#include <vector>

#include "services/records/recorder/dump_writer.h"
#include "services/records/recorder/priorities.h"
#include "services/records/recorder/recorded_type.h"
#include "services/records/recording/free_name.h"
#include "services/records/recording/time_order.h"
#include "services/transport/bus/convert/cdr.h"
#include "services/transport/bus/topics.h"
#include "tests/unit/recorder/recorder_fixture.h"

namespace fulcrum::recorder {
namespace {

constexpr std::int64_t kStart = 1'000'000 * kMs;

TEST(RecordedType, BlocksBeginBehindTheHeader) {
  TissueFrame frame;
  frame.header.vertex_count = 64;
  frame.xyz.assign(3 * 64, 0.1f);
  std::vector<std::uint8_t> bytes;
  ASSERT_TRUE(bus::EncodeCdr(frame, &bytes));
  constexpr std::size_t kCount_B = 4, kBlock_B = 400;
  EXPECT_EQ(TissueCoding().head_B + kCount_B + kBlock_B, bytes.size());
}

TEST_F(RecorderTest, KeepsTopicsAndWritersApartAndTellsOfThem) {
  {
    Recorder recorder(Settings());
    Send(&recorder, TopicId::kHealth, 1, 7, 40, 5 * kMs);
    Send(&recorder, TopicId::kHealth, 2, 1, 44, 6 * kMs);
    Send(&recorder, TopicId::kToolState, 1, 3, 48, 8 * kMs);
    Send(&recorder, TopicId::kHealth, 1, 8, 52, 9 * kMs);
    recorder.Close(10 * kMs);
    EXPECT_EQ(recorder.stats().received, 4u);
    EXPECT_EQ(recorder.stats().lost(), 0u);
  }
  McapReader reader(folder_ / "recording.mcap");
  const std::vector<Read> read = ReadAll(&reader);
  ASSERT_EQ(read.size(), 4u);
  EXPECT_TRUE(reader.closed());
  EXPECT_EQ(read[0].channel, read[3].channel);
  EXPECT_NE(read[0].channel, read[1].channel);
  EXPECT_EQ(read[3].sequence, 8u);
  EXPECT_EQ(read[3].size, 52u);
  EXPECT_EQ(read[2].publish_time_ns, 1000u + 8 * kMs);
  EXPECT_EQ(read[3].log_time_ns - read[0].log_time_ns, 4u * kMs);
  const auto& channel = reader.channels().at(read[1].channel);
  EXPECT_EQ(channel.topic, "fulcrum/Health");
  EXPECT_EQ(channel.metadata.at("node"), "node 2");
  EXPECT_EQ(channel.metadata.at("writer").substr(0, 4), "0200");
  const auto& schema = reader.schemas().at(channel.schema);
  EXPECT_EQ(schema.name, "fulcrum::idl::Health");
  EXPECT_NE(schema.text.find("struct Stamp"), std::string::npos) << "it contains the types that it uses";
  EXPECT_EQ(reader.metadata().at("session").at("scene"), "small");
  // Stamps and log times use the same clock.
  const auto offset = std::stoll(reader.metadata().at("clock").at("log_time_minus_monotonic_ns"));
  EXPECT_EQ(read[0].log_time_ns, static_cast<std::uint64_t>(offset + 5 * kMs));
}

TEST_F(RecorderTest, WhatOneWriterSentKeepsItsOrderWhateverTheClocksSay) {
  {
    Recorder recorder(Settings());
    Send(&recorder, TopicId::kHealth, 1, 1, 40, 5 * kMs);
    Send(&recorder, TopicId::kHealth, 1, 2, 40, 4 * kMs);
    Send(&recorder, TopicId::kHealth, 2, 1, 40, 3 * kMs);
    Send(&recorder, TopicId::kHealth, 1, 3, 40, 6 * kMs);
  }
  McapReader reader(folder_ / "recording.mcap");
  const std::vector<Read> read = ReadAll(&reader);
  ASSERT_EQ(read.size(), 4u);
  EXPECT_EQ(read[1].log_time_ns, read[0].log_time_ns);
  EXPECT_EQ(read[0].log_time_ns - read[2].log_time_ns, 2u * kMs);
  EXPECT_EQ(read[3].log_time_ns - read[0].log_time_ns, 1u * kMs);
}

TEST_F(RecorderTest, LargeTopicsHaveChunksOfTheirOwn) {
  {
    Recorder recorder(Settings());
    for (std::uint64_t i = 1; i <= 20; ++i) {
      const auto now = static_cast<std::int64_t>(i) * kMs;
      Send(&recorder, TopicId::kToolState, 1, i, 168, now);
      if (i % 5 == 0) Send(&recorder, TopicId::kTissueFrame, 2, i / 5, 3000, now);
    }
    recorder.Close(30 * kMs);
  }
  McapReader reader(folder_ / "recording.mcap");
  reader.PassOver([](const recording::McapChannel& channel) { return channel.topic != "fulcrum/TissueFrame"; });
  EXPECT_EQ(ReadAll(&reader).size(), 20u) << "no frame was read with the tools";
}

TEST_F(RecorderTest, EverySchemaIsThere) {
  {
    Recorder recorder(Settings());
    for (const auto& role : bus::kTopicRoles) Send(&recorder, role.id, 1, 1);
  }
  McapReader reader(folder_ / "recording.mcap");
  ASSERT_EQ(ReadAll(&reader).size(), static_cast<std::size_t>(kTopicCount));
  for (const auto& [number, schema] : reader.schemas()) {
    const std::string type = schema.name.substr(schema.name.rfind(':') + 1);
    EXPECT_NE(schema.text.find("struct " + type + " {"), std::string::npos) << schema.name;
    EXPECT_EQ(schema.text.find('#'), std::string::npos) << "no preprocessor";
  }
}

TEST_F(RecorderTest, WhatIsMissingIsCountedByTopicAndWrittenIntoTheFile) {
  RecorderSettings settings = Settings();
  settings.small_queue_B = 1000;
  {
    Recorder recorder(settings);
    Send(&recorder, TopicId::kToolState, 1, 100);
    Send(&recorder, TopicId::kToolState, 1, 104);  // three are missing
    Send(&recorder, TopicId::kTissueFrame, 1, 1);
    Send(&recorder, TopicId::kTissueFrame, 1, 3);
    Send(&recorder, TopicId::kHealth, 1, 1, 2000);  // no room
    Send(&recorder, TopicId::kHealth, 1, 1);        // a late copy is ignored
    EXPECT_EQ(recorder.stats().missed, 4u);
    EXPECT_EQ(recorder.stats().overflow, 1u);
    EXPECT_EQ(recorder.topic_stats(TopicId::kToolState).lost, 3u);
    EXPECT_EQ(recorder.topic_stats(TopicId::kTissueFrame).lost, 1u);
    EXPECT_EQ(recorder.topic_stats(TopicId::kHealth).lost, 1u);
    EXPECT_EQ(recorder.topic_stats(TopicId::kToolState).received, 2u);
  }
  McapReader reader(folder_ / "recording.mcap");
  EXPECT_EQ(ReadAll(&reader).size(), 4u);
  EXPECT_EQ(reader.metadata().at("lost ToolState").at("not_received"), "3");
  EXPECT_EQ(reader.metadata().at("lost Health").at("queue_full"), "1");
}

TEST_F(RecorderTest, NeitherPicturesNorHealthTakeTheRoomOfWhatAReplayNeeds) {
  RecorderSettings settings = Settings();
  settings.large_queue_B = 1000;
  settings.small_queue_B = 2000;
  {
    // The disk is stalled: nothing is flushed.
    Recorder recorder(settings);
    for (std::uint64_t i = 1; i <= 10; ++i) {
      Send(&recorder, TopicId::kTissueFrame, 1, i, 300);
      Send(&recorder, TopicId::kTemperaturePatch, 1, i, 300);
      Send(&recorder, TopicId::kHealth, 1, i, 300);
    }
    std::uint64_t sequence = 0;
    for (const auto& role : bus::kTopicRoles) {
      if (!IsDroppedFirst(role.id)) Send(&recorder, role.id, 2, ++sequence, 40);
    }
    EXPECT_EQ(recorder.stats().needed_lost, 0u);
    EXPECT_EQ(recorder.topic_stats(TopicId::kTissueFrame).lost, 8u);
    EXPECT_EQ(recorder.topic_stats(TopicId::kTemperaturePatch).lost, 9u);
    EXPECT_EQ(recorder.topic_stats(TopicId::kHealth).lost, 7u);
    EXPECT_EQ(recorder.topic_stats(TopicId::kTopologyState).received, 1u);
    EXPECT_EQ(recorder.topic_stats(TopicId::kTickManifest).received, 1u);
  }
  McapReader reader(folder_ / "recording.mcap");
  ReadAll(&reader);
  EXPECT_EQ(reader.metadata().at("lost TissueFrame").at("queue_full"), "8");
  EXPECT_FALSE(reader.metadata().contains("lost TopologyState"));
}

TEST_F(RecorderTest, ASampleThatAReplayNeedsIsCountedAsSuchWhenItIsLost) {
  Recorder recorder(Settings());
  Send(&recorder, TopicId::kTissueFrame, 1, 1);
  Send(&recorder, TopicId::kTissueFrame, 1, 4);
  EXPECT_EQ(recorder.stats().needed_lost, 0u);
  Send(&recorder, TopicId::kTopologyState, 1, 1);
  Send(&recorder, TopicId::kTopologyState, 1, 3);
  EXPECT_EQ(recorder.stats().needed_lost, 1u);
  EXPECT_EQ(recorder.stats().lost(), 3u);
}

TEST_F(RecorderTest, AfterAKillTheFileHoldsWhatIsOlderThanAChunkLasts) {
  Recorder recorder(Settings());
  Send(&recorder, TopicId::kToolState, 1, 1, 40, 0);
  recorder.Flush(50 * kMs);
  Send(&recorder, TopicId::kToolState, 1, 2, 40, 400 * kMs);
  recorder.Flush(Recorder::kLongestChunk_ns);
  Send(&recorder, TopicId::kToolState, 1, 3, 40, 600 * kMs);
  recorder.Flush(650 * kMs);
  // The file as the operating system would keep it: nothing closes the recorder.
  fs::copy_file(folder_ / "recording.mcap", folder_ / "killed.mcap");
  McapReader reader(folder_ / "killed.mcap");
  EXPECT_EQ(ReadAll(&reader).size(), 2u);
  EXPECT_FALSE(reader.closed());
  EXPECT_TRUE(reader.faults().empty());
}

TEST_F(RecorderTest, ADumpHoldsTheNewestPast) {
  RecorderSettings settings = Settings();
  settings.file.clear();
  settings.keep_s = 2;
  Recorder recorder(settings);
  for (std::uint64_t i = 1; i <= 100; ++i) {
    const std::int64_t now = static_cast<std::int64_t>(i) * 100 * kMs;
    Send(&recorder, TopicId::kToolState, 1, i, 40, now);
    recorder.Flush(now);
  }
  recorder.Dump(folder_ / "dump.mcap", "a node died", 10'000 * kMs);
  McapReader reader(folder_ / "dump.mcap");
  const std::vector<Read> read = ReadAll(&reader);
  EXPECT_TRUE(reader.closed());
  ASSERT_FALSE(read.empty());
  EXPECT_EQ(read.back().sequence, 100u);
  // The oldest chunk may begin before the two seconds, by its duration.
  EXPECT_LE(read.front().sequence, 80u);
  EXPECT_GE(read.front().sequence, 72u);
  EXPECT_EQ(reader.metadata().at("dump").at("reason"), "a node died");
  EXPECT_FALSE(fs::exists(folder_ / "recording.mcap"));
}

TEST_F(RecorderTest, ADumpHoldsFramesThatAreNewerThanTheNewestSmallSample) {
  RecorderSettings settings = Settings();
  settings.file.clear();
  settings.keep_s = 30;
  Recorder recorder(settings);
  std::uint64_t frames = 0, tools = 0;
  for (std::int64_t ms = 0; ms < 1500; ++ms) {
    if (ms % 10 == 0) Send(&recorder, TopicId::kTissueFrame, 2, ++frames, 3000, kStart + ms * kMs + 1000);
    Send(&recorder, TopicId::kToolState, 1, ++tools, 168, kStart + ms * kMs - 3000);
    if (ms % 50 == 0) recorder.Flush(kStart + ms * kMs);
  }
  recorder.Dump(folder_ / "dump.mcap", "", kStart + 1500 * kMs);
  McapReader reader(folder_ / "dump.mcap");
  EXPECT_EQ(ReadAll(&reader).size(), frames + tools);
}

TEST_F(RecorderTest, WhatWaitedForTheDiskIsReadInOrderOfTime) {
  std::uint64_t frames = 0, tools = 0;
  {
    Recorder recorder(Settings());
    for (std::int64_t ms = 0; ms < 5500; ++ms) {
      const std::int64_t now = kStart + ms * kMs;
      Send(&recorder, TopicId::kToolState, 1, ++tools, 168, now);
      if (ms % 10 == 0) Send(&recorder, TopicId::kTissueFrame, 2, ++frames, 3000, now);
      const bool disk_stands_still = ms > 1000 && ms < 4500;
      if (ms % 50 == 0 && !disk_stands_still) recorder.Flush(now);
    }
    recorder.Close(kStart + 5500 * kMs);
  }
  recording::TimeOrder messages(folder_ / "recording.mcap");
  std::uint64_t newest_ns = 0, count = 0;
  for (McapMessage m; messages.Next(&m); ++count) {
    EXPECT_GE(m.log_time_ns, newest_ns) << "message " << count;
    newest_ns = m.log_time_ns;
    if (HasFailure()) break;
  }
  EXPECT_EQ(count, frames + tools);
}

TEST_F(RecorderTest, WhatIsKeptForADumpIsBounded) {
  RecorderSettings settings = Settings();
  settings.file.clear();
  settings.keep_s = 1000;
  settings.keep_B = 20'000;
  Recorder recorder(settings);
  for (std::uint64_t i = 1; i <= 200; ++i) {
    const std::int64_t now = static_cast<std::int64_t>(i) * 1000 * kMs;
    Send(&recorder, TopicId::kToolState, 1, i, 40, now);
    recorder.Flush(now + 500 * kMs);
  }
  recorder.Dump(folder_ / "dump.mcap", "", 0);
  McapReader reader(folder_ / "dump.mcap");
  EXPECT_EQ(ReadAll(&reader).back().sequence, 200u);
  EXPECT_LT(fs::file_size(folder_ / "dump.mcap"), 60'000u) << "schema, index and the kept samples";
}

TEST_F(RecorderTest, ADumpIsWrittenOnceForWhatWasAskedLast) {
  RecorderSettings settings = Settings();
  settings.file.clear();
  settings.keep_s = 2;
  Recorder recorder(settings);
  DumpWriter dumps(&recorder, folder_);
  dumps.WriteIfAsked(0);
  EXPECT_TRUE(fs::is_empty(folder_)) << "no dump was requested";
  Send(&recorder, TopicId::kToolState, 1, 1);
  EXPECT_EQ(dumps.Ask("first"), "writing the last seconds into " + folder_.string());
  EXPECT_TRUE(fs::is_empty(folder_)) << "written by the other thread";
  EXPECT_NE(dumps.Ask("second"), "");
  dumps.WriteIfAsked(kMs);
  dumps.WriteIfAsked(2 * kMs);
  McapReader reader(folder_ / "dump.mcap");
  EXPECT_EQ(ReadAll(&reader).size(), 1u);
  EXPECT_EQ(reader.metadata().at("dump").at("reason"), "second");
  EXPECT_FALSE(fs::exists(folder_ / "dump-2.mcap"));
}

TEST_F(RecorderTest, ADumpThatCannotBeWrittenDoesNotEndTheRecording) {
  RecorderSettings settings = Settings();
  settings.keep_s = 2;
  Recorder recorder(settings);
  DumpWriter dumps(&recorder, folder_ / "missing");
  dumps.Ask("a node died");
  EXPECT_NO_THROW(dumps.WriteIfAsked(0));
  Send(&recorder, TopicId::kToolState, 1, 1);
  recorder.Close(kMs);
  McapReader reader(folder_ / "recording.mcap");
  EXPECT_EQ(ReadAll(&reader).size(), 1u);
}

TEST_F(RecorderTest, ThreadsOfTheBusDoNotDisturbOneAnother) {
  constexpr std::uint64_t kSamples = 3000;
  {
    Recorder recorder(Settings());
    std::vector<std::jthread> threads;
    for (std::uint8_t writer = 1; writer <= 3; ++writer) {
      threads.emplace_back([&recorder, writer] {
        for (std::uint64_t i = 1; i <= kSamples; ++i) Send(&recorder, TopicId::kHealth, writer, i, 100 + writer);
      });
    }
    for (int i = 0; i < 50; ++i) recorder.Flush(0);
    threads.clear();
    EXPECT_EQ(recorder.stats().lost(), 0u);
  }
  McapReader reader(folder_ / "recording.mcap");
  std::map<std::uint16_t, std::uint32_t> last;
  std::uint64_t count = 0;
  for (const Read& read : ReadAll(&reader)) {
    EXPECT_EQ(read.sequence, ++last[read.channel]);
    ++count;
  }
  EXPECT_EQ(count, 3 * kSamples);
}

TEST_F(RecorderTest, ARecordingIsNeverReplaced) {
  const fs::path wanted = folder_ / "r.mcap";
  EXPECT_EQ(recording::FreeName(wanted), wanted);
  for (const char* name : {"r.mcap", "r-2.mcap"}) {
    recording::McapWriter(folder_ / name, "", "");
  }
  EXPECT_EQ(recording::FreeName(wanted), folder_ / "r-3.mcap");
}

}  // namespace
}  // namespace fulcrum::recorder
