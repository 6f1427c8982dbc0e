#include "thermal_node/topology/centre_line.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace fulcrum::thermal {
namespace {

/// Neighbours in cyclic order, so that neighbours that touch each other have adjacent bits: E, SE, S, SW, W, NW, N, NE.
constexpr std::array<CellIndex, 8> kOffsets{{{1, 0}, {1, 1}, {0, 1}, {-1, 1}, {-1, 0}, {-1, -1}, {0, -1}, {1, -1}}};
/// Order of the sides from which cells are removed, as bits of the neighbour mask: N, S, E, W.
constexpr std::array<std::uint8_t, 4> kSides{1u << 6, 1u << 2, 1u << 0, 1u << 4};
/// Cells on a circle with a radius of three cells.
constexpr std::array<CellIndex, 16> kRing{{{3, 0},
                                           {3, 1},
                                           {2, 2},
                                           {1, 3},
                                           {0, 3},
                                           {-1, 3},
                                           {-2, 2},
                                           {-3, 1},
                                           {-3, 0},
                                           {-3, -1},
                                           {-2, -2},
                                           {-1, -3},
                                           {0, -3},
                                           {1, -3},
                                           {2, -2},
                                           {3, -1}}};
/// Slope of the distance transform above which a cell lies on a side of the hole: 1 there, 0.71 on the diagonal of a
/// right-angled corner, 0 on the ridge of a slit, the sine of half the angle in a tip.
constexpr float kRidgeSlope = 0.6f;

/// Table over the mask of neighbours: true if removing the cell changes neither the number of pieces nor of islands.
/// This holds if there is exactly one change from hole to tissue and back around the cell: Hilditch's crossing number
/// for an 8-connected object is 1.
constexpr std::array<bool, 256> MakeSimple() {
  std::array<bool, 256> simple{};
  for (unsigned mask = 0; mask < 256; ++mask) {
    int crossings = 0;
    for (unsigned k = 0; k < 8; k += 2) {
      const auto in = [&](unsigned n) { return (mask >> (n % 8) & 1u) != 0; };
      crossings += !in(k) && (in(k + 1) || in(k + 2)) ? 1 : 0;
    }
    simple[mask] = crossings == 1;
  }
  return simple;
}
constexpr std::array<bool, 256> kSimple = MakeSimple();

bool Before(CellIndex a, CellIndex b) { return a.iy != b.iy ? a.iy < b.iy : a.ix < b.ix; }

/// Reach of the distance transform [cells]: at least four, so that a slit of two cells has a ridge; at most 100,
/// because `run_` has eight bits.
int ReachOf(const Sheet& sheet) {
  return std::clamp(static_cast<int>(std::lround(kCentreReach_m / sheet.cell_m)), 4, 100);
}

constexpr std::uint8_t kHole = kRemoved | kQuarantined;

}  // namespace

bool IsHole(const HeatField& field, CellIndex cell) {
  if (!field.sheet().Contains(cell)) return false;
  const Tile* tile = field.Find(cell.ix / kTile, cell.iy / kTile);
  return tile != nullptr && (tile->state.flags[(cell.iy % kTile) * kTile + cell.ix % kTile] & kHole) != 0;
}

void CentreLine::Update(const HeatField& field, CellIndex low, CellIndex high) {
  reach_ = ReachOf(field.sheet());
  SetBoxes(low, high, reach_);
  Load(field);
  RowDistances(reach_);
  CollectObject();
  Thin();
  Merge();
}

void CentreLine::SetBoxes(CellIndex low, CellIndex high, int reach) {
  const auto grown = [&](int by) { return Box{{low.ix - by, low.iy - by}, {high.ix + by + 1, high.iy + by + 1}}; };
  inner_ = grown(reach);
  kept_ = grown(reach + reach / 2);
  margin_ = grown(2 * reach);
  loaded_ = grown(3 * reach);
  stride_ = loaded_.high.ix - loaded_.low.ix;
  for (std::size_t n = 0; n < offsets_.size(); ++n) offsets_[n] = kOffsets[n].iy * stride_ + kOffsets[n].ix;
  for (std::size_t n = 0; n < ring_.size(); ++n) ring_[n] = kRing[n].iy * stride_ + kRing[n].ix;
  const auto cells = static_cast<std::size_t>(stride_) * static_cast<std::size_t>(loaded_.high.iy - loaded_.low.iy);
  run_.assign(cells, 0);
  distance2_.assign(cells, 0);
  role_.assign(cells, kBackground);
  around_.resize(cells);
}

