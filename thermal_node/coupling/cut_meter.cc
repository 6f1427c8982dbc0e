#include "thermal_node/coupling/cut_meter.h"

#include <algorithm>
#include <cmath>

namespace fulcrum::thermal {
namespace {

/// Bin width of the histogram of distances from the path [m]: a tenth of a cell.
constexpr float kBin_m = 1e-5f;
/// Longer than any slit in the largest sheet; a longer one in a checkpoint means that the file is damaged [m].
constexpr float kLongest_m = 1e3f;

/// Index of the first bin at which the cumulative sum reaches the given part of the total; the last bin if the
/// histogram is empty.
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

void CutMeter::AddPath(const Vec2f& from, const Vec2f& to) {
  const std::size_t before = path_.points().size();
  path_.Add(from, to);
  for (std::size_t n = before; n < path_.points().size(); ++n) {
    for (std::size_t k = 0; k < known_at_.size(); ++k) {
      off_path_m_[k] = std::min(off_path_m_[k], path_.DistanceToPiece(known_at_[k], n));
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
  UpdatePathDistances(field);
  SetPercentiles(field.sheet().cell_m);
}

/// Both lines are sorted alike, so one merge pass carries over the distances of the cells that are in both.
void CutMeter::UpdatePathDistances(const HeatField& field) {
  const auto behind = [](CellIndex a, CellIndex b) { return a.iy != b.iy ? a.iy < b.iy : a.ix < b.ix; };
  const std::span<const LineCell> cells = line_.cells();
  off_path_next_.resize(cells.size());
  known_at_.resize(cells.size());
  std::size_t old = 0;
  for (std::size_t n = 0; n < cells.size(); ++n) {
    known_at_[n] = field.sheet().CentreOf(cells[n].at);
    while (old < known_.size() && behind(known_[old].at, cells[n].at)) ++old;
    const bool kept = old < known_.size() && known_[old].at == cells[n].at;
    off_path_next_[n] = kept ? off_path_m_[old] : path_.Distance(known_at_[n]);
  }
  off_path_m_.swap(off_path_next_);
  known_.assign(cells.begin(), cells.end());
}

void CutMeter::SetPercentiles(float cell_m) {
  width_p50_m_ = width_p95_m_ = off_path_p95_m_ = 0;
  if (known_.empty()) return;
  const std::span<const float> weights = graph_.weights();
  std::int32_t most = 0;
  for (const LineCell& cell : known_) most = std::max(most, cell.distance2);
  histogram_.assign(static_cast<std::size_t>(most) + 1, 0.0f);
  for (std::size_t n = 0; n < known_.size(); ++n)
    histogram_[static_cast<std::size_t>(known_[n].distance2)] += weights[n];
  // Distance between the tissue cells on either side less half a cell each, if the line lies in the middle. The line is
  // up to half a cell off the middle, hence 0.5 and not 1.
  const auto width = [&](float part) {
    return (2.0f * std::sqrt(static_cast<float>(Percentile(histogram_, part))) - 0.5f) * cell_m;
  };
  width_p50_m_ = width(0.5f);
  width_p95_m_ = width(0.95f);
  histogram_.assign(static_cast<std::size_t>(std::lround(kPathReach_m / kBin_m)) + 1, 0.0f);
  for (std::size_t n = 0; n < known_.size(); ++n) {
    histogram_[static_cast<std::size_t>(std::lround(off_path_m_[n] / kBin_m))] += weights[n];
  }
  off_path_p95_m_ = static_cast<float>(Percentile(histogram_, 0.95f)) * kBin_m;
}

bool CutMeter::Restore(const HeatField& field, float length_m, std::span<const CellIndex> line,
                       std::span<const ToolPath::Point> path, const ToolPath::End& path_end) {
  *this = CutMeter();
  if (!(length_m >= 0.0f && length_m <= kLongest_m) || !line_.Restore(field, line) || !path_.Restore(path, path_end)) {
    *this = CutMeter();
    return false;
  }
  // Cells may have been removed since the update that gave the published length; they count in the next update.
  Measure(field);
  length_m_ = length_m;
  return true;
}

}  // namespace fulcrum::thermal
