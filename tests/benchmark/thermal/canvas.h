// A picture of coloured pixels with a few letters, written as PNG.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string_view>
#include <vector>

namespace fulcrum::thermal {

using Rgb = std::array<std::uint8_t, 3>;

/// Linear from a (f = 0) to b (f = 1).
[[nodiscard]] Rgb Mix(const Rgb& a, const Rgb& b, float f);

class Canvas {
 public:
  static constexpr int kLetterWidth = 12, kLetterHeight = 14;  ///< Size of a letter with the space behind it.

  Canvas(int width, int height, const Rgb& background);

  /// Positions beyond the borders are ignored.
  void Put(int x, int y, const Rgb& colour);
  /// Filled, borders x0 … x1 - 1.
  void Box(int x0, int y0, int x1, int y1, const Rgb& colour);
  /// Upper left corner at (x, y). Capital letters, digits, '%' and space; others leave a gap.
  void Text(int x, int y, std::string_view text, const Rgb& colour);

  /// Throws std::runtime_error when the file cannot be written.
  void WritePng(const std::filesystem::path& file) const;

 private:
  int width_, height_;
  std::vector<Rgb> pixels_;
};

}  // namespace fulcrum::thermal