void CentreLine::Load(const HeatField& field) {
  const Sheet& sheet = field.sheet();
  const int x0 = std::max(loaded_.low.ix, 0), x1 = std::min(loaded_.high.ix, sheet.nx);
  const int y0 = std::max(loaded_.low.iy, 0), y1 = std::min(loaded_.high.iy, sheet.ny);
  if (x0 >= x1 || y0 >= y1) return;
  for (int ty = y0 / kTile; ty <= (y1 - 1) / kTile; ++ty) {
    for (int tx = x0 / kTile; tx <= (x1 - 1) / kTile; ++tx) {
      const Tile* tile = field.Find(tx, ty);
      if (tile == nullptr) continue;
      const int from = std::max(x0, tx * kTile), to = std::min(x1, (tx + 1) * kTile);
      for (int iy = std::max(y0, ty * kTile); iy < std::min(y1, (ty + 1) * kTile); ++iy) {
        const std::uint8_t* flags = &tile->state.flags[(iy - ty * kTile) * kTile + from - tx * kTile];
        std::uint8_t* row = &run_[static_cast<std::size_t>(At({from, iy}))];
        for (int i = 0; i < to - from; ++i) row[i] = (flags[i] & kHole) != 0 ? 1 : 0;
      }
    }
  }
}

void CentreLine::RowDistances(int reach) {
  const int rows = loaded_.high.iy - loaded_.low.iy;
  for (int j = 0; j < rows; ++j) {
    std::uint8_t* row = &run_[static_cast<std::size_t>(j) * static_cast<std::size_t>(stride_)];
    // Cells beyond the loaded box are farther than the reach from the margin and have no influence.
    int run = reach;
    for (int i = 0; i < stride_; ++i)
      row[i] = static_cast<std::uint8_t>(run = row[i] == 0 ? 0 : std::min(run + 1, reach));
    run = reach;
    for (int i = stride_ - 1; i >= 0; --i) {
      run = row[i] == 0 ? 0 : std::min(run + 1, reach);
      row[i] = static_cast<std::uint8_t>(std::min<int>(run, row[i]));
    }
  }
}

/// Exact squared distance transform from distances along rows, d^2(x, y) = min over j of run(x, y + j)^2 + j^2
/// (Saito and Toriwaki 1994). Slits are narrow, so the search ends after a few rows.
std::int32_t CentreLine::Distance2(int at) const {
  const auto run2 = [&](int where) {
    const std::int32_t run = run_[static_cast<std::size_t>(where)];
    return run * run;
  };
  std::int32_t best = run2(at);
  for (int j = 1; j * j < best; ++j) {
    best = std::min(best, j * j + std::min(run2(at - j * stride_), run2(at + j * stride_)));
  }
  return best;
}

void CentreLine::CollectObject() {
  object_.clear();
  for (int iy = margin_.low.iy; iy < margin_.high.iy; ++iy) {
    for (int ix = margin_.low.ix; ix < margin_.high.ix; ++ix) {
      const int at = At({ix, iy});
      const auto k = static_cast<std::size_t>(at);
      if (run_[k] == 0) continue;
      distance2_[k] = Distance2(at);
      role_[k] = inner_.Contains({ix, iy}) ? kMayEnd : kFree;
      object_.push_back(at);
    }
  }
  for (const LineCell& cell : cells_) {
    if (margin_.Contains(cell.at) && !inner_.Contains(cell.at)) role_[static_cast<std::size_t>(At(cell.at))] = kFixed;
  }
  for (const std::int32_t at : object_) {
    unsigned mask = 0;
    for (unsigned n = 0; n < 8; ++n) {
      mask |= role_[static_cast<std::size_t>(at + offsets_[n])] != kBackground ? 1u << n : 0u;
    }
    around_[static_cast<std::size_t>(at)] = static_cast<std::uint8_t>(mask);
  }
}

void CentreLine::Thin() {
  // Stable counting sort: cells of equal distance keep the order of rows.
  starts_.assign(static_cast<std::size_t>(reach_ * reach_) + 2, 0);
  for (const std::int32_t at : object_)
    ++starts_[static_cast<std::size_t>(distance2_[static_cast<std::size_t>(at)]) + 1];
  for (std::size_t d = 1; d < starts_.size(); ++d) starts_[d] += starts_[d - 1];
  order_.resize(object_.size());
  for (const std::int32_t at : object_) {
    order_[static_cast<std::size_t>(starts_[static_cast<std::size_t>(distance2_[static_cast<std::size_t>(at)])]++)] =
        at;
  }
  object_.clear();  // from here on: the remaining cells
  for (std::size_t begin = 0; begin < order_.size();) {
    const auto distance2 = [&](std::size_t n) { return distance2_[static_cast<std::size_t>(order_[n])]; };
    std::size_t end = begin + 1;
    while (end < order_.size() && distance2(end) == distance2(begin)) ++end;
    part_.assign(order_.begin() + static_cast<std::ptrdiff_t>(begin),
                 order_.begin() + static_cast<std::ptrdiff_t>(end));
    ThinPart(&part_);
    object_.insert(object_.end(), part_.begin(), part_.end());
    begin = end;
  }
  // A second pass over cells that were not removable when they were visited but may be by now.
  ThinPart(&object_);
}

