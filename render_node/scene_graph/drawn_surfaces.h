// The surfaces of a picture as numbers: what has just been given to OpenGL, with names, for the ground truth of the
// picture.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <osg/Node>
#include <string>
#include <vector>

#include "services/base/core/scene_view.h"

namespace fulcrum::render {

struct DrawnSurface {
  std::string name;  ///< "rectum", "organ" (a solid of another look), "fat", "membrane", "cut" (its lips),
                     ///< "clip", "surroundings", "breathing", "burn", or the part of a tool.
  int tool = -1;     ///< Tool that it is part of; -1: tissue.
  int part = 0;      ///< Counts the surfaces of one name and tool.
  std::vector<Vec3d> positions_W;
  std::vector<Triangle> triangles;                ///< Those that may be visible; their choice depends on the camera.
  std::vector<std::array<float, 4>> coordinates;  ///< As the shader of the surface takes them; empty: none.
  double behind_m = 0;                            ///< As in surface.vert.
  bool cull_back = false;
};

/// Surfaces below `root` (LaparoscopeView::root()) as of its last Update(); effects, the burns of solids, text and the
/// mask are left out.
[[nodiscard]] std::vector<DrawnSurface> DrawnSurfaces(osg::Node* root);

/// The mesh that is laid over the solids where their charts have burns, with the triangles of the solids themselves.
/// Its coordinates are (s, t) in the charts [m] and the number of the chart. None while no burnt chart is in the field.
[[nodiscard]] std::optional<DrawnSurface> DrawnBurn(osg::Node* root);

}  // namespace fulcrum::render
