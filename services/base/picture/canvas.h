// A picture of coloured pixels with lines and letters, as PNG.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "services/base/core/types.h"

namespace fulcrum::picture {

using Rgb = std::array<std::uint8_t, 3>;

/// Linear interpolation from a (f = 0) to b (f = 1).
[[nodiscard]] Rgb Mix(const Rgb& a, const Rgb& b, double f);

class Canvas {
 public:
  Canvas(int width, int height, const Rgb& background);

  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }

  /// Restricts all drawing from now on to x0 to x1 - 1 and y0 to y1 - 1.
  void Clip(int x0, int y0, int x1, int y1);
  void Unclip() { Clip(0, 0, width_, height_); }

  // Drawing beyond the borders has no effect.
  void Put(int x, int y, const Rgb& colour);
  /// Mixes the colour with the present one; `cover` 0 to 1.
  void Blend(int x, int y, const Rgb& colour, double cover);
  /// Filled box with borders at x0 and x1 - 1.
  void Box(int x0, int y0, int x1, int y1, const Rgb& colour);
  /// Disc with a smooth edge.
  void Dot(const Vec2d& centre, double radius, const Rgb& colour, double cover = 1);
  /// Line with smooth edges and round ends.
  void Line(const Vec2d& from, const Vec2d& to, double width, const Rgb& colour);
  /// Text with its upper left corner at (x, y); each dot of a letter is `scale` pixels. ASCII only; other characters
  /// leave a gap.
  void Text(int x, int y, std::string_view text, const Rgb& colour, int scale = 2);
  [[nodiscard]] static int TextWidth(std::string_view text, int scale = 2) {
    return static_cast<int>(text.size()) * kLetterWidth * scale;
  }
  static constexpr int kLetterWidth = 6, kLetterHeight = 8;  ///< Including the space around a letter [dots].

  /// The content of a PNG file. Throws std::runtime_error.
  [[nodiscard]] std::string Png() const;

 private:
  int width_, height_;
  int left_ = 0, top_ = 0, right_, bottom_;  ///< Region in which drawing is allowed.
  std::vector<Rgb> pixels_;
};

}  // namespace fulcrum::picture
