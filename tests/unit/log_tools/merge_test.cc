// Merging recordings of one session that were written by a restarted recorder.
#include "services/records/log_tools/merge.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <map>

#include "services/base/core/error.h"
#include "services/records/log_tools/tools.h"
#include "services/records/recorder/recorder.h"
#include "services/records/recording/mcap_index.h"
#include "services/records/recording/time_order.h"
#include "services/transport/bus/topics.h"

namespace fulcrum::log_tools {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kMs = 1'000'000;
constexpr std::array<std::byte, 4> kHead{};

class Merging : public testing::Test {
 protected:
  Merging() { fs::create_directory(folder_); }
  ~Merging() override { fs::remove_all(folder_); }

  static void Send(recorder::Recorder* recorder, TopicId topic, std::uint8_t writer, std::uint64_t sequence,
                   std::int64_t now_ns) {
    const std::vector<std::byte> body(40, static_cast<std::byte>(sequence));
    recorder->Receive({topic, {writer}, sequence, 1000 + now_ns, now_ns, kHead, body});
  }
  /// Each of `writer`'s ToolStates from `first` to `last`, one a millisecond, and a frame every ten.
  fs::path Record(const std::string& name, std::uint64_t first, std::uint64_t last, const std::string& session = "s-1",
                  const std::string& hash = "77") const {
    recorder::RecorderSettings settings;
    settings.file = folder_ / name;
    settings.keep_free_B = 0;
    settings.metadata = {{"session", {{"id", session}, {"scene", "small"}, {"scene_hash", hash}}},
                         {"versions", {{"schema_hash", "88"}}}};
    recorder::Recorder recorder(settings);
    for (std::uint64_t i = first; i <= last; ++i) {
      const auto now_ns = static_cast<std::int64_t>(i) * kMs;
      Send(&recorder, TopicId::kToolState, 1, i, now_ns);
      if (i % 10 == 0) Send(&recorder, TopicId::kTissueFrame, 2, i / 10, now_ns);
      if (i % 100 == 0) recorder.Flush(now_ns);
    }
    recorder.Close(0);
    return settings.file;
  }
  /// Truncates a file as a kill does: within a record, before its summary.
  static void Kill(const fs::path& file) {
    recording::McapReader reader(file);
    fs::resize_file(file, fs::file_size(file) / 2);
  }
  struct Content {
    std::map<std::string, std::vector<std::uint32_t>> sequences;
    bool in_order = true, closed = false;
    std::map<std::string, std::map<std::string, std::string>> metadata;
    std::size_t channels = 0, schemas = 0;
  };
  static Content Read(const fs::path& file) {
    recording::TimeOrder messages(file);
    Content content;
    recording::McapMessage message;
    std::uint64_t last_ns = 0;
    while (messages.Next(&message)) {
      content.sequences[messages.reader().channels().at(message.channel).topic].push_back(message.sequence);
      content.in_order &= message.log_time_ns >= last_ns;
      last_ns = message.log_time_ns;
    }
    content.closed = messages.reader().closed() && messages.reader().faults().empty();
    content.metadata = messages.reader().metadata();
    content.channels = messages.reader().channels().size();
    content.schemas = messages.reader().schemas().size();
    return content;
  }
  static std::vector<std::uint32_t> Range(std::uint32_t first, std::uint32_t last) {
    std::vector<std::uint32_t> all;
    for (std::uint32_t i = first; i <= last; ++i) all.push_back(i);
    return all;
  }

