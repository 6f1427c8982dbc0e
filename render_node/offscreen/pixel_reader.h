// Copies a picture from OpenGL into memory while the caller goes on: on a GPU glReadPixels into memory would wait for
// the end of drawing and of the transfer.
#pragma once

#include "render_node/offscreen/framebuffer.h"

namespace fulcrum::render {

/// One copy at a time. All calls and the destructor need the OpenGL context current in which Start was called.
/// Result of a request for a picture that is being read.
enum class ReadResult {
  kNone,     ///< No reading was started, or its picture was taken already.
  kPending,  ///< It has not been read completely.
  kFailed,   ///< It cannot be read; the reading is over.
  kDone,
};

class PixelReader {
 public:
  PixelReader() = default;
  ~PixelReader();
  PixelReader(const PixelReader&) = delete;
  PixelReader& operator=(const PixelReader&) = delete;

  /// Starts to copy a part of the window or framebuffer that is bound for reading; (x, y) is its lower left corner. The
  /// copy shows what has been drawn so far. A former copy that was not taken is lost.
  void Start(int x, int y, int width, int height);
  /// A copy was started and not taken yet.
  [[nodiscard]] bool pending() const { return fence_ != nullptr; }
  /// Gives the copy if it is complete; with `wait` it waits for that.
  [[nodiscard]] ReadResult Take(bool wait, Bitmap* picture);
  /// Gives up copy and buffer without OpenGL, whose context is gone with them.
  void Abandon();

 private:
  void Forget();

  unsigned buffer_ = 0;
  std::size_t bytes_ = 0;  // Of buffer_.
  void* fence_ = nullptr;  // GLsync after the copy.
  int width_ = 0, height_ = 0;
};

}  // namespace fulcrum::render
