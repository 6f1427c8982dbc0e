#include "thermal_node/coupling/cut_meter.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace fulcrum::thermal {

void CutMeter::Update(HeatField* field, CellIndex low, CellIndex high) {
  for (int iy = low.iy; iy <= high.iy; ++iy) {
    for (int ix = low.ix; ix <= high.ix; ++ix) {
      const CellIndex cell{ix, iy};
      Tile* tile = field->sheet().Contains(cell) ? field->Find(ix / kTile, iy / kTile) : nullptr;
      if (tile == nullptr) continue;
      std::uint8_t& flags = tile->state.flags[(iy % kTile) * kTile + ix % kTile];
      if ((flags & (kRemoved | kCounted)) != kRemoved) continue;
      flags = static_cast<std::uint8_t>(flags | kCounted);
      Add(field->sheet().CentreOf(cell));
    }
  }
}

void CutMeter::Add(const Vec2f& place) {
  float nearest_sq = std::numeric_limits<float>::max();
  for (const Mark& mark : marks_) nearest_sq = std::min(nearest_sq, (Vec2f(mark[0], mark[1]) - place).squaredNorm());
  if (nearest_sq <= kMarkSpacing * kMarkSpacing) return;
  marks_.push_back({place.x(), place.y()});
  // Farther off than two spacings it belongs to another slit, which begins here.
  if (nearest_sq <= 4.0f * kMarkSpacing * kMarkSpacing) length_m_ += std::sqrt(static_cast<double>(nearest_sq));
}

void CutMeter::Restore(double length_m, std::vector<Mark> marks) {
  length_m_ = length_m;
  marks_ = std::move(marks);
}

}  // namespace fulcrum::thermal
