#include "render_node/scene_graph/font.h"

#include <ft2build.h>
#include FT_FREETYPE_H

#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <string_view>

// The file is part of the program, so that a picture needs nothing that is not installed.
asm(".section .rodata\n"
    ".global fulcrum_font_begin, fulcrum_font_end\n"
    "fulcrum_font_begin: .incbin \"" FULCRUM_FONT
    "\"\n"
    "fulcrum_font_end: .byte 0\n"
    ".previous\n");
extern "C" const unsigned char fulcrum_font_begin[], fulcrum_font_end[];

namespace fulcrum::render {
namespace {

constexpr std::u32string_view kOthers = U"°±²·µ×–■□";
constexpr float kCapitalOfEm = 0.729f;  // Of DejaVu Sans.

void Check(FT_Error error, const char* what) {
  if (error != 0)
    throw std::runtime_error(std::string("the font cannot be ") + what + ": FreeType error " + std::to_string(error));
}

class Face {
 public:
  Face() {
    Check(FT_Init_FreeType(&library_), "read");
    Check(FT_New_Memory_Face(library_, fulcrum_font_begin, fulcrum_font_end - fulcrum_font_begin, 0, &face_), "read");
  }
  ~Face() { FT_Done_FreeType(library_); }  // Its faces as well.
  Face(const Face&) = delete;
  Face& operator=(const Face&) = delete;
  [[nodiscard]] FT_Face get() const { return face_; }

 private:
  FT_Library library_ = nullptr;
  FT_Face face_ = nullptr;
};

int Pixels(FT_Pos units) { return static_cast<int>((units + 63) >> 6); }

}  // namespace

const Glyph& GlyphSheet::Size::Of(char32_t character) const {
  const auto found = glyphs.find(character);
  return found != glyphs.end() ? found->second : glyphs.at(U'?');
}

GlyphSheet MakeGlyphSheet(int capital_height) {
  const Face face;
  std::u32string characters(kOthers);
  for (char32_t c = U' '; c <= U'~'; ++c) characters += c;

  GlyphSheet sheet;
  std::array<int, 2> baseline{};
  for (std::size_t k = 0; k < sheet.sizes.size(); ++k) {
    GlyphSheet::Size& size = sheet.sizes[k];
    const auto em = static_cast<FT_UInt>(
        std::lround(static_cast<float>((k + 1) * static_cast<std::size_t>(capital_height)) / kCapitalOfEm));
    Check(FT_Set_Pixel_Sizes(face.get(), 0, em), "scaled");
    baseline[k] = Pixels(-face.get()->size->metrics.descender);
    size.y = sheet.height;
    size.height = baseline[k] + Pixels(face.get()->size->metrics.ascender);
    int x = 0;
    for (const char32_t c : characters) {
      Check(FT_Load_Char(face.get(), c, FT_LOAD_TARGET_LIGHT), "drawn");
      const int width = Pixels(face.get()->glyph->advance.x);
      size.glyphs[c] = {x, width};
      x += width;
    }
    sheet.width = std::max(sheet.width, x);
    sheet.height += size.height;
  }
  sheet.pixels.resize(static_cast<std::size_t>(sheet.width) * static_cast<std::size_t>(sheet.height));
  for (std::size_t k = 0; k < sheet.sizes.size(); ++k) {
    const GlyphSheet::Size& size = sheet.sizes[k];
    const auto em = static_cast<FT_UInt>(
        std::lround(static_cast<float>((k + 1) * static_cast<std::size_t>(capital_height)) / kCapitalOfEm));
    Check(FT_Set_Pixel_Sizes(face.get(), 0, em), "scaled");
    for (const char32_t c : characters) {
      Check(FT_Load_Char(face.get(), c, FT_LOAD_RENDER | FT_LOAD_TARGET_LIGHT), "drawn");
      const FT_GlyphSlot drawn = face.get()->glyph;
      const Glyph& cell = size.glyphs.at(c);
      for (unsigned row = 0; row < drawn->bitmap.rows; ++row) {
        const int y = baseline[k] + drawn->bitmap_top - 1 - static_cast<int>(row);
        for (unsigned column = 0; column < drawn->bitmap.width; ++column) {
          const int x = drawn->bitmap_left + static_cast<int>(column);
          if (x < 0 || x >= cell.width || y < 0 || y >= size.height) continue;  // What overhangs its cell.
          sheet.pixels[static_cast<std::size_t>(size.y + y) * static_cast<std::size_t>(sheet.width) +
                       static_cast<std::size_t>(cell.x + x)] =
              drawn->bitmap.buffer[row * static_cast<unsigned>(drawn->bitmap.pitch) + column];
        }
      }
    }
  }
  return sheet;
}

int CapitalHeight(int picture_height) { return std::max(9, static_cast<int>(0.024 * picture_height)); }

std::u32string Characters(const std::string& text) {
  std::u32string characters;
  for (std::size_t i = 0; i < text.size();) {
    const auto byte = [&](std::size_t k) { return k < text.size() ? static_cast<unsigned char>(text[k]) : 0u; };
    const auto follows = [&](std::size_t k) { return (byte(k) & 0xc0u) == 0x80u; };
    const unsigned first = byte(i);
    if (first < 0x80) {
      characters += static_cast<char32_t>(first);
      i += 1;
    } else if ((first & 0xe0u) == 0xc0u && follows(i + 1)) {
      characters += static_cast<char32_t>((first & 0x1fu) << 6 | (byte(i + 1) & 0x3fu));
      i += 2;
    } else if ((first & 0xf0u) == 0xe0u && follows(i + 1) && follows(i + 2)) {
      characters += static_cast<char32_t>((first & 0x0fu) << 12 | (byte(i + 1) & 0x3fu) << 6 | (byte(i + 2) & 0x3fu));
      i += 3;
    } else {
      characters += U'?';
      i += 1;
    }
  }
  return characters;
}

}  // namespace fulcrum::render
