// The tools of `fulcrum log` on recordings with known content.
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <iterator>
#include <limits>
#include <sstream>

#include "services/base/core/error.h"
#include "services/records/log_tools/text.h"
#include "services/records/log_tools/tools.h"
#include "services/records/recorder/recorder.h"
#include "services/records/recording/mcap_index.h"
#include "services/records/recording/mcap_writer.h"
#include "services/transport/bus/hex.h"
#include "services/transport/bus/schema.h"
#include "tests/unit/bus/same.h"
#include "tests/unit/bus/samples.h"

namespace fulcrum::log_tools {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kBegin_ns = 1'700'000'000'000'000'000;
constexpr std::uint64_t kStep_ns = 10'000'000;

class LogTools : public testing::Test {
 protected:
  LogTools() { fs::create_directory(folder_); }
  ~LogTools() override { fs::remove_all(folder_); }

  /// One message of each topic, 10 ms apart, and three more ToolStates after a gap of two.
  fs::path Make(const std::string& name, const std::function<void(ToolState*)>& change = {}) const {
    const fs::path file = folder_ / name;
    recording::McapWriter writer(file, "fulcrum", "fulcrum test");
    writer.AddMetadata("session", {{"id", "s-1"}, {"scene", "small"}, {"scene_hash", "77"}});
    std::uint64_t time = kBegin_ns;
    for (const bus::TopicRole& role : bus::kTopicRoles) {
      const std::string type(bus::TopicLabel(role.id));
      const std::uint16_t schema = writer.AddSchema("fulcrum::idl::" + type, "omgidl", bus::SchemaText(type));
      const std::uint16_t channel = writer.AddChannel(schema, role.name, "cdr", {{"node", "some_node"}});
      bus::WithMessageOf(role.id, [&]<class T>(std::type_identity<T>) {
        Write(&writer, channel, 7, &time, bus::test::Sample<T>());
        if constexpr (std::is_same_v<T, ToolState>) {
          for (std::uint32_t sequence = 10; sequence < 13; ++sequence) {
            ToolState m = bus::test::Sample<ToolState>(sequence);
            if (change && sequence == 11) change(&m);
            Write(&writer, channel, sequence, &time, m);
          }
        }
      });
    }
    return file;
  }
  template <class T>
  static void Write(recording::McapWriter* writer, std::uint16_t channel, std::uint32_t sequence, std::uint64_t* time,
                    const T& message) {
    std::vector<std::uint8_t> bytes;
    ASSERT_TRUE(bus::EncodeCdr(message, &bytes));
    writer->Write(channel, sequence, *time, *time - 1, std::as_bytes(std::span(bytes)));
    *time += kStep_ns;
  }
  static std::vector<std::string> Lines(const std::string& text) {
    std::istringstream in(text);
    std::vector<std::string> lines;
    for (std::string line; std::getline(in, line);) lines.push_back(line);
    return lines;
  }
  static std::string Text(const fs::path& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }

