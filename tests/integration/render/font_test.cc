#include "render_node/scene_graph/font.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace fulcrum::render {
namespace {

/// Rows of a glyph's cell that are not empty: from the lowest to the highest.
std::pair<int, int> Extent(const GlyphSheet& sheet, const GlyphSheet::Size& size, char32_t character) {
  const Glyph& glyph = size.Of(character);
  int low = size.height, high = -1;
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < glyph.width; ++x) {
      if (sheet.pixels[static_cast<std::size_t>((glyph.y + y) * sheet.width + glyph.x + x)] > 127) {
        low = std::min(low, y);
        high = std::max(high, y);
      }
    }
  }
  return {low, high};
}

TEST(FontTest, TextIsAShareOfThePictureAndNeverSmallerThanTenPixels) {
  EXPECT_EQ(CapitalHeight(240), 10);
  EXPECT_EQ(CapitalHeight(540), 14);
  EXPECT_EQ(CapitalHeight(2160), 56);
}

TEST(FontTest, ACapitalHasTheHeightThatWasAskedForInBothSizes) {
  for (const int capital : {9, 12, 17, 51}) {
    const GlyphSheet sheet = MakeGlyphSheet(capital);
    for (std::size_t k = 0; k < 2; ++k) {
      const auto [low, high] = Extent(sheet, sheet.sizes[k], U'H');
      EXPECT_NEAR(high - low + 1, capital * static_cast<int>(k + 1), 1);
      EXPECT_LT(Extent(sheet, sheet.sizes[k], U'g').first, low) << "below the line";
    }
  }
}

TEST(FontTest, TheSheetFitsIntoATextureAtAnySizeOfThePicture) {
  for (const int capital : {9, 51, CapitalHeight(7680)}) {
    const GlyphSheet sheet = MakeGlyphSheet(capital);
    EXPECT_LE(sheet.width, 4096);
    EXPECT_LE(sheet.height, 8192);
    EXPECT_EQ(sheet.pixels.size(), static_cast<std::size_t>(sheet.width) * static_cast<std::size_t>(sheet.height));
  }
}

TEST(FontTest, FiguresAreOfOneWidthSoThatTheyStandStill) {
  const GlyphSheet sheet = MakeGlyphSheet(12);
  for (char32_t c = U'0'; c <= U'9'; ++c) EXPECT_EQ(sheet.sizes[0].Of(c).width, sheet.sizes[0].Of(U'0').width);
  EXPECT_EQ(sheet.sizes[0].Of(U'▮').width, sheet.sizes[0].Of(U'▯').width) << "the bar of a force";
}

TEST(FontTest, UnknownCharactersAndBrokenUtf8BecomeQuestionMarks) {
  EXPECT_EQ(Characters("37 °C ▮"), U"37 °C ▮");
  EXPECT_EQ(Characters("a\xff\xe2\x96"), U"a???");
  EXPECT_EQ(Characters("\xc2"), U"?");
  const GlyphSheet sheet = MakeGlyphSheet(12);
  EXPECT_EQ(sheet.sizes[0].Of(U'\u4e2d').x, sheet.sizes[0].Of(U'?').x);
}

}  // namespace
}  // namespace fulcrum::render
