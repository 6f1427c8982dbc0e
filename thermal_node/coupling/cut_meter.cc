#include "thermal_node/coupling/cut_meter.h"

#include <algorithm>
#include <cmath>

namespace fulcrum::thermal {
namespace {

/// Of the distances from the way [m].
constexpr float kBin_m = 1e-5f;
/// Longer than any slit in the largest sheet; a published length beyond it is damage [m].
constexpr float kLongest_m = 1e3f;

/// Index of the bin in which the given part of the histogram's sum is reached; the last one if it is empty.
std::size_t Percentile(std::span<const float> histogram, float part) {
  double sum = 0;
  for (const float weight : histogram) sum += static_cast<double>(weight);
  double reached = 0;
  for (std::size_t n = 0; n < histogram.size(); ++n) {
    reached += static_cast<double>(histogram[n]);
    if (reached >= static_cast<double>(part) * sum && reached > 0) return n;
  }
  return histogram.size() - 1;
}

}  // namespace

void CutMeter::AddWay(const Vec2f& from, const Vec2f& to) {
  const std::size_t before = way_.points().size();
  way_.Add(from, to);
  for (std::size_t n = before; n < way_.points().size(); ++n) {
    for (std::size_t k = 0; k < known_at_.size(); ++k) {
      off_way_m_[k] = std::min(off_way_m_[k], way_.DistanceToPiece(known_at_[k], n));
    }
  }
}

void CutMeter::Update(const HeatField& field, CellIndex low, CellIndex high) {
  line_.Update(field, low, high);
  Measure(field);
}

void CutMeter::Rebuild(const HeatField& field) {
  CellIndex low{INT32_MAX, INT32_MAX}, high{INT32_MIN, INT32_MIN};
  for (const Tile* tile : field.Existing()) {
    for (int k = 0; k < kTileCells; ++k) {
      const CellIndex cell{tile->tx * kTile + k % kTile, tile->ty * kTile + k / kTile};
      if (!IsHole(field, cell)) continue;
      low = {std::min(low.ix, cell.ix), std::min(low.iy, cell.iy)};
      high = {std::max(high.ix, cell.ix), std::max(high.iy, cell.iy)};
    }
  }
  line_.Clear();
  if (low.ix <= high.ix) line_.Update(field, low, high);
  Measure(field);
}

void CutMeter::Measure(const HeatField& field) {
  length_m_ = std::max(length_m_, graph_.Measure(field, line_.cells()));
  KeepOffWay(field);
  SetPercentiles(field.sheet().cell_m);
}

/// Both lines are in the same order: cells that stay keep their distance from the way.
void CutMeter::KeepOffWay(const HeatField& field) {
  const auto behind = [](CellIndex a, CellIndex b) { return a.iy != b.iy ? a.iy < b.iy : a.ix < b.ix; };
  const std::span<const LineCell> cells = line_.cells();
  off_way_next_.resize(cells.size());
  known_at_.resize(cells.size());
  std::size_t old = 0;
  for (std::size_t n = 0; n < cells.size(); ++n) {
    known_at_[n] = field.sheet().CentreOf(cells[n].at);
    while (old < known_.size() && behind(known_[old].at, cells[n].at)) ++old;
    const bool kept = old < known_.size() && known_[old].at == cells[n].at;
    off_way_next_[n] = kept ? off_way_m_[old] : way_.Distance(known_at_[n]);
  }
  off_way_m_.swap(off_way_next_);
  known_.assign(cells.begin(), cells.end());
}

void CutMeter::SetPercentiles(float cell_m) {
  width_p50_m_ = width_p95_m_ = off_way_p95_m_ = 0;
  if (known_.empty()) return;
  const std::span<const float> weights = graph_.weights();
  std::int32_t most = 0;
  for (const LineCell& cell : known_) most = std::max(most, cell.distance2);
  histogram_.assign(static_cast<std::size_t>(most) + 1, 0.0f);
  for (std::size_t n = 0; n < known_.size(); ++n)
    histogram_[static_cast<std::size_t>(known_[n].distance2)] += weights[n];
  // From tissue cell to tissue cell less the two halves, for a line that is in the middle; it is up to half a cell off.
  const auto width = [&](float part) {
    return (2.0f * std::sqrt(static_cast<float>(Percentile(histogram_, part))) - 0.5f) * cell_m;
  };
  width_p50_m_ = width(0.5f);
  width_p95_m_ = width(0.95f);
  histogram_.assign(static_cast<std::size_t>(std::lround(kWayReach_m / kBin_m)) + 1, 0.0f);
  for (std::size_t n = 0; n < known_.size(); ++n) {
    histogram_[static_cast<std::size_t>(std::lround(off_way_m_[n] / kBin_m))] += weights[n];
  }
  off_way_p95_m_ = static_cast<float>(Percentile(histogram_, 0.95f)) * kBin_m;
}

bool CutMeter::Restore(const HeatField& field, float length_m, std::span<const CellIndex> line,
                       std::span<const ToolWay::Point> way, const ToolWay::End& way_end) {
  *this = CutMeter();
  if (!(length_m >= 0.0f && length_m <= kLongest_m) || !line_.Restore(field, line) || !way_.Restore(way, way_end)) {
    *this = CutMeter();
    return false;
  }
  // Cells may have been removed since the update from which the published length is: they count at the next.
  Measure(field);
  length_m_ = length_m;
  return true;
}

}  // namespace fulcrum::thermal