  const fs::path folder_ = fs::path(testing::TempDir()) / ("log_tools_" + std::to_string(getpid()));
};

TEST_F(LogTools, EveryMessageComesBackFromItsBytes) {
  for (const bus::TopicRole& role : bus::kTopicRoles) {
    bus::WithMessageOf(role.id, [&]<class T>(std::type_identity<T>) {
      std::vector<std::uint8_t> bytes;
      T back;
      ASSERT_TRUE(bus::EncodeCdr(bus::test::Sample<T>(), &bytes));
      ASSERT_TRUE(bus::DecodeCdr(bytes, &back));
      EXPECT_TRUE(Same(back, bus::test::Sample<T>())) << role.name;
      // Truncated at any length, it is refused.
      for (std::size_t size = 0; size < bytes.size(); size += 1 + bytes.size() / 50) {
        EXPECT_FALSE(bus::DecodeCdr(std::span(bytes).first(size), &back)) << role.name << " of " << size;
      }
    });
  }
}

TEST_F(LogTools, InfoTellsSessionTopicsAndLosses) {
  std::ostringstream out;
  PrintInfo(Make("a.mcap"), &out);
  const std::string text = out.str();
  const std::string figures = std::to_string(kTopicCount + 3) + " messages · 2 lost";
  // A message each hundredth of a second.
  const std::string length = "0." + std::to_string(kTopicCount + 2) + " s";
  for (const std::string& part : {std::string("complete"), std::string("scene \"small\" 77"),
                                  "2023-11-14 22:13:20 UTC · " + length + " · " + figures}) {
    EXPECT_NE(text.find(part), std::string::npos) << part << " in\n" << text;
  }
  for (const bus::TopicRole& role : bus::kTopicRoles) {
    EXPECT_NE(text.find(bus::TopicLabel(role.id)), std::string::npos) << role.name;
  }
}

TEST_F(LogTools, ListNamesWhatIsThereAndWhatIsNone) {
  Make("a.mcap");
  std::ofstream(folder_ / "b.mcap") << "no recording";
  std::ostringstream out;
  PrintList(folder_, &out);
  EXPECT_NE(out.str().find("0.2 s"), std::string::npos) << out.str();
  EXPECT_NE(out.str().find("! " + (folder_ / "b.mcap").string()), std::string::npos) << out.str();
  EXPECT_THROW(PrintList(folder_ / "none", &out), InputError);
}

TEST_F(LogTools, CatPrintsOneObjectALineAndFilters) {
  const fs::path file = Make("a.mcap");
  std::ostringstream all, some;
  PrintMessages(file, {}, 4, &all);
  EXPECT_EQ(Lines(all.str()).size(), kTopicCount + 3u);
  EXPECT_NE(all.str().find("61664 more\"]"), std::string::npos) << "long lists are truncated";
  PrintMessages(file, {{"ToolState"}, 0.025, 0.045}, 100, &some);
  ASSERT_EQ(Lines(some.str()).size(), 2u) << some.str();
  const std::string line = Lines(some.str())[0];
  EXPECT_TRUE(line.starts_with("{\"time_s\":0.030000,")) << line;
  EXPECT_NE(line.find("\"sequence\":11,\"message\":{\"stamp\":{\"sequence\":11,\"epoch\":12,\"stamp_ns\":2000}"),
            std::string::npos)
      << line;
  EXPECT_THROW(PrintMessages(file, {{"ToolStat"}, 0, 1}, 4, &all), InputError);
}

TEST_F(LogTools, NumbersPrintSoThatTheyReadBackTheSame) {
  std::string text;
  PutJson(0.1f, 1, &text);
  EXPECT_EQ(text, "0.1");
  EXPECT_EQ(std::strtof(text.c_str(), nullptr), 0.1f);
  text.clear();
  PutJson(std::numeric_limits<std::uint64_t>::max(), 1, &text);
  EXPECT_EQ(text, "18446744073709551615");
  text.clear();
  PutJson(std::numeric_limits<float>::quiet_NaN(), 1, &text);
  EXPECT_EQ(text, "null");
  EXPECT_EQ(JsonString("a\"\\\n"), "\"a\\\"\\\\\\u000a\"");
}

TEST_F(LogTools, ExportWritesATableATopic) {
  const fs::path file = Make("a.mcap");
  const std::vector<fs::path> tables = ExportTables(file, {}, folder_ / "tables");
  EXPECT_EQ(tables.size(), static_cast<std::size_t>(kTopicCount));
  const std::vector<std::string> lines = Lines(Text(folder_ / "tables" / "ToolState.csv"));
  ASSERT_EQ(lines.size(), 5u);
  EXPECT_TRUE(lines[0].starts_with("time_s,node,stamp.sequence,stamp.epoch,stamp.stamp_ns,tools[0].kind")) << lines[0];
  EXPECT_TRUE(lines[2].starts_with("0.020000,some_node,10,12,2000,1,1,0.1,")) << lines[2];
  const auto columns = [](const std::string& line) { return std::count(line.begin(), line.end(), ','); };
  for (const std::string& line : lines) EXPECT_EQ(columns(line), columns(lines[0]));
  EXPECT_THROW((void)ExportTables(file, {}, folder_ / "tables"), InputError) << "existing files are not replaced";
}

TEST_F(LogTools, ExportReportsATableThatIsNotWholeOnTheDisk) {
  const fs::path file = Make("a.mcap");
  // The few rows are in the stream's buffer until the table is closed.
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  const rlimit small{64, before.rlim_max};
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &small), 0);
  std::string said;
  try {
    (void)ExportTables(file, {.topics = {"ToolState"}}, folder_ / "tables");
  } catch (const InputError& error) {
    said = error.what();
  }
  ::setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  EXPECT_EQ(said, (folder_ / "tables" / "ToolState.csv").string() + ": cannot be written; is the disk full?");
}

