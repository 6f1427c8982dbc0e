// Contours of what is cut out of the sheet: closed or open lines in the sheet's own coordinates. Pure.
#pragma once

#include <vector>

#include "render_node/geometry/atlas.h"

namespace fulcrum::render {

/// A place on the contour.
struct ContourPoint {
  Vec2f material;  ///< (s, t) [m].
  Vec2f inward;    ///< Unit, across the contour into the tissue.
};

/// One line along removed tissue, its points `spacing_m` apart within a quarter. It is closed where it meets no border
/// of the atlas: the first point then follows the last.
struct Contour {
  std::vector<ContourPoint> points;
  bool closed = false;
};

/// Contours of `atlas`, by marching squares (Lorensen and Cline 1987) over the blocks of texels in which tissue is
/// removed, at the level at which the shaders end the sheet. The steps of single texels are smoothed by binomial
/// weights over about three of them. The result depends on the texels alone, not on the order in which they came.
[[nodiscard]] std::vector<Contour> FindContours(const Atlas& atlas, float spacing_m);

}  // namespace fulcrum::render
