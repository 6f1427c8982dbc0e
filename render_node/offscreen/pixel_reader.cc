#include "render_node/offscreen/pixel_reader.h"

#include <GL/gl.h>
#include <GL/glext.h>

#include <cstdint>

namespace fulcrum::render {
namespace {

constexpr std::size_t kTexelBytes = 4;  // A GPU copies its own format; three bytes a pixel would be converted first.
constexpr GLuint64 kPatience_ns = 1'000'000'000;  // A GPU that takes longer for a picture hangs.

}  // namespace

PixelReader::~PixelReader() {
  Forget();
  if (buffer_ != 0) glDeleteBuffers(1, &buffer_);
}

void PixelReader::Forget() {
  if (fence_ != nullptr) glDeleteSync(static_cast<GLsync>(fence_));
  fence_ = nullptr;
}

void PixelReader::Start(int x, int y, int width, int height) {
  Forget();
  width_ = width;
  height_ = height;
  const std::size_t bytes = kTexelBytes * static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  if (buffer_ == 0) glGenBuffers(1, &buffer_);
  glBindBuffer(GL_PIXEL_PACK_BUFFER, buffer_);
  if (bytes != bytes_) {
    glBufferData(GL_PIXEL_PACK_BUFFER, static_cast<GLsizeiptr>(bytes), nullptr, GL_STREAM_READ);
    bytes_ = bytes;
  }
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(x, y, width, height, GL_RGBA, GL_UNSIGNED_BYTE, nullptr);
  // Unbound, because OpenSceneGraph reads into memory.
  glBindBuffer(GL_PIXEL_PACK_BUFFER, 0);
  fence_ = glFenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0);
  glFlush();  // Otherwise a poll without waiting could fail for ever.
}

void PixelReader::Abandon() {
  fence_ = nullptr;
  buffer_ = 0;
  bytes_ = 0;
}

ReadResult PixelReader::Take(bool wait, Bitmap* picture) {
  if (fence_ == nullptr) return ReadResult::kNone;
  const GLenum reached = glClientWaitSync(static_cast<GLsync>(fence_), 0, wait ? kPatience_ns : 0);
  if (!wait && reached == GL_TIMEOUT_EXPIRED) return ReadResult::kPending;
  Forget();
  if (reached == GL_TIMEOUT_EXPIRED || reached == GL_WAIT_FAILED) return ReadResult::kFailed;
  picture->width = width_;
  picture->height = height_;
  const std::size_t pixels = bytes_ / kTexelBytes;
  picture->rgb.resize(3 * pixels);
  glBindBuffer(GL_PIXEL_PACK_BUFFER, buffer_);
  const auto* from = static_cast<const std::uint8_t*>(glMapBuffer(GL_PIXEL_PACK_BUFFER, GL_READ_ONLY));
  if (from != nullptr) {
    std::uint8_t* to = picture->rgb.data();
    for (std::size_t k = 0; k < pixels; ++k, from += kTexelBytes, to += 3) {
      to[0] = from[0];
      to[1] = from[1];
      to[2] = from[2];
    }
    glUnmapBuffer(GL_PIXEL_PACK_BUFFER);
  }
  glBindBuffer(GL_PIXEL_PACK_BUFFER, 0);
  return from != nullptr ? ReadResult::kDone : ReadResult::kFailed;
}

}  // namespace fulcrum::render
