#include "thermal_node/heat/sheet.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "services/base/core/error.h"
#include "services/base/core/sheets.h"
#include "thermal_node/heat/sheet_materials.h"

namespace fulcrum::thermal {
namespace {

/// Largest extent of a sheet [m]. The atlas at 0.1 mm per texel is 0.41 m; twice that indicates a wrong unit.
constexpr float kMaxExtent_m = 0.85f;

Sheet MakeEmpty(const Vec2f& low, const Vec2f& high, float cell) {
  Sheet sheet;
  sheet.cell_m = cell;
  // The tolerance prevents an extra row of cells where a border lies on a cell face except for rounding.
  sheet.origin_x = static_cast<std::int32_t>(std::floor(low.x() / cell + 1e-3f));
  sheet.origin_y = static_cast<std::int32_t>(std::floor(low.y() / cell + 1e-3f));
  sheet.nx = static_cast<int>(std::ceil(high.x() / cell - 1e-3f)) - sheet.origin_x;
  sheet.ny = static_cast<int>(std::ceil(high.y() / cell - 1e-3f)) - sheet.origin_y;
  sheet.tiles_x = (sheet.nx + kTile - 1) / kTile;
  sheet.tiles_y = (sheet.ny + kTile - 1) / kTile;
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

/// Limits the stretches, which are the roots of the eigenvalues of g.
SurfaceMetric Bounded(const SurfaceMetric& g) {
  const float mean = 0.5f * (g.ss + g.tt), half = 0.5f * (g.ss - g.tt);
  const float radius = std::sqrt(half * half + g.st * g.st);
  if (!std::isfinite(mean + radius)) return {};
  constexpr float kLow = kStretchMin * kStretchMin, kHigh = kStretchMax * kStretchMax;
  const float large = std::clamp(mean + radius, kLow, kHigh), small = std::clamp(mean - radius, kLow, kHigh);
  const float shrink = radius > 0 ? 0.5f * (large - small) / radius : 0.0f;
  return {0.5f * (large + small) + shrink * half, shrink * g.st, 0.5f * (large + small) - shrink * half};
}

/// g of each node of the grid: the mean of the quads around it.
std::vector<SurfaceMetric> NodeMetric(const SheetScene& scene) {
  const MembraneGrid& grid = scene.membrane;
  std::vector<SurfaceMetric> sum(grid.node_count(), SurfaceMetric{0, 0, 0});
  std::vector<int> count(grid.node_count(), 0);
  for (Index r = 0; r + 1 < grid.rows; ++r) {
    for (Index c = 0; c + 1 < grid.cols; ++c) {
      if (!HasCell(scene, r, c)) continue;
      const Index n00 = r * grid.cols + c, n01 = n00 + 1, n10 = n00 + grid.cols, n11 = n10 + 1;
      // Means of opposite sides, in material space and on the rest shape: J maps the former to the latter.
      const auto sides = [&]<class V>(const V* at) {
        return std::pair<V, V>{0.5f * ((at[n01] - at[n00]) + (at[n11] - at[n10])),
                               0.5f * ((at[n10] - at[n00]) + (at[n11] - at[n01]))};
      };
      const auto [u, v] = sides(scene.membrane_material.data());
      const auto [ru, rv] = sides(scene.rest_position.data() + grid.first);
      const float det = Cross(u, v);
      if (!(std::abs(det) > 0.0f)) continue;
      const Vec3f js = (ru * v.y() - rv * u.y()) / det, jt = (rv * u.x() - ru * v.x()) / det;
      const SurfaceMetric g = Bounded({js.squaredNorm(), js.dot(jt), jt.squaredNorm()});
      for (const Index n : {n00, n01, n10, n11}) {
        sum[n] = {sum[n].ss + g.ss, sum[n].st + g.st, sum[n].tt + g.tt};
        ++count[n];
      }
    }
  }
  for (std::size_t n = 0; n < sum.size(); ++n) {
    const float f = 1.0f / static_cast<float>(std::max(count[n], 1));
    sum[n] = count[n] > 0 ? SurfaceMetric{f * sum[n].ss, f * sum[n].st, f * sum[n].tt} : SurfaceMetric{};
  }
  return sum;
}

void MakeLattice(Sheet* sheet) {
  sheet->metric_x = sheet->tiles_x * kTile / kMetricStep + 1;
  sheet->metric_y = sheet->tiles_y * kTile / kMetricStep + 1;
  sheet->metric.assign(static_cast<std::size_t>(sheet->metric_x) * sheet->metric_y, SurfaceMetric{});
}

/// Gives lattice points without tissue the metric of their nearest neighbours.
void Spread(const Sheet& sheet, std::vector<std::uint8_t>* known, std::vector<SurfaceMetric>* metric) {
  const int nx = sheet.metric_x, ny = sheet.metric_y;
  for (bool more = true; more;) {
    more = false;
    const std::vector<std::uint8_t> before = *known;
    for (int k = 0; k < nx * ny; ++k) {
      if (before[k] != 0) continue;
      SurfaceMetric sum{0, 0, 0};
      float count = 0;
      const auto add = [&](bool inside, int n) {
        if (!inside || before[n] == 0) return;
        const SurfaceMetric& g = (*metric)[n];
        sum = {sum.ss + g.ss, sum.st + g.st, sum.tt + g.tt};
        ++count;
      };
      add(k % nx > 0, k - 1);
      add(k % nx + 1 < nx, k + 1);
      add(k >= nx, k - nx);
      add(k + nx < nx * ny, k + nx);
      if (count == 0) continue;
      (*metric)[k] = {sum.ss / count, sum.st / count, sum.tt / count};
      (*known)[k] = 1;
      more = true;
    }
  }
}

/// Calls visit(index, weights of the corners) for the points of the lattice in a triangle of material coordinates [m].
template <class Visit>
void ForLatticeIn(const Sheet& sheet, const std::array<Vec2f, 3>& corners, const Visit& visit) {
  const Vec2f origin(static_cast<float>(sheet.origin_x), static_cast<float>(sheet.origin_y));
  const auto place = [&](const Vec2f& p) -> Vec2f {
    return (p / sheet.cell_m - origin) / static_cast<float>(kMetricStep);
  };
  const Vec2f a = place(corners[0]), b = place(corners[1]), c = place(corners[2]);
  const float area = Cross(b - a, c - a);
  if (area == 0.0f) return;
  const Vec2f low = a.cwiseMin(b).cwiseMin(c), high = a.cwiseMax(b).cwiseMax(c);
  for (int y = std::max(0, static_cast<int>(std::ceil(low.y()))); y <= high.y() && y < sheet.metric_y; ++y) {
    for (int x = std::max(0, static_cast<int>(std::ceil(low.x()))); x <= high.x() && x < sheet.metric_x; ++x) {
      const Vec2f p(static_cast<float>(x), static_cast<float>(y));
      const float wb = Cross(p - a, c - a) / area, wc = Cross(b - a, p - a) / area, wa = 1 - wb - wc;
      if (std::min({wa, wb, wc}) < -1e-4f) continue;
      visit(static_cast<std::size_t>(y) * sheet.metric_x + x, wa, wb, wc);
    }
  }
}

/// Samples the metric of the mesh at the points of the lattice, linear within each triangle.
void MeasureMetric(const SheetScene& scene, Sheet* sheet) {
  const MembraneGrid& grid = scene.membrane;
  const std::vector<SurfaceMetric> at_node = NodeMetric(scene);
  MakeLattice(sheet);
  std::vector<std::uint8_t> known(sheet->metric.size(), 0);
  const auto triangle = [&](Index na, Index nb, Index nc) {
    const std::array corners{scene.membrane_material[na], scene.membrane_material[nb], scene.membrane_material[nc]};
    ForLatticeIn(*sheet, corners, [&](std::size_t k, float wa, float wb, float wc) {
      const SurfaceMetric &ga = at_node[na], &gb = at_node[nb], &gc = at_node[nc];
      sheet->metric[k] = Bounded({wa * ga.ss + wb * gb.ss + wc * gc.ss, wa * ga.st + wb * gb.st + wc * gc.st,
                                  wa * ga.tt + wb * gb.tt + wc * gc.tt});
      known[k] = 1;
    });
  };
  for (Index r = 0; r + 1 < grid.rows; ++r) {
    for (Index c = 0; c + 1 < grid.cols; ++c) {
      if (!HasCell(scene, r, c)) continue;
      const Index n00 = r * grid.cols + c, n01 = n00 + 1, n10 = n00 + grid.cols, n11 = n10 + 1;
      triangle(n00, n01, n11);
      triangle(n00, n11, n10);
    }
  }
  Spread(*sheet, &known, &sheet->metric);
}

}  // namespace

const Band* Sheet::BandOf(int material) const {
  const auto found = std::find_if(bands.begin(), bands.end(), [=](const Band& b) { return b.material == material; });
  return found != bands.end() ? &*found : nullptr;
}

CellIndex Sheet::CellOf(const Vec2f& material) const {
  return {static_cast<std::int32_t>(std::floor(material.x() / cell_m)) - origin_x,
          static_cast<std::int32_t>(std::floor(material.y() / cell_m)) - origin_y};
}

Vec2f Sheet::CentreOf(CellIndex cell) const {
  return Vec2f(static_cast<float>(cell.ix + origin_x) + 0.5f, static_cast<float>(cell.iy + origin_y) + 0.5f) * cell_m;
}

SurfaceMetric Sheet::MetricAt(float x, float y) const {
  if (metric.empty()) return {};
  const float u = std::clamp(x / kMetricStep, 0.0f, static_cast<float>(metric_x - 1));
  const float v = std::clamp(y / kMetricStep, 0.0f, static_cast<float>(metric_y - 1));
  const int i = std::min(static_cast<int>(u), metric_x - 2), j = std::min(static_cast<int>(v), metric_y - 2);
  const float f = u - static_cast<float>(i), h = v - static_cast<float>(j);
  const SurfaceMetric* row = &metric[static_cast<std::size_t>(j) * metric_x + i];
  const SurfaceMetric &a = row[0], &b = row[1], &c = row[metric_x], &d = row[metric_x + 1];
  const auto mix = [&](float pa, float pb, float pc, float pd) {
    return (1 - h) * (pa + f * (pb - pa)) + h * (pc + f * (pd - pc));
  };
  return {mix(a.ss, b.ss, c.ss, d.ss), mix(a.st, b.st, c.st, d.st), mix(a.tt, b.tt, c.tt, d.tt)};
}

void SetMetric(Sheet* sheet, const std::function<SurfaceMetric(const Vec2f&)>& metric_at) {
  MakeLattice(sheet);
  for (int y = 0; y < sheet->metric_y; ++y) {
    for (int x = 0; x < sheet->metric_x; ++x) {
      const Vec2f p(static_cast<float>(x * kMetricStep + sheet->origin_x),
                    static_cast<float>(y * kMetricStep + sheet->origin_y));
      sheet->metric[static_cast<std::size_t>(y) * sheet->metric_x + x] = Bounded(metric_at(p * sheet->cell_m));
    }
  }
}

bool Sheet::OnSheet(const Vec2f& material) const {
  if (!material.allFinite() || material.cwiseAbs().maxCoeff() > 2 * kMaxExtent_m) return false;
  const CellIndex cell = CellOf(material);
  return Contains(cell) && !IsOutside(cell.ix, cell.iy);
}

Sheet MakeSheet(const SheetScene& scene) {
  const MembraneGrid& grid = scene.membrane;
  if (grid.rows == 0 && grid.cols == 0) return MakeEmpty(Vec2f::Zero(), Vec2f::Zero(), scene.thermal.cell_m);
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
      if (!HasCell(scene, r, c)) continue;
      const Index n00 = r * grid.cols + c, n01 = n00 + 1, n10 = n00 + grid.cols, n11 = n10 + 1;
      FillTriangle(&sheet, p[n00], p[n01], p[n11]);
      FillTriangle(&sheet, p[n00], p[n11], p[n10]);
    }
  }
  MeasureMetric(scene, &sheet);
  AddMaterials(scene, &sheet);
  return sheet;
}

