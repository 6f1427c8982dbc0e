// PNG files: functions to write and read them, and a writer with its own thread, so that drawing never waits for the
// disk.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <mutex>
#include <string>
#include <thread>

#include "render_node/offscreen/framebuffer.h"

namespace fulcrum::render {

/// Writes to a temporary name and renames, so that no incomplete picture remains after a kill. Throws
/// std::runtime_error naming the file.
void WritePng(const Bitmap& picture, const std::filesystem::path& file);

/// Reads an 8-bit RGB picture back (bottom row first, as in Bitmap). Throws std::runtime_error.
[[nodiscard]] Bitmap ReadPng(const std::filesystem::path& file);

/// Writes the pictures of a session: <folder>/frame_<session time in ms, 7 digits>.png. The names sort by time, also
/// across a restart.
class FrameWriter {
 public:
  /// @param folder empty: there are no files, and no picture may be added. Throws std::runtime_error if the folder
  /// cannot be created.
  /// @param keep_free_B space that stays free on the disk for others [B]: a picture for which there is less is not
  /// written and counts as failed.
  explicit FrameWriter(const std::filesystem::path& folder, std::uint64_t keep_free_B = 0);
  ~FrameWriter();  ///< Writes all queued pictures, then ends the thread.
  FrameWriter(const FrameWriter&) = delete;
  FrameWriter& operator=(const FrameWriter&) = delete;

  [[nodiscard]] bool has_folder() const { return !folder_.empty(); }
  /// Queues a picture. Returns false if the queue holds kQueue pictures already; this one is then dropped.
  bool Add(Bitmap picture, double session_time_s);
  /// Waits until all queued pictures have been written or have failed.
  void Wait();
  [[nodiscard]] std::uint64_t written() const;
  [[nodiscard]] std::uint64_t failed() const;
  /// Empty, or why the last write failed.
  [[nodiscard]] std::string last_error() const;

 private:
  static constexpr std::size_t kQueue = 4;
  struct Job {
    Bitmap picture;
    double session_time_s;
  };
  void Work();
  /// Throws std::runtime_error when the picture cannot be written.
  void WriteOne(const Job& job) const;

  std::filesystem::path folder_;
  std::uint64_t keep_free_B_;
  mutable std::mutex mutex_;
  std::condition_variable wake_, idle_;
  std::deque<Job> jobs_;
  bool stop_ = false, writing_ = false;
  std::uint64_t written_ = 0, failed_ = 0;
  std::string last_error_;
  std::thread thread_;
};

}  // namespace fulcrum::render
