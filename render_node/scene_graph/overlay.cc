#include "render_node/scene_graph/overlay.h"

#include <algorithm>
#include <vector>

#include "render_node/scene_graph/atlas_texture.h"
#include "render_node/scene_graph/program.h"

namespace fulcrum::render {
namespace {

constexpr std::array<float, 4> kText{0.62f, 0.70f, 0.72f, 1};
constexpr std::array<float, 4> kWarning{1.0f, 0.25f, 0.15f, 1};
constexpr int kGlyphUnit = 7;  // A texture unit that no other shader uses.

}  // namespace

Overlay::Overlay(StereoLayout layout, int width, int height) : layout_(layout), mesh_("overlay", true) {
  mesh_.state()->setAttributeAndModes(MakeProgram("overlay.vert", "overlay.frag"));
  mesh_.state()->addUniform(new osg::Uniform("glyphs", kGlyphUnit));
  mesh_.state()->setMode(GL_DEPTH_TEST, osg::StateAttribute::OFF);
  SetSize(width, height);
}

void Overlay::SetSize(int width, int height) {
  width_ = width;
  height_ = height;
  const int capital = CapitalHeight(height);
  if (capital == capital_) return;
  capital_ = capital;
  const bool beside = layout_ == StereoLayout::kSideBySide, above = layout_ == StereoLayout::kTopBottom;
  sheet_ = MakeGlyphSheet(capital, beside ? 0.5 : 1, above ? 0.5 : 1);
  osg::ref_ptr<osg::Texture2D> texture = MakeTexture(sheet_.width, sheet_.height, 1, sheet_.pixels, false);
  texture->setFilter(osg::Texture::MIN_FILTER, osg::Texture::NEAREST);
  texture->setFilter(osg::Texture::MAG_FILTER, osg::Texture::NEAREST);
  mesh_.state()->setTextureAttribute(kGlyphUnit, texture);
}

void Overlay::Set(std::span<const OverlayText> texts) {
  std::vector<Vec3f> positions;
  std::vector<std::array<float, 4>> coordinates, colours;
  std::vector<Triangle> triangles;
  const bool beside = layout_ == StereoLayout::kSideBySide, above = layout_ == StereoLayout::kTopBottom;
  const int width = beside ? width_ / 2 : width_, height = above ? height_ / 2 : height_;  // Of an eye's part.
  const int margin = 2 * capital_ / 3, margin_x = beside ? margin / 2 : margin, margin_y = above ? margin / 2 : margin;
  const int pitch = sheet_.sizes[0].height;
  for (const OverlayText& text : texts) {
    const bool top = text.corner == Corner::kTopLeft || text.corner == Corner::kTopRight;
    const bool left = text.corner == Corner::kTopLeft || text.corner == Corner::kBottomLeft;
    const GlyphSheet::Size& size = sheet_.sizes[text.size > 1 ? 1 : 0];
    const std::u32string characters = Characters(text.text);
    int length = 0;
    for (const char32_t character : characters) length += size.Of(character).width;
    const int from = left ? margin_x : width - margin_x - length;
    const int up = pitch * text.size;
    const int y = top ? height - margin_y - up * (text.line + 1) : margin_y + up * text.line;
    for (int eye = 0; eye < (beside || above ? 2 : 1); ++eye) {
      // The left eye's part is on the left, or on top.
      int x = from + (beside && eye == 1 ? width : 0);
      const int row = y + (above && eye == 0 ? height_ - height : 0);
      for (const char32_t character : characters) {
        const auto first = static_cast<Index>(positions.size());
        const Glyph& glyph = size.Of(character);
        for (int corner = 0; corner < 4; ++corner) {
          const int dx = corner == 1 || corner == 2 ? glyph.width : 0, dy = corner >= 2 ? size.height : 0;
          positions.emplace_back(2.0f * static_cast<float>(x + dx) / static_cast<float>(width_) - 1,
                                 2.0f * static_cast<float>(row + dy) / static_cast<float>(height_) - 1, 0.0f);
          coordinates.push_back({static_cast<float>(glyph.x + dx) / static_cast<float>(sheet_.width),
                                 static_cast<float>(glyph.y + dy) / static_cast<float>(sheet_.height), 0, 0});
          colours.push_back(text.warning ? kWarning : kText);
        }
        triangles.push_back({first, first + 1, first + 2});
        triangles.push_back({first, first + 2, first + 3});
        x += glyph.width;
      }
    }
  }
  mesh_.SetPositions(positions);
  mesh_.SetCoordinates(coordinates);
  mesh_.SetColours(colours);
  mesh_.SetTriangles(triangles);
}

}  // namespace fulcrum::render
