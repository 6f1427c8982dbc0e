// Where the metal of a path lies on the cells of the source window.
#include <algorithm>
#include <cmath>

#include "thermal_node/coupling/source_window.h"

namespace fulcrum::thermal {
namespace {

/// Pieces of metal whose ends lie farther apart on the sheet lie on two folds of it [m].
constexpr float kLongestPiece_m = 0.002f;
/// A piece that goes no farther than this along an axis is as good as parallel to the other [cells].
constexpr float kShortWay = 1e-4f;

}  // namespace

TipPath PartOf(const TipPath& path, float a, float b) {
  TipPath part = path;
  part.from = path.from + a * (path.to - path.from);
  part.to = path.from + b * (path.to - path.from);
  if (path.begin.count != path.end.count) return part;
  for (std::uint32_t n = 0; n < path.end.count; ++n) {
    const MetalPoint &p = path.begin.points[n], &q = path.end.points[n];
    const auto at = [&](float u) {
      return MetalPoint{p.material + u * (q.material - p.material), p.height_m + u * (q.height_m - p.height_m)};
    };
    part.begin.points[n] = at(a);
    part.end.points[n] = at(b);
  }
  return part;
}

void SourceWindow::AddPiece(const MetalPiece& piece, float radius, float reach) {
  const Electrode electrode(metric_, piece, radius);
  const Vec2f low = electrode.low(reach), high = electrode.high(reach);
  const int i0 = std::max(0, static_cast<int>(low.x())), i1 = std::min(kWindow - 1, static_cast<int>(high.x()));
  const int j0 = std::max(0, static_cast<int>(low.y())), j1 = std::min(kWindow - 1, static_cast<int>(high.y()));
  if (i0 > i1 || j0 > j1) return;
  for (int j = j0; j <= j1; ++j) {
    for (int i = i0; i <= i1; ++i) {
      float& gap = gap_[j * kWindow + i];
      gap = std::min(gap, electrode.Gap({static_cast<float>(i) + 0.5f, static_cast<float>(j) + 0.5f}));
    }
  }
  gap_low_ = {std::min(gap_low_.ix, i0), std::min(gap_low_.iy, j0)};
  gap_high_ = {std::max(gap_high_.ix, i1), std::max(gap_high_.iy, j1)};
}

void SourceWindow::SetGaps(const TipPath& path, float at, float reach_m) {
  for (int j = gap_low_.iy; j <= gap_high_.iy; ++j) {
    std::fill(&gap_[j * kWindow + gap_low_.ix], &gap_[j * kWindow + gap_high_.ix] + 1, kFarGap);
  }
  gap_low_ = {kWindow, kWindow};
  gap_high_ = {-1, -1};
  const float per_cell = 1.0f / material_.cell_m, radius = path.radius_m * per_cell, reach = reach_m * per_cell;
  const Vec2f origin(static_cast<float>(corner_.ix + sheet_.origin_x),
                     static_cast<float>(corner_.iy + sheet_.origin_y));
  const Vec2f window_middle = Vec2f::Constant(0.5f * kWindow);
  // What does not fit into the window is left out, and counted.
  const auto add = [&](MetalPiece piece) {
    const Vec2f start = piece.a - window_middle, way = piece.b - piece.a;
    // Of the piece, from part `from` to part `to` of it: within `most` of the middle along both axes.
    const float most = std::max(kMetalReach - radius, 0.0f);
    float from = 0, to = 1;
    for (int axis = 0; axis < 2; ++axis) {
      if (std::abs(way[axis]) < kShortWay) {
        if (std::abs(start[axis]) > most) to = -1;
        continue;
      }
      const float enters = (-most - start[axis]) / way[axis], leaves = (most - start[axis]) / way[axis];
      from = std::max(from, std::min(enters, leaves));
      to = std::min(to, std::max(enters, leaves));
    }
    if (from > 0.0f || to < 1.0f) {
      stats_.shortened = true;
      if (!(from < to)) return;
      const float rise = piece.height_b - piece.height_a, height = piece.height_a;
      piece = {piece.a + from * way, piece.a + to * way, height + from * rise, height + to * rise};
    }
    AddPiece(piece, radius, reach);
  };
  if (path.end.count == 0) {
    const Vec2f middle = (path.from + at * (path.to - path.from)) * per_cell - origin, half = path.half * per_cell;
    add({middle - half, middle + half, 0.0f, 0.0f});
    return;
  }
  // Where the sheet lies against the metal, its middle is half its thickness farther from the axis.
  const float cushion = (0.5f * material_.thickness_m + kContactSlack_m) * per_cell;
  const auto point = [&](std::uint32_t n, float* height) {
    const MetalPoint& end = path.end.points[n];
    const MetalPoint& begin = path.begin.count == path.end.count ? path.begin.points[n] : end;
    *height = (begin.height_m + at * (end.height_m - begin.height_m)) * per_cell;
    return Vec2f((begin.material + at * (end.material - begin.material)) * per_cell - origin);
  };
  float height_a = 0, height_b = 0;
  Vec2f a = point(0, &height_a);
  const auto off_sheet = [cushion](float height) {
    return std::copysign(std::max(std::abs(height) - cushion, 0.0f), height);
  };
  for (std::uint32_t n = 1; n < path.end.count; ++n, height_a = height_b) {
    const Vec2f b = point(n, &height_b);
    // Ends farther apart lie on two folds of the sheet.
    const bool one_piece = (b - a).norm() * material_.cell_m <= kLongestPiece_m;
    const bool near = std::min(std::abs(height_a), std::abs(height_b)) <= cushion + radius + reach ||
                      (height_a < 0.0f) != (height_b < 0.0f);
    if (one_piece && near) add({a, b, off_sheet(height_a), off_sheet(height_b)});
    a = b;
  }
}

}  // namespace fulcrum::thermal