/// Thins in subiterations, one per side (after Guo and Hall, CACM 32, 1989): the cells with tissue on that side are
/// collected before any of them is removed. Otherwise a plateau of the distance transform would be removed from one
/// end.
void CentreLine::ThinPart(std::vector<std::int32_t>* part) {
  for (bool changed = true; changed;) {
    changed = false;
    for (const std::uint8_t side : kSides) {
      going_.clear();
      for (const std::int32_t at : *part) {
        const auto k = static_cast<std::size_t>(at);
        if ((around_[k] & side) == 0 && role_[k] != kBackground && IsRemovable(at)) going_.push_back(at);
      }
      for (const std::int32_t at : going_) {
        if (!IsRemovable(at)) continue;
        Remove(at);
        changed = true;
      }
    }
    std::erase_if(*part, [&](std::int32_t at) { return role_[static_cast<std::size_t>(at)] == kBackground; });
  }
}

bool CentreLine::IsRemovable(std::int32_t at) const {
  const auto k = static_cast<std::size_t>(at);
  if (role_[k] == kFixed || !kSimple[around_[k]]) return false;
  return role_[k] != kMayEnd || std::popcount(around_[k]) > 1 || !OnRidge(at);
}

bool CentreLine::OnRidge(std::int32_t at) const {
  const float here = std::sqrt(static_cast<float>(distance2_[static_cast<std::size_t>(at)]));
  for (std::size_t n = 0; n < ring_.size(); ++n) {
    const auto there2 = static_cast<float>(distance2_[static_cast<std::size_t>(at + ring_[n])]);
    const float away = std::hypot(static_cast<float>(kRing[n].ix), static_cast<float>(kRing[n].iy));
    if (std::sqrt(there2) > here + kRidgeSlope * away) return false;
  }
  return true;
}

void CentreLine::Remove(std::int32_t at) {
  role_[static_cast<std::size_t>(at)] = kBackground;
  for (unsigned n = 0; n < 8; ++n) {
    std::uint8_t& mask = around_[static_cast<std::size_t>(at + offsets_[n])];
    mask = static_cast<std::uint8_t>(mask & ~(1u << ((n + 4) % 8)));
  }
}

/// Outside the inner box the old line is kept. Cells that join it to the new one lie close to that box; other cells at
/// the margin's border belong to a line beyond it and are dropped.
void CentreLine::Merge() {
  std::sort(object_.begin(), object_.end());  // the order of cells in the box is that of the sheet
  merged_.clear();
  const auto take = [&](std::int32_t at) { merged_.push_back({CellAt(at), distance2_[static_cast<std::size_t>(at)]}); };
  std::size_t next = 0;
  for (const LineCell& old : cells_) {
    if (inner_.Contains(old.at)) continue;
    for (; next < object_.size() && Before(CellAt(object_[next]), old.at); ++next) {
      if (kept_.Contains(CellAt(object_[next]))) take(object_[next]);
    }
    if (next < object_.size() && CellAt(object_[next]) == old.at) {
      take(object_[next++]);
    } else {
      merged_.push_back(old);
    }
  }
  for (; next < object_.size(); ++next) {
    if (kept_.Contains(CellAt(object_[next]))) take(object_[next]);
  }
  cells_.swap(merged_);
}

bool CentreLine::Restore(const HeatField& field, std::span<const CellIndex> cells) {
  cells_.clear();
  const int reach = ReachOf(field.sheet());
  for (std::size_t n = 0; n < cells.size(); ++n) {
    if (!IsHole(field, cells[n]) || (n > 0 && !Before(cells[n - 1], cells[n]))) {
      cells_.clear();
      return false;
    }
    // As in Distance2: in both directions along the row, row by row.
    const auto run = [&](int j) {
      int i = 0;
      const auto hole = [&](int di) { return IsHole(field, {cells[n].ix + di, cells[n].iy + j}); };
      while (i < reach && hole(i) && hole(-i)) ++i;
      return i;
    };
    std::int32_t best = run(0) * run(0);
    for (int j = 1; j * j < best; ++j) {
      for (const int side : {-j, j}) best = std::min(best, j * j + run(side) * run(side));
    }
    cells_.push_back({cells[n], best});
  }
  return true;
}

}  // namespace fulcrum::thermal
