#include "tests/numerics/thermal/flat_scene.h"

#include <algorithm>

namespace fulcrum::thermal {
namespace {

struct Cell {
  const Tile* tile = nullptr;
  int k = 0;
  float theta = 0;
};

Cell Look(const HeatField& field, const Vec2f& p) {
  const CellIndex c = field.sheet().CellOf(p);
  if (!field.sheet().Contains(c)) return {};
  const Tile* tile = field.Find(c.ix / kTile, c.iy / kTile);
  if (tile == nullptr) return {};
  return {tile, (c.iy % kTile) * kTile + c.ix % kTile, tile->theta[ThetaIndex(c.ix % kTile, c.iy % kTile)]};
}

float Side(const Vec2f& a, const Vec2f& b, const Vec2f& p) {
  const Vec2f d = b - a, e = p - a;
  return d.x() * e.y() - d.y() * e.x();
}

bool Crosses(const Vec2f& a, const Vec2f& b, const Vec2f& c, const Vec2f& d) {
  return Side(a, b, c) * Side(a, b, d) < 0 && Side(c, d, a) * Side(c, d, b) < 0;
}

}  // namespace

SlitFigures MeasureSlit(const ThermalSolver& solver, const SceneView& scene, const Drag& drag) {
  const HeatField& field = solver.field();
  const float h = field.material().cell_m;
  const Vec2f along = (drag.to - drag.from).normalized(), across(-along.y(), along.x());
  const float length = (drag.to - drag.from).norm();
  SlitFigures figures;
  figures.width_min_m = 1e9f;
  int stations = 0, ends = 0;
  for (float u = 0.1f * length; u < 0.9f * length; u += h, ++stations) {
    float width = 0, brown = 0, dead = 0, warm = 0;
    for (float v = -0.008f; v < 0.008f; v += 0.5f * h) {
      const Cell cell = Look(field, drag.from + u * along + v * across);
      if (cell.tile == nullptr) continue;
      const TileState& s = cell.tile->state;
      if ((s.flags[cell.k] & kRemoved) != 0) {
        width += 0.5f * h;
        continue;
      }
      brown += s.omega_collagen[cell.k] >= 1.0f ? 0.25f * h : 0.0f;
      dead += s.omega_cell[cell.k] >= 1.0f ? 0.25f * h : 0.0f;
      warm += cell.theta >= 8.0f ? 0.25f * h : 0.0f;
    }
    figures.width_min_m = std::min(figures.width_min_m, width);
    figures.width_max_m = std::max(figures.width_max_m, width);
    figures.width_mean_m += width;
    figures.brown_m += brown;
    figures.dead_m += dead;
    if (u > 0.8f * length) {
      figures.warm_m += warm;
      ++ends;
    }
  }
  const float n = static_cast<float>(std::max(stations, 1));
  figures.width_mean_m /= n;
  figures.brown_m /= n;
  figures.dead_m /= n;
  figures.warm_m /= static_cast<float>(std::max(ends, 1));
  const Vec2f a = drag.from + 0.001f * along, b = drag.to - 0.001f * along;
  const std::uint32_t cols = scene.membrane.cols;
  for (std::size_t e = 0; e < scene.membrane_rest_length.size(); ++e) {
    if (scene.membrane_rest_length[e] <= 0 || TestBit(solver.topology().committed().dead_edges, e)) continue;
    const std::size_t node = e / 3;
    const std::size_t other = e % 3 == 0 ? node + 1 : (e % 3 == 1 ? node + cols : node + cols + 1);
    if (Crosses(scene.membrane_material[node], scene.membrane_material[other], a, b)) ++figures.surviving_crossings;
  }
  return figures;
}

}  // namespace fulcrum::thermal
