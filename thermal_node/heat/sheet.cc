#include "thermal_node/heat/sheet.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "services/core/error.h"

namespace fulcrum::thermal {
namespace {

/// Largest sheet: the atlas at 0.1 mm a texel is 0.41 m; twice that is a wrong unit.
constexpr float kMaxExtent_m = 0.85f;

Sheet MakeEmpty(const Vec2f& low, const Vec2f& high, float cell) {
  Sheet sheet;
  sheet.cell_m = cell;
  // A border that falls on a cell face but for rounding must not add a row of slivers.
  sheet.origin_x = static_cast<std::int32_t>(std::floor(low.x() / cell + 1e-3f));
  sheet.origin_y = static_cast<std::int32_t>(std::floor(low.y() / cell + 1e-3f));
  sheet.nx = static_cast<int>(std::ceil(high.x() / cell - 1e-3f)) - sheet.origin_x;
  sheet.ny = static_cast<int>(std::ceil(high.y() / cell - 1e-3f)) - sheet.origin_y;
  sheet.tiles_x = (sheet.nx + kTile - 1) / kTile;
  sheet.tiles_y = (sheet.ny + kTile - 1) / kTile;
  sheet.metric.assign(sheet.tile_count(), CellMetric{});
  sheet.outside.assign(static_cast<std::size_t>(sheet.tile_count()) * kTileCells / 8, 0xff);
  return sheet;
}

void ClearOutside(Sheet* sheet, int ix, int iy) {
  const std::size_t bit = static_cast<std::size_t>(iy) * sheet->tiles_x * kTile + ix;
  sheet->outside[bit >> 3] = static_cast<std::uint8_t>(sheet->outside[bit >> 3] & ~(1u << (bit & 7u)));
}

float Cross(const Vec2f& a, const Vec2f& b) { return a.x() * b.y() - a.y() * b.x(); }

/// Marks the cells whose centre lies in the triangle as tissue, borders included.
void FillTriangle(Sheet* sheet, const Vec2f& a, const Vec2f& b, const Vec2f& c) {
  const float area = Cross(b - a, c - a);
  if (area == 0.0f) return;
  const float sign = area > 0 ? 1.0f : -1.0f;
  const float slack = -1e-4f * std::abs(area);
  const Vec2f low = a.cwiseMin(b).cwiseMin(c), high = a.cwiseMax(b).cwiseMax(c);
  const CellIndex from = sheet->CellOf(low), to = sheet->CellOf(high);
  for (int iy = std::max(from.iy, 0); iy <= std::min(to.iy, sheet->ny - 1); ++iy) {
    for (int ix = std::max(from.ix, 0); ix <= std::min(to.ix, sheet->nx - 1); ++ix) {
      const Vec2f p = sheet->CentreOf({ix, iy});
      if (sign * Cross(b - a, p - a) >= slack && sign * Cross(c - b, p - b) >= slack &&
          sign * Cross(a - c, p - c) >= slack) {
        ClearOutside(sheet, ix, iy);
      }
    }
  }
}

/// Mean of rest length over material length of the grid edges whose middle lies in each tile.
void AverageMetric(const SceneView& scene, Sheet* sheet) {
  const MembraneGrid& grid = scene.membrane;
  struct Sum {
    double s = 0, t = 0;
    int ns = 0, nt = 0;
  };
  std::vector<Sum> sums(sheet->tile_count());
  const auto add = [&](Index a, Index b, bool along_s) {
    const Vec2f d = scene.membrane_material[b] - scene.membrane_material[a];
    const float rest = (scene.rest_position[grid.first + b] - scene.rest_position[grid.first + a]).norm();
    const CellIndex cell = sheet->CellOf(0.5f * (scene.membrane_material[a] + scene.membrane_material[b]));
    if (!sheet->Contains(cell) || d.norm() <= 0.0f) return;
    Sum& sum = sums[(cell.iy / kTile) * sheet->tiles_x + cell.ix / kTile];
    const double ratio = rest / d.norm();
    along_s ? (sum.s += ratio, ++sum.ns) : (sum.t += ratio, ++sum.nt);
  };
  for (Index r = 0; r < grid.rows; ++r) {
    for (Index c = 0; c < grid.cols; ++c) {
      const Index node = r * grid.cols + c;
      for (const Index next : {c + 1 < grid.cols ? node + 1 : node, r + 1 < grid.rows ? node + grid.cols : node}) {
        if (next == node) continue;
        const Vec2f d = scene.membrane_material[next] - scene.membrane_material[node];
        add(node, next, std::abs(d.x()) >= std::abs(d.y()));
      }
    }
  }
  for (int i = 0; i < sheet->tile_count(); ++i) {
    const Sum& sum = sums[i];
    if (sum.ns > 0) sheet->metric[i].s = std::clamp(static_cast<float>(sum.s / sum.ns), kMetricMin, kMetricMax);
    if (sum.nt > 0) sheet->metric[i].t = std::clamp(static_cast<float>(sum.t / sum.nt), kMetricMin, kMetricMax);
  }
}

}  // namespace

CellIndex Sheet::CellOf(const Vec2f& material) const {
  return {static_cast<std::int32_t>(std::floor(material.x() / cell_m)) - origin_x,
          static_cast<std::int32_t>(std::floor(material.y() / cell_m)) - origin_y};
}

Vec2f Sheet::CentreOf(CellIndex cell) const {
  return Vec2f(static_cast<float>(cell.ix + origin_x) + 0.5f, static_cast<float>(cell.iy + origin_y) + 0.5f) * cell_m;
}

bool Sheet::OnSheet(const Vec2f& material) const {
  if (!material.allFinite() || material.cwiseAbs().maxCoeff() > 2 * kMaxExtent_m) return false;
  const CellIndex cell = CellOf(material);
  return Contains(cell) && !IsOutside(cell.ix, cell.iy);
}

Sheet MakeSheet(const SceneView& scene) {
  const MembraneGrid& grid = scene.membrane;
  if (grid.rows < 2 || grid.cols < 2 || scene.membrane_material.size() != grid.node_count() ||
      scene.rest_position.size() < grid.first + grid.node_count()) {
    throw InputError("scene '" + std::string(scene.name) + "': thermal_node needs a membrane grid of at least 2 x 2");
  }
  Vec2f low = scene.membrane_material[0], high = low;
  for (const Vec2f& p : scene.membrane_material) {
    if (!p.allFinite()) throw InputError("scene '" + std::string(scene.name) + "': membrane_material is not finite");
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  if (low.cwiseAbs().maxCoeff() > kMaxExtent_m || high.cwiseAbs().maxCoeff() > kMaxExtent_m) {
    throw InputError("scene '" + std::string(scene.name) + "': membrane sheet reaches beyond " +
                     std::to_string(kMaxExtent_m) + " m");
  }
  Sheet sheet = MakeEmpty(low, high, scene.thermal.cell_m);
  const std::span<const Vec2f> p = scene.membrane_material;
  for (Index r = 0; r + 1 < grid.rows; ++r) {
    for (Index c = 0; c + 1 < grid.cols; ++c) {
      const Index n00 = r * grid.cols + c, n01 = n00 + 1, n10 = n00 + grid.cols, n11 = n10 + 1;
      FillTriangle(&sheet, p[n00], p[n01], p[n11]);
      FillTriangle(&sheet, p[n00], p[n11], p[n10]);
    }
  }
  AverageMetric(scene, &sheet);
  return sheet;
}

Sheet MakeFlatSheet(float width_m, float height_m, float cell_m) {
  Sheet sheet = MakeEmpty(Vec2f::Zero(), Vec2f(width_m, height_m), cell_m);
  for (int iy = 0; iy < sheet.ny; ++iy) {
    for (int ix = 0; ix < sheet.nx; ++ix) ClearOutside(&sheet, ix, iy);
  }
  return sheet;
}

}  // namespace fulcrum::thermal
