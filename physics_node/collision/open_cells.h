// The part of a triangle of the mesh that remains after some of its thermal cells have been removed (open cells).
//
// The mesh severs an edge when its whole strand is open. Until then the triangle transmits forces, but metal in its
// open cells must not push it: the slit would open by a whole edge at a time and drag the sheet along in between.
//
//   centre of cell (i, j):   q = c (i + 1/2, j + 1/2) in material coordinates [m],   c: size of a cell
//   in the triangle where    u, v >= 0,  u + v <= 1;   u = d x e2 / (e1 x e2),  v = e1 x d / (e1 x e2)
//   d = q - m_0,  e1 = m_1 - m_0,  e2 = m_2 - m_0,   m_k: corners;   barycentric coordinates (1 - u - v, u, v)
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "physics_node/collision/closest.h"
#include "services/base/core/messages.h"

namespace fulcrum::physics {

/// A triangle of the membrane, by its corners.
struct SheetTriangle {
  std::array<Vec2f, 3> material;  ///< (s, t) [m].
  std::array<Vec3f, 3> place;     ///< In frame W.
};

/// The cell at a point of the sheet is open.
[[nodiscard]] bool IsOpenAt(const OpenCells& open, float cell_m, const Vec2f& material);

/// Replaces `closest` by the centre of the remaining cell of the triangle that is nearest to the axis from a to b.
/// False, with `closest` unchanged: no cell remains within `range` of the axis.
[[nodiscard]] bool NearestRemaining(const OpenCells& open, float cell_m, const SheetTriangle& triangle, const Vec3f& a,
                                    const Vec3f& b, float range, ClosestPoints* closest);

/// Calls visit(ix, iy, barycentric) for the cells whose centres lie in the triangle, of those in the box from (x0, y0)
/// to (x1, y1) inclusive.
template <class Visit>
void ForCellsIn(const std::array<Vec2f, 3>& material, float cell_m, std::int32_t x0, std::int32_t y0, std::int32_t x1,
                std::int32_t y1, const Visit& visit) {
  const Vec2f low = material[0].cwiseMin(material[1]).cwiseMin(material[2]) / cell_m;
  const Vec2f high = material[0].cwiseMax(material[1]).cwiseMax(material[2]) / cell_m;
  const Vec2f e1 = material[1] - material[0], e2 = material[2] - material[0];
  const float per_area = 1.0f / (e1.x() * e2.y() - e1.y() * e2.x());
  for (auto iy = std::max(y0, static_cast<std::int32_t>(std::floor(low.y())));
       iy <= std::min(y1, static_cast<std::int32_t>(std::floor(high.y()))); ++iy) {
    for (auto ix = std::max(x0, static_cast<std::int32_t>(std::floor(low.x())));
         ix <= std::min(x1, static_cast<std::int32_t>(std::floor(high.x()))); ++ix) {
      const Vec2f d = cell_m * Vec2f(static_cast<float>(ix) + 0.5f, static_cast<float>(iy) + 0.5f) - material[0];
      const float u = per_area * (d.x() * e2.y() - d.y() * e2.x()), v = per_area * (e1.x() * d.y() - e1.y() * d.x());
      // Of a triangle without area u and v are not finite, and no cell is visited.
      if (u >= 0.0f && v >= 0.0f && u + v <= 1.0f) {
        visit(ix, iy, std::array<float, 3>{1.0f - u - v, u, v});
      }
    }
  }
}

}  // namespace fulcrum::physics
