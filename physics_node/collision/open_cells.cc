#include "physics_node/collision/open_cells.h"

namespace fulcrum::physics {

bool IsOpenAt(const OpenCells& open, float cell_m, const Vec2f& material) {
  return open.IsOpen(static_cast<std::int32_t>(std::floor(material.x() / cell_m)),
                     static_cast<std::int32_t>(std::floor(material.y() / cell_m)));
}

bool NearestRemaining(const OpenCells& open, float cell_m, const SheetTriangle& triangle, const Vec3f& a,
                      const Vec3f& b, float range, ClosestPoints* closest) {
  float nearest_sq = range * range;
  bool found = false;
  constexpr std::int32_t kAll = 1 << 30;  // Beyond every cell of a sheet.
  ForCellsIn(triangle.material, cell_m, -kAll, -kAll, kAll, kAll,
             [&](std::int32_t ix, std::int32_t iy, const std::array<float, 3>& w) {
               if (open.IsOpen(ix, iy)) {
                 return;
               }
               const Vec3f p = w[0] * triangle.place[0] + w[1] * triangle.place[1] + w[2] * triangle.place[2];
               const float t = ClosestOnSegment(p, a, b);
               const Vec3f on_segment = a + t * (b - a);
               const float distance_sq = (on_segment - p).squaredNorm();
               if (distance_sq < nearest_sq) {
                 nearest_sq = distance_sq;
                 found = true;
                 *closest = {distance_sq, t, w, on_segment, p, false};
               }
             });
  return found;
}

}  // namespace fulcrum::physics
