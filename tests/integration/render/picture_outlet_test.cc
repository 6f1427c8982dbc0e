// Pictures that a display gives later than they were drawn: none is given twice, mixed up or lost without a count.
#include "render_node/node/picture_outlet.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <deque>
#include <filesystem>
#include <string>
#include <vector>
namespace fulcrum::render {
namespace {

/// Gives the results of a list, one a call, and a grey picture with kDone.
class LateDisplay : public Display {
 public:
  std::deque<ReadResult> results;

  void Draw() override {}
  void DrawAndRead(Bitmap*) override {}
  void DrawAndStartRead() override {}
  ReadResult TakeRead(bool, Bitmap* picture) override {
    const ReadResult result = results.front();
    results.pop_front();
    if (result == ReadResult::kDone) *picture = {16, 16, std::vector<std::uint8_t>(std::size_t{3} * 16 * 16, 99)};
    return result;
  }
  std::vector<int> TakeKeys() override { return {}; }
  [[nodiscard]] PixelBox picture() const override { return {0, 0, 16, 16}; }
  [[nodiscard]] bool closed() const override { return false; }
  [[nodiscard]] bool is_gpu() const override { return true; }
  [[nodiscard]] std::string description() const override { return "late"; }
};

class PictureOutletTest : public testing::Test {
 protected:
  ~PictureOutletTest() override { std::filesystem::remove_all(folder_); }

  [[nodiscard]] std::vector<std::string> Files() {
    outlet_.WaitForFiles();
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(folder_)) names.push_back(entry.path().filename());
    std::ranges::sort(names);
    return names;
  }
  [[nodiscard]] double MetricOf(const std::string& name) const {
    Health health;
    (void)outlet_.FillHealth(&health);
    for (const Metric& metric : health.metrics) {
      if (metric.name == name) return metric.value;
    }
    return -1;
  }

  std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / ("picture_outlet_" + std::to_string(::getpid()));
  LateDisplay display_;
  PictureOutlet outlet_{folder_, 0, nullptr};
};

TEST_F(PictureOutletTest, APictureIsGivenOnceAndWithItsOwnTime) {
  outlet_.Collect(true, &display_);  // Nothing is expected: the display is not asked.
  display_.results = {ReadResult::kPending, ReadResult::kDone, ReadResult::kDone};
  outlet_.Expect({.file = true, .session_time_s = 1.5, .header = {}});
  outlet_.Collect(false, &display_);
  EXPECT_TRUE(Files().empty()) << "it has not been read";
  outlet_.Collect(false, &display_);
  EXPECT_EQ(Files(), std::vector<std::string>{"frame_0001500.png"});
  outlet_.Collect(true, &display_);
  EXPECT_EQ(display_.results.size(), 1u) << "it was given already";
  outlet_.Expect({.file = true, .session_time_s = 2, .header = {}});
  outlet_.Collect(true, &display_);
  EXPECT_EQ(Files().size(), 2u);
  EXPECT_EQ(outlet_.lost(), 0u);
}

TEST_F(PictureOutletTest, PicturesLeaveSpaceOnTheDisk) {
  const std::filesystem::path full = folder_ / "full";
  PictureOutlet outlet{full, std::filesystem::space(folder_).available + 1'000'000'000, nullptr};
  const Bitmap picture{16, 16, std::vector<std::uint8_t>(std::size_t{3} * 16 * 16, 99)};
  outlet.Give(picture, {.file = true, .session_time_s = 1, .header = {}});
  outlet.WaitForFiles();
  EXPECT_TRUE(std::filesystem::is_empty(full));
  Health health;
  const std::string error = outlet.FillHealth(&health);
  EXPECT_NE(error.find("recorder.keep_free_MB"), std::string::npos) << error;
  EXPECT_EQ(health.metrics[1].name, "png_failed");
  EXPECT_EQ(health.metrics[1].value, 1);
}

TEST_F(PictureOutletTest, WhatCannotBeReadIsCounted) {
  display_.results = {ReadResult::kFailed, ReadResult::kPending, ReadResult::kNone, ReadResult::kDone};
  outlet_.Expect({.file = true, .session_time_s = 1, .header = {}});
  outlet_.Collect(true, &display_);
  EXPECT_EQ(outlet_.lost(), 1u);
  outlet_.Expect({.file = true, .session_time_s = 2, .header = {}});
  outlet_.Collect(false, &display_);
  EXPECT_EQ(outlet_.lost(), 1u);
  outlet_.Expect({.file = false, .session_time_s = 3, .header = {}});
  EXPECT_EQ(outlet_.lost(), 2u) << "the one before never came";
  outlet_.Collect(true, &display_);
  EXPECT_EQ(outlet_.lost(), 3u);
  EXPECT_EQ(MetricOf("png_dropped"), 2);
  EXPECT_TRUE(Files().empty());
  Health health;
  EXPECT_NE(outlet_.FillHealth(&health).find("3 pictures could not be read"), std::string::npos);
  outlet_.Expect({.file = true, .session_time_s = 4, .header = {}});
  outlet_.Collect(true, &display_);
  EXPECT_EQ(Files(), std::vector<std::string>{"frame_0004000.png"});
}

}  // namespace
}  // namespace fulcrum::render
