// A built-in bitmap font of five by seven dots for the text in the picture. Pure.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

namespace fulcrum::render {

inline constexpr int kGlyphWidth = 6;   ///< With one dot of space.
inline constexpr int kGlyphHeight = 8;  ///< With one dot of space.

/// All glyphs side by side, one byte per dot (0 or 255), bottom row first.
struct GlyphSheet {
  int width;
  int height;
  std::vector<std::uint8_t> dots;
};
[[nodiscard]] GlyphSheet MakeGlyphSheet();

/// Index of the character's glyph on the sheet; lower-case letters are drawn as capitals, unknown characters as a
/// space.
[[nodiscard]] int GlyphIndex(char character);

}  // namespace fulcrum::render
