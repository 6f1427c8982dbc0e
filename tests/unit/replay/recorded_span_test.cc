// Which times a recording shows, and how much of it is read.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "services/apps/replayer/recorded_kinematics.h"
#include "services/base/core/error.h"
#include "services/records/recording/mcap_writer.h"
#include "services/transport/bus/convert/cdr.h"
#include "services/transport/bus/topics.h"

namespace fulcrum::replay {
namespace {

constexpr std::int64_t kStart_ns = 1'000'000'000'000;

/// A recording whose samples have no content but their time.
class RecordedSpanTest : public ::testing::Test {
 protected:
  RecordedSpanTest() { scene_.hash = 7; }
  ~RecordedSpanTest() override { std::filesystem::remove(file_); }

  void Begin() {
    writer_.emplace(file_, "", "test");
    SceneManifest manifest;
    manifest.scene_hash = scene_.hash;
    manifest.session_start_ns = kStart_ns;
    Write(manifest, 0);
  }
  template <class T>
  void Write(T sample, double time_s) {
    const std::int64_t time_ns = kStart_ns + std::llround(1e9 * time_s);
    sample.stamp = {++sequence_, kStart_ns, time_ns};
    std::vector<std::uint8_t> bytes;
    ASSERT_TRUE(bus::EncodeCdr(sample, &bytes));
    WriteBytes(bus::RoleOf<T>().name, bytes, time_ns);
  }
  /// Tissue is not decoded before a picture is drawn.
  void WriteTissue(double time_s) {
    WriteBytes(bus::RoleOf<TissueFrame>().name, {0}, kStart_ns + std::llround(1e9 * time_s));
  }
  void WriteBytes(const char* topic, const std::vector<std::uint8_t>& bytes, std::int64_t time_ns) {
    const auto [channel, is_new] = channels_.try_emplace(topic);
    if (is_new) channel->second = writer_->AddChannel(0, topic, "cdr", {});
    const auto log_ns = static_cast<std::uint64_t>(time_ns);
    writer_->Write(channel->second, static_cast<std::uint32_t>(sequence_), log_ns, log_ns,
                   std::as_bytes(std::span(bytes)));
  }
  /// ToolStates each millisecond.
  void WriteTools(double from_s, double to_s) {
    for (double time_s = from_s; time_s < to_s + 1e-6; time_s += 1e-3) Write(ToolState{}, time_s);
  }

  const std::filesystem::path file_ =
      std::filesystem::path(::testing::TempDir()) / ("recorded_span_" + std::to_string(::getpid()) + ".mcap");
  SceneView scene_;
  std::optional<recording::McapWriter> writer_;
  std::map<std::string, std::uint16_t> channels_;
  std::uint64_t sequence_ = 0;
};

TEST_F(RecordedSpanTest, EndsWithTheLastSampleThatIsShown) {
  Begin();
  WriteTissue(0.01);
  WriteTools(0, 4);
  for (int k = 0; k <= 44; ++k) Write(Health{}, 0.1 * k);  // Of recorder and supervisor, after all nodes have ended.
  writer_->Close();
  const RecordedSpan span = ReadSpan(file_, scene_);
  EXPECT_EQ(span.begin_s, 0) << "the first tissue of a session comes soon after its begin";
  EXPECT_NEAR(span.end_s, 4, 1e-6);
  const PictureNumbers rows(file_, span, -1, 1.0 / 30);
  EXPECT_EQ(rows.first, 0u);
  EXPECT_EQ(rows.count, 121u);
}

TEST_F(RecordedSpanTest, BeginsWithTheFirstTissueOfARecordingThatBeginsLate) {
  Begin();
  WriteTools(5, 6);
  WriteTissue(5.04);
  WriteTissue(6.2);
  writer_->Close();
  const RecordedSpan span = ReadSpan(file_, scene_);
  EXPECT_NEAR(span.begin_s, 5.04, 1e-6);
  EXPECT_NEAR(span.end_s, 6.2, 1e-6);
  const PictureNumbers frames(file_, span, -1, 0.2);
  EXPECT_EQ(frames.first, 26u);
  EXPECT_EQ(frames.count, 6u);
  EXPECT_EQ(PictureNumbers(file_, span, 5.5, 0.2).count, 2u);
  EXPECT_THROW(PictureNumbers(file_, span, 5, 0.2), InputError) << "--until before the begin";
}

TEST_F(RecordedSpanTest, RefusesAnEndThatNoSessionHas) {
  Begin();
  WriteTissue(0);
  Write(ToolState{}, 8 * 24 * 3600.0);
  writer_->Close();
  EXPECT_THROW((void)ReadSpan(file_, scene_), InputError);
}

TEST_F(RecordedSpanTest, OfALongRecordingNoMoreIsReadThanIsAskedFor) {
  Begin();
  WriteTissue(0.01);
  WriteTools(0, 6);
  writer_->Close();
  const Kinematics until_1 = ReadKinematics(file_, scene_, 1);
  EXPECT_GE(until_1.poses(), 1001u);
  EXPECT_LE(until_1.poses(), 1100u);
  EXPECT_EQ(ReadKinematics(file_, scene_, 6).poses(), 6001u);
}

}  // namespace
}  // namespace fulcrum::replay
