// Text in the corners of the picture, outside the round field. With stereo each eye sees it at the same place, squeezed
// as its part of the picture is.
#pragma once

#include <array>
#include <string>

#include "render_node/scene_graph/font.h"
#include "render_node/scene_graph/mesh.h"
#include "services/base/core/scene_view.h"

namespace fulcrum::render {

enum class Corner { kTopLeft, kTopRight, kBottomLeft, kBottomRight };

struct OverlayText {
  Corner corner;
  int line;              ///< 0 is nearest to the upper or lower edge.
  std::string text;      ///< UTF-8; characters that the font's sheet lacks become question marks.
  bool warning = false;  ///< Red instead of grey.
  int size = 1;          ///< Factor on height and line pitch of plain text: 1 or 2.
};

class Overlay {
 public:
  /// Size of the picture [pixels].
  Overlay(StereoLayout layout, int width, int height);
  /// The text changes its size with the next Set().
  void SetSize(int width, int height);
  /// Replaces all text.
  void Set(std::span<const OverlayText> texts);
  [[nodiscard]] osg::Geometry* geometry() const { return mesh_.geometry(); }
  [[nodiscard]] osg::StateSet* state() const { return mesh_.state(); }

 private:
  const StereoLayout layout_;
  int width_;
  int height_;
  int capital_ = 0;  // Height of a capital of plain text [pixels].
  GlyphSheet sheet_;
  Mesh mesh_;
};

}  // namespace fulcrum::render
