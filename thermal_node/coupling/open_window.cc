#include "thermal_node/coupling/open_window.h"

#include <algorithm>

namespace fulcrum::thermal {

void FillOpenCells(const HeatField& field, const Vec2f& material, OpenCells* cells) {
  const Sheet& sheet = field.sheet();
  const CellIndex centre = sheet.CellOf(material);
  const auto first = [](int cell) { return (cell - kOpenWindow / 2) / kWindowStep * kWindowStep; };
  const int x0 = first(centre.ix), y0 = first(centre.iy);
  cells->x = x0 + sheet.origin_x;
  cells->y = y0 + sheet.origin_y;
  cells->rows.fill(0);
  const int x1 = std::min(x0 + kOpenWindow, sheet.nx), y1 = std::min(y0 + kOpenWindow, sheet.ny);
  for (int ty = std::max(y0, 0) / kTile; ty * kTile < y1; ++ty) {
    for (int tx = std::max(x0, 0) / kTile; tx * kTile < x1; ++tx) {
      const Tile* tile = field.Find(tx, ty);
      if (tile == nullptr) continue;
      for (int iy = std::max(y0, ty * kTile); iy < std::min(y1, (ty + 1) * kTile); ++iy) {
        for (int ix = std::max(x0, tx * kTile); ix < std::min(x1, (tx + 1) * kTile); ++ix) {
          const int k = (iy - ty * kTile) * kTile + ix - tx * kTile;
          const std::uint64_t removed = (tile->state.flags[k] & kRemoved) != 0 ? 1 : 0;
          cells->rows[static_cast<std::size_t>(iy - y0)] |= removed << static_cast<unsigned>(ix - x0);
        }
      }
    }
  }
}

}  // namespace fulcrum::thermal
