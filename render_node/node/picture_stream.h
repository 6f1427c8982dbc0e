// Sends drawn pictures as the topic Picture. Compression has a thread of its own, so drawing never waits for it, and
// takes the newest picture: one that is replaced before its turn is dropped. Without a reader nothing is compressed.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <string>
#include <thread>

#include "render_node/offscreen/framebuffer.h"
#include "render_node/offscreen/jpeg.h"
#include "services/transport/bus/port.h"

namespace fulcrum::render {

class PictureStream {
 public:
  /// `output` must outlive the stream.
  explicit PictureStream(bus::LoanOutput<Picture>* output);
  ~PictureStream();
  PictureStream(const PictureStream&) = delete;
  PictureStream& operator=(const PictureStream&) = delete;

  [[nodiscard]] bool has_readers() const { return output_->has_readers(); }
  /// Hands over a picture; width, height and size of `header` are set here.
  void Add(const Bitmap& picture, const PictureHeader& header);

  // From any thread.
  [[nodiscard]] std::uint64_t sent() const { return sent_.load(std::memory_order_relaxed); }
  [[nodiscard]] std::uint64_t dropped() const { return dropped_.load(std::memory_order_relaxed); }
  /// Time to compress and send the last picture [ms].
  [[nodiscard]] double encode_ms() const { return encode_ms_.load(std::memory_order_relaxed); }
  /// Empty, or why the last picture was not sent.
  [[nodiscard]] std::string last_error() const;

 private:
  void Work();
  [[nodiscard]] std::string Send(const Bitmap& picture, const PictureHeader& header);

  bus::LoanOutput<Picture>* output_;
  JpegEncoder encoder_;
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  Bitmap next_;
  PictureHeader next_header_;
  bool full_ = false, stop_ = false;
  std::string last_error_;
  std::atomic<std::uint64_t> sent_{0}, dropped_{0};
  std::atomic<double> encode_ms_{0};
  std::thread thread_;
};

}  // namespace fulcrum::render
