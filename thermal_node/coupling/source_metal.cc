// Gaps between the metal of a path and the cells of the source window.
#include <algorithm>
#include <array>
#include <cmath>

#include "thermal_node/coupling/source_window.h"

namespace fulcrum::thermal {
namespace {

/// Footprints whose centres lie farther apart than this are shifted onto one another before they are interpolated
/// [cells]. Otherwise metal that moves by more than the range of its film between two samples would leave out the cells
/// between.
constexpr float kFarApart = 2.0f;

/// Decodes the gaps of the cells (x, y) to (x + count - 1, y) [m].
void DecodeRow(const Footprint& print, std::int32_t x, std::int32_t y, std::int32_t count, float* __restrict row) {
  std::fill_n(row, count, Footprint::Decode(kBeyond));
  const std::int32_t j = y - print.y, width = static_cast<std::int32_t>(print.width);
  if (j < 0 || j >= static_cast<std::int32_t>(print.height())) return;
  const std::int32_t first = std::max(x, print.x), last = std::min(x + count, print.x + width);
  if (first >= last) return;
  const std::uint8_t* __restrict gap = &print.gap[static_cast<std::size_t>(j * width + first - print.x)];
  float* __restrict out = row + (first - x);
  for (std::int32_t n = 0; n < last - first; ++n) out[n] = Footprint::Decode(gap[n]);
}

}  // namespace

TipPath PartOf(const TipPath& path, float a, float b) {
  TipPath part = path;
  part.from = path.from + a * (path.to - path.from);
  part.to = path.from + b * (path.to - path.from);
  part.part_from = path.part_from + a * (path.part_to - path.part_from);
  part.part_to = path.part_from + b * (path.part_to - path.part_from);
  return part;
}

void SourceWindow::AddGap(int i, int j, float gap) {
  gap_[j * kWindow + i] = gap;
  gap_low_ = {std::min(gap_low_.ix, i), std::min(gap_low_.iy, j)};
  gap_high_ = {std::max(gap_high_.ix, i), std::max(gap_high_.iy, j)};
}

/// Interpolates each cell's gap linearly between the two samples.
void SourceWindow::AddFootprint(const TipPath& path, float at, float reach) {
  const float u = path.part_from + at * (path.part_to - path.part_from), per_cell = 1.0f / material_->cell_m;
  const Vec2f shift = path.displacement * per_cell;
  const auto cells = [](const Vec2f& v) {
    return CellIndex{static_cast<std::int32_t>(std::lround(v.x())), static_cast<std::int32_t>(std::lround(v.y()))};
  };
  const bool far = shift.norm() > kFarApart;
  // The gap at x is read at x - u shift in the first footprint and at x + (1 - u) shift in the last one.
  const CellIndex back = far ? cells(u * shift) : CellIndex{}, ahead = far ? cells((1 - u) * shift) : CellIndex{};
  const Footprint &a = path.begin, &b = path.end;
  const std::int32_t y0 = std::min(a.y + back.iy, b.y - ahead.iy);
  const std::int32_t y1 = std::max(a.y + static_cast<std::int32_t>(a.height()) + back.iy,
                                   b.y + static_cast<std::int32_t>(b.height()) - ahead.iy);
  const std::int32_t left = corner_.ix + sheet_.origin_x, top = corner_.iy + sheet_.origin_y;
  constexpr auto kMargin = static_cast<int>(0.5f * kWindow - kMetalReach);
  const auto fits = [](int n) { return n >= kMargin && n < kWindow - kMargin; };
  // Columns of the window that either footprint covers. Cells beyond both have no metal near them, unless the cells are
  // so large that even the largest gap that a footprint tells is within reach.
  std::int32_t i0 = 0, i1 = kWindow;
  if (Footprint::Decode(kBeyond) * per_cell > 1.01f * reach) {
    i0 = std::max(i0, std::min(a.x + back.ix, b.x - ahead.ix) - left);
    i1 = std::min(i1, std::max(a.x + static_cast<std::int32_t>(a.width) + back.ix,
                               b.x + static_cast<std::int32_t>(b.width) - ahead.ix) -
                          left);
  }
  if (i0 >= i1) return;
  std::array<float, kWindow> first, last;
  for (std::int32_t y = std::max(y0, top); y < std::min(y1, top + kWindow); ++y) {
    DecodeRow(a, left + i0 - back.ix, y - back.iy, i1 - i0, first.data());
    DecodeRow(b, left + i0 + ahead.ix, y + ahead.iy, i1 - i0, last.data());
    for (std::size_t n = 0; n < static_cast<std::size_t>(i1 - i0); ++n) {
      first[n] = ((1 - u) * first[n] + u * last[n]) * per_cell;
    }
    const int j = y - top;
    for (int i = i0; i < i1; ++i) {
      const float gap = first[static_cast<std::size_t>(i - i0)];
      if (!(gap < reach)) continue;
      if (fits(i) && fits(j)) {
        AddGap(i, j, gap);
      } else {
        stats_.shortened = stats_.shortened || gap < 0.0f;
      }
    }
  }
}

void SourceWindow::AddCapsule(const TipPath& path, float at, float reach) {
  const float per_cell = 1.0f / material_->cell_m, radius = path.radius_m * per_cell;
  const Vec2f origin(static_cast<float>(corner_.ix + sheet_.origin_x),
                     static_cast<float>(corner_.iy + sheet_.origin_y));
  const Vec2f middle = (path.from + at * (path.to - path.from)) * per_cell - origin;
  Vec2f half = path.half * per_cell;
  for (int axis = 0; axis < 2; ++axis) {
    const float most = std::max(kMetalReach - radius - std::abs(middle[axis] - 0.5f * kWindow), 0.0f);
    if (const float longest = std::abs(half[axis]); longest > most) {
      half *= most / longest;
      stats_.shortened = true;
    }
  }
  const Electrode electrode(metric_, middle - half, middle + half, radius);
  const Vec2f low = electrode.low(reach), high = electrode.high(reach);
  const int i1 = std::min(kWindow - 1, static_cast<int>(high.x())),
            j1 = std::min(kWindow - 1, static_cast<int>(high.y()));
  for (int j = std::max(0, static_cast<int>(low.y())); j <= j1; ++j) {
    for (int i = std::max(0, static_cast<int>(low.x())); i <= i1; ++i) {
      AddGap(i, j, electrode.Gap({static_cast<float>(i) + 0.5f, static_cast<float>(j) + 0.5f}));
    }
  }
}

void SourceWindow::SetGaps(const TipPath& path, float at, float reach_m) {
  for (int j = gap_low_.iy; j <= gap_high_.iy; ++j) {
    std::fill(&gap_[j * kWindow + gap_low_.ix], &gap_[j * kWindow + gap_high_.ix] + 1, kFarGap);
  }
  gap_low_ = {kWindow, kWindow};
  gap_high_ = {-1, -1};
  const float reach = reach_m / material_->cell_m;
  path.end.width > 0 ? AddFootprint(path, at, reach + 1.0f) : AddCapsule(path, at, reach);
}

}  // namespace fulcrum::thermal
