// The recorded session as a video, drawn by the program replayer.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace fulcrum::supervisor {

struct VideoOrder {
  std::filesystem::path replayer;  ///< Program.
  std::filesystem::path recording;
  std::filesystem::path scene;  ///< Compiled scene.
  std::filesystem::path video;  ///< MP4 file to write.
  std::filesystem::path log;    ///< For what replayer prints; its result as JSON goes beside it.
};

struct SessionVideo {
  std::filesystem::path file = {};         ///< Empty: there is none.
  std::string command = {};                ///< That draws it again.
  bool is_part = false;                    ///< Of a session whose recorder was restarted: up to the restart.
  std::string missing = {};                ///< Then: why, one line.
  std::vector<std::string> chapters = {};  ///< "0:12 cut at 35 W", in the order of time.
  std::string subtitles = {};              ///< The chapters as WebVTT.
};

/// Waits for the video, a minute and a half at most. `goes_on` is called every few milliseconds; false leaves the video
/// out.
[[nodiscard]] SessionVideo MakeVideo(const VideoOrder& order, const std::function<bool()>& goes_on);

}  // namespace fulcrum::supervisor
