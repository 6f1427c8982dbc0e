// A recorder with limited room: by the disk, by the limit on the size of files, by other programs that fill the disk.
#include "services/records/recorder/room.h"

#include <gtest/gtest.h>
#include <sched.h>
#include <signal.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/wait.h>

#include <fstream>
#include <functional>
#include <optional>

#include "services/records/recorder/recorder_health.h"
#include "services/records/recording/mcap_index.h"
#include "tests/unit/recorder/recorder_fixture.h"

namespace fulcrum::recorder {
namespace {

double MetricOf(const Health& health, const std::string& name) {
  for (const Metric& metric : health.metrics) {
    if (metric.name == name) return metric.value;
  }
  ADD_FAILURE() << "no metric " << name;
  return -1;
}

TEST(RecorderHealth, IsDegradedOnceTheRecordingHasEnded) {
  RecorderStats stats;
  stats.received = 10;
  stats.missed = 2;
  stats.file_B = 3'000'000;
  Health health;
  FillHealth(stats, &health);
  EXPECT_EQ(MetricOf(health, "recorded_samples"), 10);
  EXPECT_DOUBLE_EQ(MetricOf(health, "recorded_MB"), 3);
  EXPECT_EQ(MetricOf(health, "lost_samples"), 2);
  EXPECT_EQ(MetricOf(health, "recording_ended"), 0);
  EXPECT_NE(health.state, HealthState::kDegraded);
  EXPECT_EQ(health.last_error, "");
  stats.unwritten = 4;
  stats.not_recorded = 7;
  stats.ended = "File too large";
  FillHealth(stats, &health);
  EXPECT_EQ(MetricOf(health, "recorded_samples"), 6);
  EXPECT_EQ(MetricOf(health, "lost_samples"), 6);
  EXPECT_EQ(MetricOf(health, "not_recorded"), 7);
  EXPECT_EQ(MetricOf(health, "recording_ended"), 1);
  EXPECT_EQ(health.state, HealthState::kDegraded);
  EXPECT_EQ(health.last_error, "File too large");
}

TEST(RecorderHealth, WarnsWhileThereIsTimeToFreeSpace) {
  RecorderStats stats;
  stats.left_s = 600;
  Health health;
  FillHealth(stats, &health);
  EXPECT_EQ(health.last_error, "");
  stats.left_s = 42.7;
  FillHealth(stats, &health);
  EXPECT_EQ(health.last_error, "there is room for 42 s more of recording; delete old sessions");
  EXPECT_NE(health.state, HealthState::kDegraded);
}

/// Frames of 100,000 bytes that do not compress.
class Frames {
 public:
  void Send(Recorder* recorder, std::int64_t now_ns) {
    for (std::byte& b : body_) {
      b = static_cast<std::byte>((noise_ = noise_ * 6364136223846793005u + 1442695040888963407u) >> 56);
    }
    recorder->Receive({TopicId::kTissueFrame, {1}, ++sent_, 0, now_ns, kHead, body_});
  }
  [[nodiscard]] std::uint64_t sent() const { return sent_; }

