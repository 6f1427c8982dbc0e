// A built-in font of five by seven dots for the text in the picture, drawn at any size of the dots. Pure.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

namespace fulcrum::render {

inline constexpr int kGlyphWidth = 6;   ///< [dots], with one of space.
inline constexpr int kGlyphHeight = 8;  ///< [dots], with one of space.

/// All glyphs side by side, one byte per pixel (0 to 255), bottom row first.
struct GlyphSheet {
  int width;
  int height;
  std::vector<std::uint8_t> pixels;
};
/// @param half_pixels size of a dot in half pixels, at least 2. A pixel that a dot covers in part has a part of its
/// brightness. A glyph is 3 * half_pixels wide and 4 * half_pixels high [pixels].
[[nodiscard]] GlyphSheet MakeGlyphSheet(int half_pixels);

/// Size of a dot [half pixels] in a picture of this height [pixels]: the height of a capital is 2.6 % of the picture's,
/// in steps of 3.5 pixels, but never less than 10 pixels.
[[nodiscard]] int DotSize(int picture_height);

/// Index of the character's glyph on the sheet; lower-case letters are drawn as capitals, unknown characters as a
/// space.
[[nodiscard]] int GlyphIndex(char character);

}  // namespace fulcrum::render
