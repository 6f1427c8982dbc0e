// JPEG compression of a picture, for the topic Picture.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "render_node/offscreen/framebuffer.h"

namespace fulcrum::render {

class JpegEncoder {
 public:
  /// Throws std::runtime_error if the library refuses to start.
  JpegEncoder();
  ~JpegEncoder();
  JpegEncoder(const JpegEncoder&) = delete;
  JpegEncoder& operator=(const JpegEncoder&) = delete;

  /// The picture as a JPEG file of at most `most` bytes; a picture with too much detail for that is compressed more.
  /// Valid until the next call. Throws std::runtime_error if it does not fit at all.
  [[nodiscard]] std::span<const std::uint8_t> Encode(const Bitmap& picture, std::size_t most);

 private:
  void* handle_;
  std::vector<std::uint8_t> file_;
};

}  // namespace fulcrum::render
