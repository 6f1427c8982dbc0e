#include "render_node/geometry/glyphs.h"

#include <algorithm>
#include <array>
#include <cctype>

#include "render_node/geometry/texel.h"

namespace fulcrum::render {
namespace {

constexpr std::string_view kCharacters = " 0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZ.:-/%!#+,";

// Seven rows from the top, five dots each, the leftmost dot in bit 4.
constexpr std::array<std::array<std::uint8_t, 7>, kCharacters.size()> kRows{{
    {0, 0, 0, 0, 0, 0, 0},        {14, 17, 19, 21, 25, 17, 14},  // 0
    {4, 12, 4, 4, 4, 4, 14},                                     // 1
    {14, 17, 1, 2, 4, 8, 31},                                    // 2
    {31, 2, 4, 2, 1, 17, 14},                                    // 3
    {2, 6, 10, 18, 31, 2, 2},                                    // 4
    {31, 16, 30, 1, 1, 17, 14},                                  // 5
    {6, 8, 16, 30, 17, 17, 14},                                  // 6
    {31, 1, 2, 4, 8, 8, 8},                                      // 7
    {14, 17, 17, 14, 17, 17, 14},                                // 8
    {14, 17, 17, 15, 1, 2, 12},                                  // 9
    {14, 17, 17, 31, 17, 17, 17},                                // A
    {30, 17, 17, 30, 17, 17, 30},                                // B
    {14, 17, 16, 16, 16, 17, 14},                                // C
    {28, 18, 17, 17, 17, 18, 28},                                // D
    {31, 16, 16, 30, 16, 16, 31},                                // E
    {31, 16, 16, 30, 16, 16, 16},                                // F
    {14, 17, 16, 23, 17, 17, 15},                                // G
    {17, 17, 17, 31, 17, 17, 17},                                // H
    {14, 4, 4, 4, 4, 4, 14},                                     // I
    {7, 2, 2, 2, 2, 18, 12},                                     // J
    {17, 18, 20, 24, 20, 18, 17},                                // K
    {16, 16, 16, 16, 16, 16, 31},                                // L
    {17, 27, 21, 21, 17, 17, 17},                                // M
    {17, 17, 25, 21, 19, 17, 17},                                // N
    {14, 17, 17, 17, 17, 17, 14},                                // O
    {30, 17, 17, 30, 16, 16, 16},                                // P
    {14, 17, 17, 17, 21, 18, 13},                                // Q
    {30, 17, 17, 30, 20, 18, 17},                                // R
    {15, 16, 16, 14, 1, 1, 30},                                  // S
    {31, 4, 4, 4, 4, 4, 4},                                      // T
    {17, 17, 17, 17, 17, 17, 14},                                // U
    {17, 17, 17, 17, 17, 10, 4},                                 // V
    {17, 17, 17, 21, 21, 21, 10},                                // W
    {17, 17, 10, 4, 10, 17, 17},                                 // X
    {17, 17, 17, 10, 4, 4, 4},                                   // Y
    {31, 1, 2, 4, 8, 16, 31},                                    // Z
    {0, 0, 0, 0, 0, 12, 12},                                     // .
    {0, 12, 12, 0, 12, 12, 0},                                   // :
    {0, 0, 0, 31, 0, 0, 0},                                      // -
    {0, 1, 2, 4, 8, 16, 0},                                      // /
    {24, 25, 2, 4, 8, 19, 3},                                    // %
    {4, 4, 4, 4, 4, 0, 4},                                       // !
    {31, 31, 31, 31, 31, 31, 31},                                // #
    {0, 4, 4, 31, 4, 4, 0},                                      // +
    {0, 0, 0, 0, 12, 4, 8},                                      // ,
}};

constexpr int kLines = 270;      // Height of the picture [dots].
constexpr int kSmallestDot = 3;  // [half pixels]

}  // namespace

int GlyphIndex(char character) {
  const auto place = kCharacters.find(static_cast<char>(std::toupper(static_cast<unsigned char>(character))));
  return place == std::string_view::npos ? 0 : static_cast<int>(place);
}

GlyphSheet MakeGlyphSheet(int half_pixels) {
  const int glyph_width = kGlyphWidth * half_pixels / 2, height = kGlyphHeight * half_pixels / 2;
  GlyphSheet sheet{glyph_width * static_cast<int>(kCharacters.size()), height, {}};
  sheet.pixels.assign(TexelIndex(0, sheet.height, sheet.width), 0);
  for (std::size_t glyph = 0; glyph < kCharacters.size(); ++glyph) {
    // Half pixels (x, y) of the glyph, y from the top: each is a quarter of a pixel, wholly within one dot.
    for (int y = 0; y < 7 * half_pixels; ++y) {
      for (int x = 0; x < 5 * half_pixels; ++x) {
        if (((kRows[glyph][static_cast<std::size_t>(y / half_pixels)] >> (4 - x / half_pixels)) & 1) == 0) continue;
        std::uint8_t& pixel =
            sheet.pixels[TexelIndex(glyph_width * static_cast<int>(glyph) + x / 2, height - 1 - y / 2, sheet.width)];
        pixel = static_cast<std::uint8_t>(std::min(255, pixel + 64));
      }
    }
  }
  return sheet;
}

int DotSize(int picture_height) { return std::max(kSmallestDot, 2 * picture_height / kLines); }

}  // namespace fulcrum::render
