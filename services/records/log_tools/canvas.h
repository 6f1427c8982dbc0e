// A picture of coloured pixels with lines and letters, as PNG.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "services/records/log_tools/mask.h"

namespace fulcrum::log_tools {

using Rgb = std::array<std::uint8_t, 3>;

/// Linear from a (f = 0) to b (f = 1).
[[nodiscard]] Rgb Mix(const Rgb& a, const Rgb& b, double f);

class Canvas {
 public:
  Canvas(int width, int height, const Rgb& background);

  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }

  /// From now on only x0 … x1 - 1 and y0 … y1 - 1 are drawn on.
  void Clip(int x0, int y0, int x1, int y1);
  void Unclip() { Clip(0, 0, width_, height_); }

  // Nothing happens beyond the borders.
  void Put(int x, int y, const Rgb& colour);
  /// Mixes with what is there; `cover` 0 … 1.
  void Blend(int x, int y, const Rgb& colour, double cover);
  /// Filled, borders x0 … x1 - 1.
  void Box(int x0, int y0, int x1, int y1, const Rgb& colour);
  /// Disc with a smooth edge.
  void Dot(const Vec2d& centre, double radius, const Rgb& colour, double cover = 1);
  /// With smooth edges and round ends.
  void Line(const Vec2d& from, const Vec2d& to, double width, const Rgb& colour);
  /// Upper left corner at (x, y); each dot of a letter is `scale` pixels. ASCII; others leave a gap.
  void Text(int x, int y, std::string_view text, const Rgb& colour, int scale = 2);
  [[nodiscard]] static int TextWidth(std::string_view text, int scale = 2) {
    return static_cast<int>(text.size()) * kLetterWidth * scale;
  }
  static constexpr int kLetterWidth = 6, kLetterHeight = 8;  ///< With the space around, in dots.

  /// The bytes of a PNG file. Throws std::runtime_error.
  [[nodiscard]] std::string Png() const;

 private:
  int width_, height_;
  int left_ = 0, top_ = 0, right_, bottom_;  ///< What may be drawn on.
  std::vector<Rgb> pixels_;
};

}  // namespace fulcrum::log_tools