  const fs::path folder_ = fs::path(testing::TempDir()) / ("merging_" + std::to_string(getpid()));
};

TEST_F(Merging, KeepsEveryMessageOnceAndInOrder) {
  const fs::path one = Record("a.mcap", 1, 2000);
  // Samples 1901 to 2000 are received again, as by a late joiner.
  const fs::path two = Record("b.mcap", 1901, 4000);
  const MergeResult result = Merge({two, one}, folder_ / "out.mcap");
  EXPECT_EQ(result.messages, 4400u);
  EXPECT_TRUE(result.notes.empty()) << result.notes.front();
  const Content content = Read(folder_ / "out.mcap");
  EXPECT_TRUE(content.closed);
  EXPECT_TRUE(content.in_order);
  EXPECT_EQ(content.sequences.at("fulcrum/ToolState"), Range(1, 4000));
  EXPECT_EQ(content.sequences.at("fulcrum/TissueFrame"), Range(1, 400));
  EXPECT_EQ(content.channels, 2u) << "the same writers";
  EXPECT_EQ(content.schemas, 2u);
  EXPECT_EQ(content.metadata.at("session").at("id"), "s-1");
  EXPECT_EQ(content.metadata.at("merged").at("files"), "a.mcap b.mcap");
  EXPECT_EQ(content.metadata.at("merged").at("missing"), "0");
  std::uint64_t indexed = 0;
  EXPECT_TRUE(recording::CheckIndex(folder_ / "out.mcap", &indexed).empty());
  EXPECT_EQ(indexed, 4400u);
}

TEST_F(Merging, NamesTheBreakAfterAKillAndTakesWhatWasWhole) {
  const fs::path one = Record("a.mcap", 1, 2000);
  Kill(one);
  const std::size_t whole = Read(one).sequences.at("fulcrum/ToolState").size();
  ASSERT_LT(whole, 2000u);
  const fs::path two = Record("b.mcap", 2401, 3000);
  const MergeResult result = Merge({one, two}, folder_ / "out.mcap");
  ASSERT_GE(result.notes.size(), 2u);
  EXPECT_NE(result.notes[0].find(" to 2.409 s"), std::string::npos) << result.notes[0];
  const Content content = Read(folder_ / "out.mcap");
  EXPECT_TRUE(content.closed);
  EXPECT_EQ(content.sequences.at("fulcrum/ToolState").size(), whole + 600);
  EXPECT_EQ(content.metadata.at("merged").at("breaks"), result.notes[0]);
  EXPECT_GE(std::stoull(content.metadata.at("merged").at("missing")), 2400 - whole);
}

TEST_F(Merging, RefusesOtherSessionsAndScenesAndReplacesNothing) {
  const fs::path one = Record("a.mcap", 1, 10);
  const auto refusal = [&](const std::vector<fs::path>& files, const fs::path& out) -> std::string {
    try {
      (void)Merge(files, out);
      return "";
    } catch (const InputError& error) {
      return error.what();
    }
  };
  const std::string session = refusal({one, Record("b.mcap", 11, 20, "s-2")}, folder_ / "out.mcap");
  EXPECT_NE(session.find("session.id is \"s-2\", that of"), std::string::npos) << session;
  const std::string scene = refusal({one, Record("c.mcap", 11, 20, "s-1", "78")}, folder_ / "out.mcap");
  EXPECT_NE(scene.find("session.scene_hash is \"78\""), std::string::npos) << scene;
  EXPECT_FALSE(fs::exists(folder_ / "out.mcap"));
  EXPECT_NE(refusal({one}, one), "");
  EXPECT_EQ(Read(one).sequences.at("fulcrum/ToolState").size(), 10u);
}

TEST_F(Merging, SegmentsOfASessionBecomeItsRecording) {
  const fs::path file = Record("recording.mcap", 1, 1000);
  EXPECT_EQ(JoinSegments(file, 0).said, "") << "one file";
  Record("recording-2.mcap", 1001, 2000);
  Record("recording-3.mcap", 1, 10, "another session");
  Record("recording-4.mcap", 2001, 3000);
  EXPECT_EQ(JoinSegments(file, 0).said, "3 files of the recording were joined");
  EXPECT_EQ(Read(file).sequences.at("fulcrum/ToolState"), Range(1, 3000));
  EXPECT_FALSE(fs::exists(folder_ / "recording-2.mcap"));
  EXPECT_FALSE(fs::exists(folder_ / "recording-4.mcap"));
  EXPECT_TRUE(fs::exists(folder_ / "recording-3.mcap"));
}

TEST_F(Merging, SegmentsStayWhereTheDiskHasNoRoom) {
  const fs::path file = Record("recording.mcap", 1, 10);
  Record("recording-2.mcap", 11, 20);
  const JoinResult result = JoinSegments(file, std::uint64_t{1} << 60);
  EXPECT_FALSE(result.whole);
  const std::string told = result.said;
  EXPECT_NE(told.find("too little room; join them with fulcrum log merge"), std::string::npos) << told;
  EXPECT_TRUE(fs::exists(folder_ / "recording-2.mcap"));
}

}  // namespace
}  // namespace fulcrum::log_tools
