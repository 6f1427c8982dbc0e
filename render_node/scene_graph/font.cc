#include "render_node/scene_graph/font.h"

#include <ft2build.h>
#include FT_FREETYPE_H

#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <string_view>

#include "services/base/core/utf8.h"

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

constexpr std::u32string_view kOthers = U"°±²·µ×–▮▯";
constexpr double kCapitalOfEm = 0.729;  // Of DejaVu Sans.
constexpr int kWidest = 4096;           // Of the sheet [pixels]: any OpenGL has such a texture.

void Check(FT_Error error) {
  if (error != 0) throw std::runtime_error("FreeType cannot draw the font: error " + std::to_string(error));
}

struct EndLibrary {
  void operator()(FT_Library library) const { FT_Done_FreeType(library); }  // And its faces.
};

/// A drawn character. Its cell begins where the first pixel is, if that lies before its origin.
struct Drawn {
  int width = 0;          ///< Of the cell [pixels].
  int left = 0, top = 0;  ///< Of the pixels: from the cell's left side, and of their first row over the line.
  int columns = 0, rows = 0;
  std::vector<std::uint8_t> pixels;  ///< First row first.
};

int Pixels(FT_Pos units) { return static_cast<int>((units + 63) >> 6); }

Drawn DrawCharacter(FT_Face face, char32_t character) {
  Check(FT_Load_Char(face, character, FT_LOAD_RENDER | FT_LOAD_TARGET_LIGHT));
  const FT_GlyphSlot slot = face->glyph;
  Drawn drawn;
  drawn.columns = static_cast<int>(slot->bitmap.width);
  drawn.rows = static_cast<int>(slot->bitmap.rows);
  drawn.left = std::max(0, slot->bitmap_left);
  drawn.top = slot->bitmap_top;
  const int before = std::max(0, -slot->bitmap_left);
  drawn.width = std::max(before + Pixels(slot->advance.x), drawn.left + drawn.columns);
  for (int row = 0; row < drawn.rows; ++row) {
    const std::uint8_t* first = slot->bitmap.buffer + row * slot->bitmap.pitch;
    drawn.pixels.insert(drawn.pixels.end(), first, first + drawn.columns);
  }
  return drawn;
}

}  // namespace

const Glyph& GlyphSheet::Size::Of(char32_t character) const {
  const auto found = glyphs.find(character);
  return found != glyphs.end() ? found->second : glyphs.at(U'?');
}

GlyphSheet MakeGlyphSheet(int capital_height, double squeeze_x, double squeeze_y) {
  FT_Library opened = nullptr;
  Check(FT_Init_FreeType(&opened));
  const std::unique_ptr<FT_LibraryRec_, EndLibrary> library(opened);
  FT_Face face = nullptr;
  Check(FT_New_Memory_Face(opened, fulcrum_font_begin, fulcrum_font_end - fulcrum_font_begin, 0, &face));
  std::u32string characters(kOthers);
  for (char32_t c = U' '; c <= U'~'; ++c) characters += c;

  GlyphSheet sheet;
  sheet.width = kWidest;
  for (std::size_t k = 0; k < sheet.sizes.size(); ++k) {
    GlyphSheet::Size& size = sheet.sizes[k];
    const double em = static_cast<double>(k + 1) * capital_height / kCapitalOfEm;
    Check(FT_Set_Pixel_Sizes(face, static_cast<FT_UInt>(std::lround(squeeze_x * em)),
                             static_cast<FT_UInt>(std::lround(squeeze_y * em))));
    const int below = Pixels(-face->size->metrics.descender);
    size.height = below + Pixels(face->size->metrics.ascender);
    int x = kWidest;  // The first character begins a row.
    for (const char32_t character : characters) {
      const Drawn drawn = DrawCharacter(face, character);
      if (x + drawn.width > kWidest) {
        x = 0;
        sheet.height += size.height;
        sheet.pixels.resize(static_cast<std::size_t>(sheet.width) * static_cast<std::size_t>(sheet.height));
      }
      const Glyph cell{x, sheet.height - size.height, drawn.width};
      for (int row = 0; row < drawn.rows; ++row) {
        const int y = below + drawn.top - 1 - row;
        if (y < 0 || y >= size.height) continue;  // Higher than the font says of itself: none of these is.
        std::copy_n(drawn.pixels.begin() + row * drawn.columns, drawn.columns,
                    sheet.pixels.begin() + (cell.y + y) * sheet.width + cell.x + drawn.left);
      }
      size.glyphs[character] = cell;
      x += drawn.width;
    }
  }
  return sheet;
}

int CapitalHeight(int picture_height) { return std::max(10, static_cast<int>(0.026 * picture_height)); }

std::u32string Characters(const std::string& text) {
  std::u32string characters;
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t length = Utf8Length(text, i);
    char32_t code = length == 0 ? U'?' : static_cast<unsigned char>(text[i]);
    if (length > 1) code &= 0x7fu >> length;
    for (std::size_t j = 1; j < length; ++j) code = code << 6 | (static_cast<unsigned char>(text[i + j]) & 0x3fu);
    characters += code;
    i += std::max<std::size_t>(1, length);
  }
  return characters;
}

}  // namespace fulcrum::render
