// A recorded session as a video file.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <vector>

#include "services/apps/replayer/chapters.h"
#include "services/base/core/scene_view.h"

namespace fulcrum::replay {

inline constexpr int kVideoRate_Hz = 30;

struct VideoSettings {
  std::filesystem::path recording;
  std::filesystem::path file;  ///< MP4 file to write.
  double until_s = -1;         ///< Session time of the end [s]; negative: the end of the recording.
  double within_s = 0;  ///< The video must be ready after this time [s], with fewer pictures if need be; 0: any time.
};

struct VideoResult {
  double duration_s = 0;       ///< Of the video [s].
  std::uint64_t pictures = 0;  ///< In the file.
  std::uint64_t drawn = 0;     ///< Different ones of them.
  double draw_rate_Hz = 0;     ///< Pictures looked for a second, in the median: kVideoRate_Hz unless time was short.
  std::vector<Chapter> chapters;
};

/// Draws the session at kVideoRate_Hz, in the scene's size and quality high. The video's time is session time, from the
/// first tissue on if the recording begins late. Throws InputError, MismatchError, and std::runtime_error when OpenGL
/// is missing, ffmpeg fails, the recording has no tissue, or less than a picture a second would be ready in time.
VideoResult MakeVideo(const VideoSettings& settings, const SceneView& scene,
                      const std::function<void(double)>& progress);

/// Writes the result as JSON. Throws InputError.
void WriteVideoJson(const VideoResult& result, const std::filesystem::path& file);

/// Work on a video so far.
struct VideoWork {
  double used_s = 0;     ///< Time used in all [s] …
  double reading_s = 0;  ///< … of which for reading the recording, which takes as long however few pictures are drawn.
  std::uint64_t looks = 0;
  double at_s = 0, end_s = 0;  ///< Time of the video reached, and of its end [s].
};

/// Session time between two pictures so that the video is ready before `within_s`: from a period of kVideoRate_Hz to a
/// second. None: even with a picture a second it would not be. Aims at less than `within_s`, because a later part of a
/// session may cost more.
[[nodiscard]] std::optional<double> PeriodToFinish(const VideoWork& work, double within_s);

}  // namespace fulcrum::replay