TEST_F(LogTools, VerifyFindsGapsDamageAndWhatNoNodeWouldUse) {
  std::ostringstream out;
  EXPECT_EQ(Verify(Make("gap.mcap"), &out), ExitCode::kFailure);
  EXPECT_NE(out.str().find("ToolState: 2 messages are missing"), std::string::npos) << out.str();
  EXPECT_NE(out.str().find("1 problems"), std::string::npos) << "no further problems\n" << out.str();

  const fs::path nan = Make("nan.mcap", [](ToolState* m) { m->tools[0].f_W.x() = NAN; });
  out.str("");
  (void)Verify(nan, &out);
  EXPECT_NE(out.str().find("ToolState: 1 messages do not pass the gate"), std::string::npos) << out.str();

  std::string bytes = Text(nan);
  std::ofstream(folder_ / "cut.mcap", std::ios::binary) << bytes.substr(0, bytes.size() / 2);
  out.str("");
  EXPECT_EQ(Verify(folder_ / "cut.mcap", &out), ExitCode::kFailure);
  EXPECT_NE(out.str().find("the file ends within a record"), std::string::npos) << out.str();
  EXPECT_NE(out.str().find("not closed"), std::string::npos) << out.str();
}

TEST_F(LogTools, VerifyFindsWhatWasWrittenTooLateToBeReadInOrder) {
  const fs::path file = folder_ / "late.mcap";
  {
    recording::McapWriter writer(file, "fulcrum", "fulcrum test");
    const std::uint16_t schema = writer.AddSchema("fulcrum::idl::ToolState", "omgidl", bus::SchemaText("ToolState"));
    std::vector<std::uint16_t> channels;
    for (const char* node : {"one", "another"}) {
      channels.push_back(writer.AddChannel(schema, "fulcrum/ToolState", "cdr", {{"node", node}}));
    }
    for (const std::uint16_t channel : channels) {
      std::uint64_t time = kBegin_ns;
      for (std::uint32_t i = 1; i <= 350; ++i) Write(&writer, channel, i, &time, bus::test::Sample<ToolState>(i));
    }
  }
  std::ostringstream out;
  EXPECT_EQ(Verify(file, &out), ExitCode::kFailure);
  EXPECT_NE(out.str().find("messages were written so late"), std::string::npos) << out.str();
}

TEST_F(LogTools, ADamagedIndexIsFound) {
  const fs::path file = Make("a.mcap");
  const std::string bytes = Text(file);
  std::uint64_t messages = 0;
  EXPECT_TRUE(recording::CheckIndex(file, &messages).empty());
  EXPECT_EQ(messages, kTopicCount + 3u);
  int found = 0, tried = 0;
  // The summary follows the end of the data.
  for (std::size_t at = bytes.size() - 1500; at < bytes.size() - 8; at += 7, ++tried) {
    std::string damaged = bytes;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x20);
    // A new file each time: some file systems write a replaced file to the disk at once.
    fs::remove(folder_ / "damaged.mcap");
    std::ofstream(folder_ / "damaged.mcap", std::ios::binary) << damaged;
    found += recording::CheckIndex(folder_ / "damaged.mcap", &messages).empty() ? 0 : 1;
  }
  EXPECT_EQ(found, tried);
}

