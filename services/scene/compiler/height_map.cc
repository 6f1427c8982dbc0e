#include "services/scene/compiler/height_map.h"

#include <algorithm>
#include <cmath>

namespace fulcrum::scene {

Grid<double> HeightsOf(const TriangleMesh& organ, double width, double length) {
  Grid<double> heights(kHeightSamples, kHeightSamples, kNoHeight);
  const auto column = [&](double x) { return (x / width + 0.5) * (kHeightSamples - 1); };
  const auto row = [&](double y) { return (y / length + 0.5) * (kHeightSamples - 1); };
  for (const Triangle& t : organ.triangles) {
    const Vec3d &a = organ.vertices[t[0]], &b = organ.vertices[t[1]], &c = organ.vertices[t[2]];
    const double area = (b.x() - a.x()) * (c.y() - a.y()) - (c.x() - a.x()) * (b.y() - a.y());
    if (!(area > 0)) continue;  // Seen from inside or on edge.
    const auto [x0, x1] = std::minmax({column(a.x()), column(b.x()), column(c.x())});
    const auto [y0, y1] = std::minmax({row(a.y()), row(b.y()), row(c.y())});
    const int c0 = std::max(0, static_cast<int>(std::ceil(std::max(x0, -1.0)))),
              c1 = std::min(kHeightSamples - 1, static_cast<int>(std::floor(std::min<double>(x1, kHeightSamples))));
    const int r0 = std::max(0, static_cast<int>(std::ceil(std::max(y0, -1.0)))),
              r1 = std::min(kHeightSamples - 1, static_cast<int>(std::floor(std::min<double>(y1, kHeightSamples))));
    for (int r = r0; r <= r1; ++r) {
      for (int k = c0; k <= c1; ++k) {
        const double x = (static_cast<double>(k) / (kHeightSamples - 1) - 0.5) * width,
                     y = (static_cast<double>(r) / (kHeightSamples - 1) - 0.5) * length;
        const double v = ((x - a.x()) * (c.y() - a.y()) - (c.x() - a.x()) * (y - a.y())) / area,
                     w = ((b.x() - a.x()) * (y - a.y()) - (x - a.x()) * (b.y() - a.y())) / area;
        if (v >= 0 && w >= 0 && v + w <= 1) {
          heights.at(r, k) = std::max(heights.at(r, k), a.z() + v * (b.z() - a.z()) + w * (c.z() - a.z()));
        }
      }
    }
  }
  return heights;
}

}  // namespace fulcrum::scene
