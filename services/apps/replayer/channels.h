// Images of a data set: integers of 8 or 16 bits, one or three for a pixel, as PNG files.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <exception>
#include <filesystem>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

#include "render_node/offscreen/framebuffer.h"

namespace fulcrum::replay {

struct Channel {
  int width = 0, height = 0;
  int bits = 8;                       ///< 8 or 16.
  int samples = 1;                    ///< For a pixel: 1 (grey) or 3.
  std::vector<std::uint16_t> values;  ///< Row by row from the top.

  Channel(int columns, int rows, int bits_of_each, int samples_of_each);
  [[nodiscard]] std::uint16_t& At(int x, int y, int sample = 0) {
    const auto pixel = static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
    return values[pixel * static_cast<std::size_t>(samples) + static_cast<std::size_t>(sample)];
  }
};

[[nodiscard]] Channel FromBitmap(const render::Bitmap& picture);

/// Throws InputError when the file cannot be written.
void WriteChannel(const Channel& channel, const std::filesystem::path& file);

/// Writes channels on threads of its own; equal input gives equal files.
class ChannelWriter {
 public:
  explicit ChannelWriter(int threads);
  ~ChannelWriter();
  ChannelWriter(const ChannelWriter&) = delete;
  ChannelWriter& operator=(const ChannelWriter&) = delete;

  /// Waits while many images wait for their turn. Throws what an earlier image threw.
  void Add(Channel channel, std::filesystem::path file);
  /// Waits until all are written. Throws what one of them threw.
  void Finish();

 private:
  struct Job {
    Channel channel;
    std::filesystem::path file;
  };
  void Work();
  void ThrowFailure();

  std::mutex mutex_;
  std::condition_variable wake_, done_;
  std::deque<Job> jobs_;
  int writing_ = 0;
  bool stop_ = false;
  std::exception_ptr failure_;
  std::vector<std::jthread> threads_;
};

}  // namespace fulcrum::replay
