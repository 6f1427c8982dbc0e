// A surface as cells in material space: place of its tiles, cells that are tissue, and rest lengths of the cells. The
// membrane is one, the charts of the solids are another.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <vector>

#include "services/base/core/scene_view.h"
#include "services/base/core/solid_charts.h"

namespace fulcrum::thermal {

inline constexpr int kTile = 32;  ///< Cells along the edge of a tile.
inline constexpr int kTileCells = kTile * kTile;

/// Cell of the sheet: ix along s, iy along t, from the sheet's origin.
struct CellIndex {
  std::int32_t ix = 0, iy = 0;
  bool operator==(const CellIndex&) const = default;
};

/// First fundamental form of the rest shape over material space, g = J^T J with J = d rest / d (s, t): squared stretch
/// along s and t, and their scalar product (shear).
struct SurfaceMetric {
  float ss = 1, st = 0, tt = 1;

  [[nodiscard]] float area() const { return std::sqrt(ss * tt - st * st); }  ///< Rest area over material area.
  /// Rest length of a vector (s, t) of material space.
  [[nodiscard]] float Length(float s, float t) const { return std::sqrt((ss * s + 2.0f * st * t) * s + tt * t * t); }
};
/// Limits of the stretch; they bound the rate of the explicit step on degenerate maps.
inline constexpr float kStretchMin = 0.5f, kStretchMax = 2.0f;
inline constexpr int kMetricStep = 8;  ///< Spacing of the stored metric [cells].

/// A sheet that is spanned freely from its first to its last row, as a rectangle in material space. What it spans holds
/// both of these ends at 0 V; its sides are free.
struct Band {
  int material = 0;                  ///< Its number.
  Vec2f low = Vec2f::Zero();         ///< Corner (s, t) [m].
  Vec2f size = Vec2f::Zero();        ///< Width along s, length along t [m].
  std::vector<CellIndex> ends = {};  ///< Cells of tissue along both ends, ordered.
};

struct Sheet {
  float cell_m = 1e-4f;
  std::int32_t origin_x = 0, origin_y = 0;  ///< Global index floor(s / cell_m) of cell (0, 0).
  int nx = 0, ny = 0;                       ///< Cells.
  int tiles_x = 0, tiles_y = 0;
  /// Metric at the corners of blocks of kMetricStep cells, metric_x to a row; interpolated bilinearly. Empty:
  /// isometric.
  std::vector<SurfaceMetric> metric;
  int metric_x = 0, metric_y = 0;
  std::vector<std::uint8_t> outside;  ///< Bit field over tiles_x*kTile by tiles_y*kTile: no tissue there.
  int materials = 1;                  ///< Number of materials.
  /// By tile the number of its material, that of the nearest tissue; empty: 0 everywhere. Neither heat nor current
  /// passes between tiles of different materials.
  std::vector<std::uint8_t> material_of_tile;
  std::vector<Band> bands;

  [[nodiscard]] int tile_count() const { return tiles_x * tiles_y; }
  [[nodiscard]] bool Contains(CellIndex c) const { return c.ix >= 0 && c.iy >= 0 && c.ix < nx && c.iy < ny; }
  [[nodiscard]] bool IsOutside(int ix, int iy) const {
    return TestBit(outside, static_cast<std::size_t>(iy) * tiles_x * kTile + ix);
  }
  /// Number of a tile's material; beyond the sheet 0.
  [[nodiscard]] int MaterialOf(int tx, int ty) const {
    const bool beyond = tx < 0 || ty < 0 || tx >= tiles_x || ty >= tiles_y;
    return beyond || material_of_tile.empty() ? 0 : material_of_tile[static_cast<std::size_t>(ty) * tiles_x + tx];
  }
  /// Of the tile around a cell; beyond the sheet that of its border.
  [[nodiscard]] int MaterialAt(CellIndex c) const {
    return MaterialOf(std::clamp(c.ix / kTile, 0, std::max(tiles_x - 1, 0)),
                      std::clamp(c.iy / kTile, 0, std::max(tiles_y - 1, 0)));
  }
  /// The band of a material; nullptr: it is none.
  [[nodiscard]] const Band* BandOf(int material) const;
  [[nodiscard]] CellIndex CellOf(const Vec2f& material) const;
  [[nodiscard]] Vec2f CentreOf(CellIndex cell) const;
  /// Metric at a place, in cells from the sheet's origin; beyond the border that of the border.
  [[nodiscard]] SurfaceMetric MetricAt(float x, float y) const;
  /// True when the point lies on tissue.
  [[nodiscard]] bool OnSheet(const Vec2f& material) const;
};

/// Without cells for a scene without a membrane. Throws InputError when the grid is no grid, when its material
/// coordinates are not finite or are larger than the atlas, or when a tile holds sheets of different materials.
[[nodiscard]] Sheet MakeSheet(const SheetScene& scene);
/// The charts of the solids, with cells of kSolidCell_m.
[[nodiscard]] Sheet MakeSolidSheet(const TissueScene& scene, const SolidCharts& charts);
/// A flat rectangle with its corner at (0, 0) [m].
[[nodiscard]] Sheet MakeFlatSheet(float width_m, float height_m, float cell_m);
/// Sets the metric from a function of material coordinates [m]. A metric that is not finite becomes isometric;
/// stretches are limited to [kStretchMin, kStretchMax].
void SetMetric(Sheet* sheet, const std::function<SurfaceMetric(const Vec2f&)>& metric_at);

}  // namespace fulcrum::thermal
