// H.264 in an MP4 file, made by the program ffmpeg (libavcodec).
#pragma once

#include <filesystem>
#include <memory>
#include <span>
#include <string>

#include "render_node/offscreen/framebuffer.h"
#include "services/apps/replayer/chapters.h"

namespace fulcrum::replay {

/// Width or height of the video of pictures with this one [pixels]: H.264 wants even sizes.
[[nodiscard]] constexpr int VideoSize(int picture_size) { return picture_size + picture_size % 2; }

class VideoFile {
 public:
  /// @param rate_Hz pictures a second.
  /// @param group pictures from one that can be decoded alone to the next; 0: two seconds of them.
  /// Throws InputError when ffmpeg is not installed or `file` cannot be written.
  VideoFile(std::filesystem::path file, int width, int height, int rate_Hz, int group = 0);
  /// Without Finish() nothing remains.
  ~VideoFile();
  VideoFile(const VideoFile&) = delete;
  VideoFile& operator=(const VideoFile&) = delete;

  /// The next picture, of the size given above. Waits while ffmpeg is behind. Throws std::runtime_error with ffmpeg's
  /// words when it has ended.
  void Add(const render::Bitmap& picture);

  /// Completes the file, which replaces one of this name. Throws as Add().
  void Finish(const std::string& title, std::span<const Chapter> chapters, double end_s);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace fulcrum::replay
