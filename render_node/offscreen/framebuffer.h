// Framebuffer object of an off-screen view, with colour and depth. One sample per pixel: with four a software
// rasteriser takes two and a half times as long (DESIGN.md).
#pragma once

#include <cstdint>
#include <vector>

namespace fulcrum::render {

/// Pixels, three bytes (sRGB) each, row by row from the BOTTOM row up, as OpenGL gives them.
struct Bitmap {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> rgb;
};

/// All calls need the OpenGL context current.
class Framebuffer {
 public:
  /// Throws std::runtime_error if OpenGL does not support the size.
  Framebuffer(int width, int height);
  ~Framebuffer();
  Framebuffer(const Framebuffer&) = delete;
  Framebuffer& operator=(const Framebuffer&) = delete;

  /// GL name, to draw into.
  [[nodiscard]] unsigned id() const { return id_; }
  /// Makes it the one that is drawn into and read from.
  void Bind() const;
  /// Waits for the end of drawing and reads the picture.
  void Read(Bitmap* picture);

 private:
  int width_;
  int height_;
  unsigned id_ = 0;
  unsigned colour_ = 0;
  unsigned depth_ = 0;
};

/// Copies the first width x height texels of a two-dimensional texture, by GL name, to another of the same format
/// (OpenGL 4.3).
void CopyTexture(unsigned from, unsigned to, int width, int height);

/// Reads and writes the first width x height texels of a two-dimensional texture, by GL name (OpenGL 4.5): four bytes
/// each, red first in memory, rows from the bottom up.
void ReadTexture(unsigned texture, int width, int height, std::uint32_t* rgba);
void WriteTexture(unsigned texture, int width, int height, const std::uint32_t* rgba);

/// Reads a part of the window or framebuffer that is bound for reading; (x, y) is its lower left corner.
void ReadBoundFramebuffer(int x, int y, int width, int height, Bitmap* picture);

}  // namespace fulcrum::render
