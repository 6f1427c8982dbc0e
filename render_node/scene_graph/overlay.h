// Figures in the corners of the picture, outside the round field where there is room.
#pragma once

#include <array>
#include <string>

#include "render_node/scene_graph/mesh.h"

namespace fulcrum::render {

enum class Corner { kTopLeft, kTopRight, kBottomLeft, kBottomRight };

struct OverlayText {
  Corner corner;
  int line;  ///< 0 is nearest to the upper or lower rim.
  std::string text;
  bool warning = false;  ///< Red instead of grey.
  int size = 1;          ///< Height and pitch, in those of plain text.
};

class Overlay {
 public:
  Overlay(int width, int height);
  /// Replaces all text.
  void Set(std::span<const OverlayText> texts);
  [[nodiscard]] osg::Geometry* geometry() const { return mesh_.geometry(); }
  [[nodiscard]] osg::StateSet* state() const { return mesh_.state(); }

 private:
  int width_;
  int height_;
  int dot_;  // Pixels per dot of the font.
  int sheet_width_;
  Mesh mesh_;
};

}  // namespace fulcrum::render