 private:
  std::vector<std::byte> body_ = std::vector<std::byte>(100'000);
  std::uint64_t noise_ = 1, sent_ = 0;
};

/// Limits the size of files of this process.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t limit_B) {
    signal(SIGXFSZ, SIG_IGN);
    getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit{limit_B, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FileSizeLimit() { setrlimit(RLIMIT_FSIZE, &before_); }
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;

 private:
  rlimit before_{};
};

TEST_F(RecorderTest, EndsInOrderBelowTheLimitOnTheSizeOfFiles) {
  constexpr std::uint64_t kLimit_B = 5'000'000;
  Frames frames;
  RecorderStats stats;
  {
    const FileSizeLimit limit(kLimit_B);
    Recorder recorder(Settings());
    for (int i = 1; i <= 100; ++i) {
      frames.Send(&recorder, i * 50 * kMs);
      recorder.Flush(i * 50 * kMs);
    }
    stats = recorder.stats();
    recorder.Close(0);
  }
  EXPECT_NE(stats.ended.find("ulimit -f"), std::string::npos) << stats.ended;
  EXPECT_EQ(stats.lost(), 0u) << "samples after the announced end do not count as lost";
  EXPECT_GT(stats.not_recorded, 40u);
  EXPECT_LT(fs::file_size(folder_ / "recording.mcap"), kLimit_B);
  McapReader reader(folder_ / "recording.mcap");
  const std::vector<Read> read = ReadAll(&reader);
  EXPECT_TRUE(reader.closed());
  EXPECT_EQ(read.size() + stats.not_recorded, frames.sent());
  EXPECT_GT(read.size(), 10u);
  EXPECT_EQ(read.back().sequence, read.size()) << "none is missing before the end";
  EXPECT_EQ(reader.metadata().at("ended").at("reason"), stats.ended);
  std::uint64_t indexed = 0;
  EXPECT_TRUE(recording::CheckIndex(folder_ / "recording.mcap", &indexed).empty());
  EXPECT_EQ(indexed, read.size());
}

TEST_F(RecorderTest, EndsInOrderBeforeTheDiskIsFull) {
  RecorderSettings settings = Settings();
  settings.keep_free_B = FreeSpace(folder_) - 8'000'000;
  Frames frames;
  Recorder recorder(settings);
  for (int i = 1; i <= 400; ++i) {
    frames.Send(&recorder, i * 50 * kMs);
    recorder.Flush(i * 50 * kMs);
  }
  const RecorderStats stats = recorder.stats();
  EXPECT_NE(stats.ended.find("recorder.keep_free_MB"), std::string::npos) << stats.ended;
  EXPECT_EQ(stats.lost(), 0u);
  McapReader reader(folder_ / "recording.mcap");
  const std::vector<Read> read = ReadAll(&reader);
  EXPECT_TRUE(reader.closed()) << "closed before the recorder ends";
  EXPECT_EQ(read.size() + stats.not_recorded, frames.sent());
  ASSERT_FALSE(read.empty());
  EXPECT_EQ(read.back().sequence, read.size());
}

TEST_F(RecorderTest, ADiskWithoutRoomGivesAnEmptyCompleteFile) {
  RecorderSettings settings = Settings();
  settings.keep_free_B = FreeSpace(folder_) + 1'000'000'000;
  Recorder recorder(settings);
  recorder.Flush(kMs);
  Send(&recorder, TopicId::kToolState, 1, 1);
  EXPECT_NE(recorder.stats().ended, "");
  EXPECT_EQ(recorder.stats().not_recorded, 1u);
  McapReader reader(folder_ / "recording.mcap");
  EXPECT_TRUE(ReadAll(&reader).empty());
  EXPECT_TRUE(reader.closed());
}

TEST_F(RecorderTest, ADumpBelowTheLimitOnTheSizeOfFilesHoldsTheNewest) {
  RecorderSettings settings = Settings();
  settings.file.clear();
  settings.keep_s = 1000;
  Frames frames;
  Recorder recorder(settings);
  for (int i = 1; i <= 50; ++i) {
    frames.Send(&recorder, i * 1000 * kMs);
    recorder.Flush((i + 1) * 1000 * kMs);
  }
  const FileSizeLimit limit(1'000'000);
  recorder.Dump(folder_ / "dump.mcap", "", 0);
  McapReader reader(folder_ / "dump.mcap");
  const std::vector<Read> read = ReadAll(&reader);
  EXPECT_TRUE(reader.closed());
  ASSERT_FALSE(read.empty());
  EXPECT_LT(read.size(), 10u);
  EXPECT_EQ(read.back().sequence, 50u);
}

/// Gives this process mounts of its own; false: not permitted.
bool HasOwnMounts() {
  const uid_t uid = ::getuid();
  if (::unshare(uid == 0 ? CLONE_NEWNS : CLONE_NEWNS | CLONE_NEWUSER) != 0) return false;
  if (uid != 0) std::ofstream("/proc/self/uid_map") << "0 " << uid << " 1";
  return ::mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0;
}

/// Runs `test` in a child process that has a file system of `size` at `place`. Its exit code; empty: not permitted.
std::optional<int> InSmallRoom(const fs::path& place, const char* size, const std::function<int()>& test) {
  constexpr int kNotPermitted = 77, kThrew = 78;
  const pid_t child = ::fork();
  if (child == 0) {
    if (!HasOwnMounts() || ::mount("none", place.c_str(), "tmpfs", 0, size) != 0) ::_exit(kNotPermitted);
    try {
      ::_exit(test());
    } catch (const std::exception& error) {
      std::fprintf(stderr, "%s\n", error.what());
      ::_exit(kThrew);
    }
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  const int code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  return code == kNotPermitted ? std::nullopt : std::optional(code);
}

TEST_F(RecorderTest, ADiskThatOthersFillLeavesAReadableFile) {
  const auto code = InSmallRoom(folder_, "size=6m", [this] {
    RecorderSettings settings = Settings();
    settings.keep_free_B = 0;
    Frames frames;
    Recorder recorder(settings);
    for (int i = 1; i <= 20; ++i) {
      frames.Send(&recorder, i * 500 * kMs);
      recorder.Flush(i * 500 * kMs);
    }
    if (!recorder.stats().ended.empty()) return 2;
    // Between two checks of the free space.
    for (int i = 1; i <= 10; ++i) frames.Send(&recorder, 10'500 * kMs);
    std::ofstream filler(folder_ / "filler");
    for (int i = 0; i < 100 && filler; ++i) filler << std::string(100'000, 'x') << std::flush;
    recorder.Close(11'000 * kMs);
    const RecorderStats stats = recorder.stats();
    if (stats.ended.find("No space left") == std::string::npos) return 3;
    if (stats.unwritten == 0) return 4;
    McapReader reader(folder_ / "recording.mcap");
    const std::vector<Read> read = ReadAll(&reader);
    if (!reader.faults().empty()) return 5;
    if (read.size() + stats.unwritten != frames.sent()) return 6;
    return read.size() >= 20 ? 0 : 7;
  });
  if (!code) GTEST_SKIP() << "this user may not make a file system";
  EXPECT_EQ(*code, 0);
}

TEST_F(RecorderTest, OnlyTheOwnerReadsARecording) {
  Recorder recorder(Settings());
  EXPECT_EQ(fs::status(folder_ / "recording.mcap").permissions(), fs::perms::owner_read | fs::perms::owner_write);
}

}  // namespace
}  // namespace fulcrum::recorder
