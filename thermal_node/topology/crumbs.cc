#include "thermal_node/topology/crumbs.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace fulcrum::thermal {
namespace {

constexpr std::array<CellIndex, 4> kFaces{{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}};

std::size_t At(const Sheet& sheet, CellIndex cell) {
  return static_cast<std::size_t>(cell.iy) * static_cast<std::size_t>(sheet.nx) + static_cast<std::size_t>(cell.ix);
}

}  // namespace

bool Crumbs::IsTissue(const HeatField& field, CellIndex cell) const {
  const Sheet& sheet = field.sheet();
  if (!sheet.Contains(cell)) return false;
  const Tile* tile = field.Find(cell.ix / kTile, cell.iy / kTile);
  if (tile == nullptr) return !sheet.IsOutside(cell.ix, cell.iy);
  return (tile->state.flags[(cell.iy % kTile) * kTile + cell.ix % kTile] & kNoTissue) == 0;
}

bool Crumbs::Collect(const HeatField& field, CellIndex start, std::size_t most) {
  const Sheet& sheet = field.sheet();
  piece_.assign(1, start);
  mark_[At(sheet, start)] = kSeen;
  bool crumb = true;
  for (std::size_t next = 0; next < piece_.size() && crumb; ++next) {
    for (const CellIndex& offset : kFaces) {
      const CellIndex cell{piece_[next].ix + offset.ix, piece_[next].iy + offset.iy};
      if (!IsTissue(field, cell)) continue;
      std::uint8_t& mark = mark_[At(sheet, cell)];
      crumb = crumb && mark != kSheet;
      if (mark != kUnseen) continue;
      mark = kSeen;
      piece_.push_back(cell);
    }
    crumb = crumb && piece_.size() <= most;
  }
  for (const CellIndex& cell : piece_) mark_[At(sheet, cell)] = kSheet;
  marked_.insert(marked_.end(), piece_.begin(), piece_.end());
  return crumb;
}

RemovedBox Crumbs::TakeOut(HeatField* field, const RemovedBox& changed, Ledger* ledger) {
  RemovedBox removed;
  if (changed.empty()) return removed;
  const Sheet& sheet = field->sheet();
  mark_.resize(static_cast<std::size_t>(sheet.nx) * static_cast<std::size_t>(sheet.ny), kUnseen);
  const auto most = static_cast<std::size_t>(kCrumb_m2 / (sheet.cell_m * sheet.cell_m));
  for (int iy = changed.low.iy - 1; iy <= changed.high.iy + 1; ++iy) {
    for (int ix = changed.low.ix - 1; ix <= changed.high.ix + 1; ++ix) {
      const CellIndex start{ix, iy};
      if (!IsTissue(*field, start) || mark_[At(sheet, start)] != kUnseen) continue;
      const bool at_border = std::any_of(kFaces.begin(), kFaces.end(), [&](const CellIndex& offset) {
        return !IsTissue(*field, {ix + offset.ix, iy + offset.iy});
      });
      if (!at_border || !Collect(*field, start, most)) continue;
      for (const CellIndex& cell : piece_) {
        Tile* tile = field->Wake(cell.ix / kTile, cell.iy / kTile);
        const int k = (cell.iy % kTile) * kTile + cell.ix % kTile;
        area_m2_ += static_cast<double>(tile->flat_volume * tile->geometry.area[k] / tile->material->thickness_m);
        field->TakeOut(tile, k, kRemoved, &ledger->debris);
        removed.Add(cell);
      }
    }
  }
  for (const CellIndex& cell : marked_) mark_[At(sheet, cell)] = kUnseen;
  marked_.clear();
  if (removed.empty()) return removed;
  for (int ty = removed.low.iy / kTile; ty <= removed.high.iy / kTile; ++ty) {
    for (int tx = removed.low.ix / kTile; tx <= removed.high.ix / kTile; ++tx) {
      if (Tile* tile = field->Find(tx, ty); tile != nullptr && tile->state.awake != 0)
        field->RefreshTheta(tile, ledger);
    }
  }
  return removed;
}

}  // namespace fulcrum::thermal
