// Text in the corners of the picture, outside the round field.
#pragma once

#include <array>
#include <string>

#include "render_node/scene_graph/mesh.h"

namespace fulcrum::render {

enum class Corner { kTopLeft, kTopRight, kBottomLeft, kBottomRight };

struct OverlayText {
  Corner corner;
  int line;  ///< 0 is nearest to the upper or lower edge.
  std::string text;
  bool warning = false;  ///< Red instead of grey.
  int size = 1;          ///< Factor on height and line pitch of plain text.
};

class Overlay {
 public:
  /// Size of the picture [pixels].
  Overlay(int width, int height);
  /// The text changes its size with the next Set().
  void SetSize(int width, int height);
  /// Replaces all text.
  void Set(std::span<const OverlayText> texts);
  [[nodiscard]] osg::Geometry* geometry() const { return mesh_.geometry(); }
  [[nodiscard]] osg::StateSet* state() const { return mesh_.state(); }

 private:
  int width_;
  int height_;
  int dot_ = 0;  // Size of a dot of the font [half pixels].
  int sheet_width_ = 0;
  Mesh mesh_;
};

}  // namespace fulcrum::render