TEST_F(LogTools, DiffNamesTheFirstFieldThatDiffers) {
  const fs::path a = Make("a.mcap"), same = Make("b.mcap");
  const fs::path other = Make("c.mcap", [](ToolState* m) {
    m->stamp.stamp_ns = 1;
    m->tools[1].f_W.y() = 0.5f;
  });
  std::ostringstream out;
  EXPECT_EQ(Diff(a, same, {}, "", &out), ExitCode::kDone) << out.str();
  out.str("");
  EXPECT_EQ(Diff(a, other, {}, "", &out), ExitCode::kFailure);
  EXPECT_NE(out.str().find("first at sequence 11: stamp.stamp_ns = 2000 | 1"), std::string::npos) << out.str();
  out.str("");
  EXPECT_EQ(Diff(a, other, {}, "stamp", &out), ExitCode::kFailure);
  EXPECT_NE(out.str().find("first at sequence 11: tools[1].f_W[1] = "), std::string::npos) << out.str();
  EXPECT_NE(out.str().find(" | 0.5"), std::string::npos) << out.str();
  out.str("");
  EXPECT_EQ(Diff(a, other, {{"Health"}}, "", &out), ExitCode::kDone) << "only the requested topics are compared";
}

/// Health #1 of each node, and so many ThermalEvents of thermal_node.
fs::path MakeWithEvents(const fs::path& file, const std::vector<std::string>& nodes, std::uint32_t events) {
  recording::McapWriter writer(file, "fulcrum", "fulcrum test");
  const auto write = [&](std::uint16_t channel, std::uint32_t sequence, const auto& message) {
    std::vector<std::uint8_t> bytes;
    EXPECT_TRUE(bus::EncodeCdr(message, &bytes));
    const std::uint64_t time = kBegin_ns + sequence * kStep_ns;
    writer.Write(channel, sequence, time, time, std::as_bytes(std::span(bytes)));
  };
  for (const std::string& node : nodes) {
    write(writer.AddChannel(0, bus::RoleOf<Health>().name, "cdr", {{"node", node}}), 1, bus::test::Sample<Health>());
  }
  if (events == 0) return file;
  const std::uint16_t channel =
      writer.AddChannel(0, bus::RoleOf<ThermalEvent>().name, "cdr", {{"node", "thermal_node"}});
  for (std::uint32_t i = 1; i <= events; ++i) write(channel, i, bus::test::Sample<ThermalEvent>());
  return file;
}

TEST_F(LogTools, DiffFindsAStreamThatOneSideLacks) {
  const fs::path with = MakeWithEvents(folder_ / "a.mcap", {"physics_node", "thermal_node"}, 3);
  const fs::path silent = MakeWithEvents(folder_ / "b.mcap", {"physics_node", "thermal_node"}, 0);
  const fs::path without = MakeWithEvents(folder_ / "c.mcap", {"physics_node"}, 0);
  std::ostringstream out;
  EXPECT_EQ(Diff(with, silent, {}, "", &out), ExitCode::kFailure) << "thermal_node published no event";
  EXPECT_EQ(Diff(silent, with, {}, "", &out), ExitCode::kFailure);
  EXPECT_EQ(Diff(with, without, {}, "", &out), ExitCode::kDone) << "a session without thermal_node";
}

TEST_F(LogTools, DiffOfNothingIsNoAgreement) {
  const fs::path a = MakeWithEvents(folder_ / "a.mcap", {"physics_node"}, 0);
  const fs::path b = MakeWithEvents(folder_ / "b.mcap", {"thermal_node"}, 0);
  std::ostringstream out;
  for (const auto& [filter, second] : std::vector<std::pair<Filter, fs::path>>{
           {{}, b}, {{{"OperatorInput"}}, a}, {{.topics = {}, .from_s = 1000}, a}}) {
    try {
      (void)Diff(a, second, filter, "", &out);
      ADD_FAILURE() << out.str();
    } catch (const InputError& error) {
      EXPECT_EQ(std::string(error.what()).find("nothing to compare: "), 0u) << error.what();
    }
  }
}

