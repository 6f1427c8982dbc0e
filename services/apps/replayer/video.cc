#include "services/apps/replayer/video.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <string>

#include "services/apps/replayer/projector.h"
#include "services/apps/replayer/report_format.h"
#include "services/apps/replayer/video_file.h"

namespace fulcrum::replay {
namespace {

constexpr double kPeriod_s = 1.0 / kVideoRate_Hz;
constexpr double kLongestPeriod_s = 1;
/// Time after which the pace is known [s].
constexpr double kTrial_s = 2;

class StopWatch {
 public:
  [[nodiscard]] double s() const { return std::chrono::duration<double>(Clock::now() - begin_).count(); }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point begin_ = Clock::now();
};

double Median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

class VideoMaker {
 public:
  VideoMaker(const VideoSettings& settings, const SceneView& scene)
      : settings_(settings), scene_(scene), projector_(settings.recording, scene) {
    const PictureNumbers numbers(settings.recording, projector_.span(), settings.until_s, kPeriod_s);
    count_ = numbers.count;
    begin_s_ = static_cast<double>(numbers.first) * kPeriod_s;
    const double until_s = settings.until_s >= 0 ? settings.until_s : projector_.end_s();
    work_.end_s = std::min(until_s, projector_.end_s()) - begin_s_;
    projector_.OnMessage([this](const RenderReplay& replay, double time_s) {
      const double video_s = time_s - begin_s_;
      if (video_s <= work_.end_s) chapters_.Follow(video_s, replay.handles(), replay.generator(), replay.event());
    });
  }

  VideoResult Make(const std::function<void(double)>& progress) {
    double due_s = 0;
    for (std::uint64_t i = 0; i < count_; ++i) {
      const double time_s = static_cast<double>(i) * kPeriod_s;
      if (time_s >= due_s || i + 1 == count_) {
        Look(time_s);
        const double period_s = NextPeriod();
        periods_s_.push_back(period_s);
        due_s = time_s + period_s - 0.5 * kPeriod_s;
        if (progress) progress(time_s);
      }
      file_->Add(picture_);
    }
    result_.pictures = count_;
    result_.duration_s = static_cast<double>(count_) * kPeriod_s;
    result_.draw_rate_Hz = 1 / Median(periods_s_);
    result_.chapters = chapters_.list();
    file_->Finish(std::string(scene_.name), result_.chapters, result_.duration_s);
    return result_;
  }

 private:
  void Look(double time_s) {
    const StopWatch reading;
    projector_.GoTo(begin_s_ + time_s);
    work_.reading_s += reading.s();
    work_.at_s = time_s;
    ++work_.looks;
    if (projector_.Draw(&picture_)) ++result_.drawn;
    if (result_.drawn == 0) throw std::runtime_error("the recording has no tissue to show");
    if (!file_) file_.emplace(settings_.file, picture_.width, picture_.height, kVideoRate_Hz);
  }

  double NextPeriod() {
    work_.used_s = watch_.s();
    if (settings_.within_s <= 0 || work_.used_s < kTrial_s) return kPeriod_s;
    if (const auto period_s = PeriodToFinish(work_, settings_.within_s)) return *period_s;
    throw std::runtime_error("the session is too long to be drawn in time, " + Format("%.0f", settings_.within_s) +
                             " s, with a picture a second; fulcrum log video draws it in full");
  }

  const StopWatch watch_;
  const VideoSettings& settings_;
  const SceneView& scene_;
  Projector projector_;
  std::uint64_t count_ = 0;
  double begin_s_ = 0;  // Session time of the first picture.
  Chapters chapters_;
  VideoWork work_;
  VideoResult result_;
  std::vector<double> periods_s_;
  render::Bitmap picture_;
  std::optional<VideoFile> file_;
};

}  // namespace

std::optional<double> PeriodToFinish(const VideoWork& work, double within_s) {
  constexpr double kAim = 0.8;
  if (work.at_s >= work.end_s || work.looks == 0) return kPeriod_s;
  const double rest_s = work.end_s - work.at_s;
  const double each_s = (work.used_s - work.reading_s) / static_cast<double>(work.looks);
  const double reading_s = work.at_s > 0 ? work.reading_s / work.at_s * rest_s : 0;
  const double left_s = kAim * within_s - work.used_s - reading_s;
  if (left_s > 0 && rest_s * each_s / left_s <= kLongestPeriod_s) return std::max(kPeriod_s, rest_s * each_s / left_s);
  const double at_least_s = work.used_s + reading_s + rest_s / kLongestPeriod_s * each_s;
  return at_least_s <= within_s ? std::optional(kLongestPeriod_s) : std::nullopt;
}

VideoResult MakeVideo(const VideoSettings& settings, const SceneView& scene,
                      const std::function<void(double)>& progress) {
  return VideoMaker(settings, scene).Make(progress);
}

void WriteVideoJson(const VideoResult& result, const std::filesystem::path& file) {
  std::string json = Format("{\n  \"duration_s\": %.3f,\n  \"pictures\": %llu,\n", result.duration_s,
                            static_cast<unsigned long long>(result.pictures)) +
                     Format("  \"drawn\": %llu,\n  \"draw_rate_Hz\": %.3f,\n  \"chapters\": [",
                            static_cast<unsigned long long>(result.drawn), result.draw_rate_Hz);
  const char* separator = "";
  for (const Chapter& chapter : result.chapters) {
    json += separator + Format(R"({"begin_s": %.3f, "title": )", chapter.begin_s) + JsonString(chapter.title) + "}";
    separator = ", ";
  }
  WriteText(file, json + "]\n}\n");
}

}  // namespace fulcrum::replay
