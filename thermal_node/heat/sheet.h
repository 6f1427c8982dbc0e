// The membrane as cells in material space: where its tiles lie, which cells carry tissue, and how long a cell is on
// the rest shape.
#pragma once

#include <cstdint>
#include <vector>

#include "services/core/scene_view.h"

namespace fulcrum::thermal {

inline constexpr int kTile = 32;  ///< Cells along the edge of a tile.
inline constexpr int kTileCells = kTile * kTile;

/// Cell of the sheet: ix along s, iy along t, from the sheet's origin.
struct CellIndex {
  std::int32_t ix = 0, iy = 0;
  bool operator==(const CellIndex&) const = default;
};

/// Rest length of a cell along s and t, relative to its length in material space. The map from the rest shape to the
/// sheet is taken as orthogonal: cross terms are below 1 % for the regular grids that the scene compiler makes.
struct CellMetric {
  float s = 1, t = 1;
};
inline constexpr float kMetricMin = 0.5f, kMetricMax = 2.0f;  ///< Keeps the explicit step bounded on bad maps.

struct Sheet {
  float cell_m = 1e-4f;
  std::int32_t origin_x = 0, origin_y = 0;  ///< Global index floor(s / cell_m) of cell (0, 0).
  int nx = 0, ny = 0;                       ///< Cells.
  int tiles_x = 0, tiles_y = 0;
  std::vector<CellMetric> metric;     ///< Per tile.
  std::vector<std::uint8_t> outside;  ///< Bit field over tiles_x*kTile by tiles_y*kTile: no tissue there.

  [[nodiscard]] int tile_count() const { return tiles_x * tiles_y; }
  [[nodiscard]] bool Contains(CellIndex c) const { return c.ix >= 0 && c.iy >= 0 && c.ix < nx && c.iy < ny; }
  [[nodiscard]] bool IsOutside(int ix, int iy) const {
    return TestBit(outside, static_cast<std::size_t>(iy) * tiles_x * kTile + ix);
  }
  [[nodiscard]] CellIndex CellOf(const Vec2f& material) const;
  [[nodiscard]] Vec2f CentreOf(CellIndex cell) const;
  /// True when the point lies on tissue.
  [[nodiscard]] bool OnSheet(const Vec2f& material) const;
};

/// Throws InputError when the scene has no membrane, or its material coordinates are not finite or are larger than the
/// atlas.
[[nodiscard]] Sheet MakeSheet(const SceneView& scene);
/// A flat rectangle with its corner at (0, 0) [m].
[[nodiscard]] Sheet MakeFlatSheet(float width_m, float height_m, float cell_m);

}  // namespace fulcrum::thermal
