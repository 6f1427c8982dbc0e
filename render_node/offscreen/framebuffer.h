// The picture that an off-screen view draws into: a multisampled framebuffer object and a plain one to read from.
#pragma once

#include <cstdint>
#include <vector>

namespace fulcrum::render {

/// Pixels, three bytes (sRGB) each, row by row from the BOTTOM row up, as OpenGL gives them.
struct Picture {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> rgb;
};

/// All calls need the OpenGL context current.
class Framebuffer {
 public:
  /// `samples` per pixel; 1: no multisampling. Throws std::runtime_error when GL refuses the size.
  Framebuffer(int width, int height, int samples);
  ~Framebuffer();
  Framebuffer(const Framebuffer&) = delete;
  Framebuffer& operator=(const Framebuffer&) = delete;

  /// GL name of the framebuffer to draw into.
  [[nodiscard]] unsigned draw_id() const { return draw_; }
  /// Resolves the samples and waits for the picture.
  void Read(Picture* picture);

 private:
  int width_;
  int height_;
  unsigned draw_ = 0;
  unsigned resolve_ = 0;
  unsigned colour_ = 0;
  unsigned depth_ = 0;
  unsigned resolved_colour_ = 0;
};

/// Reads the window or framebuffer bound for reading.
void ReadBoundFramebuffer(int width, int height, Picture* picture);

}  // namespace fulcrum::render