/// A chart is a projection along its normal m. On a plane with the unit normal n a step along s climbs by
/// -(n . s) / (n . m).
Sheet MakeSolidSheet(const TissueScene& scene, const SolidCharts& charts) {
  Sheet sheet = MakeEmpty(Vec2f::Zero(),
                          kSolidCell_m * Vec2f(static_cast<float>(charts.width), static_cast<float>(charts.height)),
                          kSolidCell_m);
  MakeLattice(&sheet);
  std::vector<std::uint8_t> known(sheet.metric.size(), 0);
  for (Index t = 0; t < scene.tube_surface.size(); ++t) {
    if (charts.of_triangle[t] == kNoIndex) continue;
    const SolidChart& chart = charts.charts[charts.of_triangle[t]];
    std::array<Vec3f, 3> x;
    std::array<Vec2f, 3> material;
    for (std::size_t k = 0; k < 3; ++k) {
      x[k] = scene.rest_position[scene.tube_surface[t][k]];
      material[k] = chart.Material(x[k]);
    }
    FillTriangle(&sheet, material[0], material[1], material[2]);
    const Vec3f normal = (x[1] - x[0]).cross(x[2] - x[0]).stableNormalized();
    const float up = std::max(normal.dot(chart.normal()), 0.1f);
    const float p = normal.dot(chart.s_axis) / up, q = normal.dot(chart.t_axis) / up;
    const SurfaceMetric metric = Bounded({1 + p * p, p * q, 1 + q * q});
    ForLatticeIn(sheet, material, [&](std::size_t k, float, float, float) {
      sheet.metric[k] = metric;
      known[k] = 1;
    });
  }
  if (std::find(known.begin(), known.end(), 1) != known.end()) Spread(sheet, &known, &sheet.metric);
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