/// Three ToolStates of another layout: all bytes behind the head have this value.
fs::path MakeUndecodable(const fs::path& file, std::uint8_t value, const std::string& schema_hash) {
  recording::McapWriter writer(file, "fulcrum", "fulcrum 0.0.9");
  writer.AddMetadata("versions", {{"schema_hash", schema_hash}});
  const std::uint16_t channel = writer.AddChannel(0, bus::RoleOf<ToolState>().name, "cdr", {{"node", "haptics_node"}});
  for (std::uint32_t i = 1; i <= 3; ++i) {
    std::vector<std::uint8_t> bytes(24, value);
    bytes[0] = bytes[2] = bytes[3] = 0;
    bytes[1] = 1;
    writer.Write(channel, i, kBegin_ns + i * kStep_ns, kBegin_ns + i * kStep_ns, std::as_bytes(std::span(bytes)));
  }
  return file;
}

TEST_F(LogTools, DiffComparesTheBytesOfMessagesThatCannotBeDecoded) {
  const fs::path a = MakeUndecodable(folder_ / "a.mcap", 7, "old"), b = MakeUndecodable(folder_ / "b.mcap", 8, "old"),
                 same = MakeUndecodable(folder_ / "c.mcap", 7, "old");
  std::ostringstream out;
  EXPECT_EQ(Diff(a, b, {}, "", &out), ExitCode::kFailure);
  EXPECT_NE(out.str().find("3 in both, 3 different"), std::string::npos) << out.str();
  EXPECT_NE(out.str().find("first at sequence 1, in the first it cannot be decoded (schema old of the file, "),
            std::string::npos)
      << out.str();
  EXPECT_EQ(Diff(a, same, {}, "", &out), ExitCode::kDone);
}

TEST_F(LogTools, ExportRefusesMessagesThatCannotBeDecoded) {
  std::string said;
  try {
    (void)ExportTables(MakeUndecodable(folder_ / "a.mcap", 7, "old"), {}, folder_ / "tables");
  } catch (const MismatchError& error) {
    said = error.what();
  }
  EXPECT_NE(said.find("3 messages of ToolState; schema old of the file, "), std::string::npos) << said;
  EXPECT_FALSE(fs::exists(folder_ / "tables" / "ToolState.csv")) << "no empty table";
  const fs::path damaged = MakeUndecodable(folder_ / "b.mcap", 7, bus::Hex(bus::SchemaHash()));
  EXPECT_THROW((void)ExportTables(damaged, {}, folder_ / "tables"), InputError);
}

TEST_F(LogTools, AMessageThatWasReceivedLateIsNotPassedOver) {
  const fs::path file = folder_ / "late.mcap";
  {
    // As after a start on a busy machine: the setting was sent first but received seconds later.
    recording::McapWriter writer(file, "fulcrum", "fulcrum test");
    const std::uint16_t tools = writer.AddChannel(0, bus::RoleOf<ToolState>().name, "cdr", {});
    const std::uint16_t settings = writer.AddChannel(0, bus::RoleOf<GeneratorSetting>().name, "cdr", {});
    std::uint64_t time = kBegin_ns;
    for (std::uint32_t i = 1; i <= 500; ++i) Write(&writer, tools, i, &time, bus::test::Sample<ToolState>(i));
    std::uint64_t before = kBegin_ns - 1'000'000'000;
    Write(&writer, settings, 1, &before, bus::test::Sample<GeneratorSetting>());
  }
  Recording recording(file);
  Entry entry;
  std::map<std::string, int> count;
  while (recording.Next(&entry)) ++count[entry.source->name];
  EXPECT_EQ(count["GeneratorSetting"], 1);
  EXPECT_EQ(count["ToolState"], 500);
}

