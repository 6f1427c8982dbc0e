// The font of the text in the picture: DejaVu Sans, part of the program, drawn by FreeType at the size of the picture.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <unordered_map>
#include <vector>

namespace fulcrum::render {

/// A character's cell on the sheet: its lower left corner and its width [pixels].
struct Glyph {
  int x = 0, y = 0, width = 0;
};

/// All glyphs in two sizes, one byte per pixel (0 to 255), bottom row first.
struct GlyphSheet {
  struct Size {
    int height = 0;  ///< Of the cells [pixels].
    std::unordered_map<char32_t, Glyph> glyphs;
    /// The character's glyph, or that of a question mark.
    [[nodiscard]] const Glyph& Of(char32_t character) const;
  };
  int width = 0, height = 0;
  std::array<Size, 2> sizes;  ///< Plain text, and text of twice its height.
  std::vector<std::uint8_t> pixels;
};
/// @param capital_height of plain text [pixels].
/// @param squeeze_x, squeeze_y factors in (0, 1] on width and height, for a picture that a display stretches again.
[[nodiscard]] GlyphSheet MakeGlyphSheet(int capital_height, double squeeze_x = 1, double squeeze_y = 1);

/// Height of a capital in a picture of this height [pixels]: 2.6 % of it, at least 10 pixels.
[[nodiscard]] int CapitalHeight(int picture_height);

/// Characters of a text in UTF-8; a byte that is none becomes a question mark.
[[nodiscard]] std::u32string Characters(const std::string& text);

}  // namespace fulcrum::render