TEST_F(LogTools, RecoverMendsWhatAKillHasLeft) {
  const fs::path cut = folder_ / "cut.mcap";
  {
    recording::McapWriter writer(cut, "fulcrum", "fulcrum test");
    writer.AddMetadata("session", {{"scene", "small"}});
    const std::uint16_t channel =
        writer.AddChannel(writer.AddSchema("fulcrum::idl::Health", "omgidl", "struct Health {};"), "fulcrum/Health",
                          "cdr", {{"node", "n"}});
    std::uint64_t time = kBegin_ns;
    for (std::uint32_t i = 1; i <= 5; ++i) Write(&writer, channel, i, &time, bus::test::Sample<Health>(i));
    writer.EndChunk();
    fs::copy_file(cut, folder_ / "killed.mcap");
  }
  EXPECT_EQ(Recover(folder_ / "killed.mcap", folder_ / "mended.mcap").size(), 1u) << "the file was not closed";
  std::ostringstream out;
  EXPECT_EQ(Verify(folder_ / "mended.mcap", &out), ExitCode::kDone) << out.str();
  EXPECT_NE(out.str().find("5 messages, all well"), std::string::npos) << out.str();
  recording::McapReader reader(folder_ / "mended.mcap");
  recording::McapMessage message;
  while (reader.Next(&message)) {
  }
  EXPECT_EQ(reader.schemas().at(1).text, "struct Health {};");
  EXPECT_EQ(reader.channels().at(0).metadata.at("node"), "n");
  EXPECT_EQ(reader.metadata().at("session").at("scene"), "small");
  EXPECT_THROW((void)Recover(folder_ / "killed.mcap", folder_ / "mended.mcap"), InputError)
      << "existing files are not replaced";
}

/// Frames as a recorder writes them, read by the tools.
TEST_F(LogTools, RecordedPositionsAreThoseOfTheBus) {
  const fs::path file = folder_ / "frames.mcap", copy = folder_ / "copy.mcap";
  std::vector<TissueFrame> sent;
  {
    recorder::RecorderSettings settings;
    settings.file = file;
    recorder::Recorder recorder(settings);
    for (std::uint64_t i = 1; i <= 5; ++i) {
      TissueFrame frame = bus::test::Sample<TissueFrame>(i);
      for (float& value : frame.xyz) value += 1e-4F * static_cast<float>(i);
      ASSERT_TRUE(RoundPositions(frame.xyz));
      std::vector<std::uint8_t> bytes;
      ASSERT_TRUE(bus::EncodeCdr(frame, &bytes));
      bus::RawSample sample{TopicId::kTissueFrame, {1}, i, 1000, static_cast<std::int64_t>(i) * 1000, {}, {}};
      constexpr std::size_t kEncapsulation_B = 4;
      sample.head = std::as_bytes(std::span(bytes)).first(kEncapsulation_B);
      sample.body = std::as_bytes(std::span(bytes)).subspan(kEncapsulation_B);
      recorder.Receive(sample);
      sent.push_back(std::move(frame));
    }
  }
  EXPECT_LT(fs::file_size(file), 40'000u);
  EXPECT_TRUE(Recover(file, copy).empty());
  for (const fs::path& from : {file, copy}) {
    Recording recording(from);
    Entry entry;
    std::size_t read = 0;
    while (recording.Next(&entry)) {
      TissueFrame frame;
      ASSERT_TRUE(bus::DecodeCdr(entry.message.data, &frame));
      EXPECT_TRUE(Same(frame, sent[read++])) << from << " " << read;
    }
    EXPECT_EQ(read, sent.size());
  }
}

TEST_F(LogTools, WhatIsNoRecordingIsRefused) {
  std::ostringstream out;
  EXPECT_THROW(PrintInfo(folder_ / "none.mcap", &out), InputError);
  EXPECT_THROW((void)Verify(folder_ / "none.mcap", &out), InputError);
  EXPECT_THROW((void)Recover(folder_ / "none.mcap", folder_ / "x.mcap"), InputError);
  EXPECT_FALSE(fs::exists(folder_ / "x.mcap"));
}

}  // namespace
}  // namespace fulcrum::log_tools
