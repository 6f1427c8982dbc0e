// Which rows of the membrane are examined when, pauses between cracks, topology and checkpoint. The stretch itself:
// tear_stretch.cc; cracks: tear_crack.cc.
//
// A row is examined only if  lambda_0 + gain d >= kNear limit / (1 + prestrain),  or every kEveryAll steps.
//
//   lambda_0  largest stretch of a triangle of the row, without prestrain, when it was last examined
//   gain      sqrt(8 tr G^-1), the largest over the triangles of the row [1/m]
//   d         largest movement of a node since then [m]: both edges of a triangle change by 2 d at most, so that
//             |dF| <= |dE| |E^-1| <= sqrt(8) d sqrt(tr G^-1),  E: its edges at rest, G = E^T E
#include "physics_node/tear/tear_watch.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "services/base/core/sheets.h"

namespace fulcrum::physics {
namespace {

/// Least area of a triangle over the mean area: the stretch of a smaller one is dominated by rounding.
constexpr float kLeastAreaShare = 0.05f;
/// Largest half-width of the window of the average [cells]; bounds the cost on a fine mesh.
constexpr float kMaxWindow = 16;
/// Movement that is set where a row must be examined [m]: more than any row needs to reach the limit.
constexpr float kForceEvaluation = 1.0f;
/// Limit of a sheet that does not tear: more than any stretch.
constexpr float kNever = 1e6f;

std::uint32_t CountBits(std::span<const std::uint8_t> bits) {
  std::uint32_t count = 0;
  for (const std::uint8_t byte : bits) count += static_cast<std::uint32_t>(std::popcount(byte));
  return count;
}

/// True if value / limit > other / other_limit.
bool IsNearer(float value, float limit, float other, float other_limit) {
  return limit == other_limit ? value > other : value * other_limit > other * limit;
}

/// Weights of the cells to one side of a node, by distance: 1 within the window, the last cell in proportion.
std::vector<float> Window(float cells) {
  std::vector<float> weights;
  const float width = std::clamp(cells, 1.0f, kMaxWindow);
  for (float left = width; left > 0.0f; left -= 1.0f) weights.push_back(std::min(left, 1.0f));
  return weights;
}

}  // namespace

TearWatch::TearWatch(const TissueScene& scene, const TissueModel* model, const ParticleStore* particles)
    : scene_(scene),
      model_(model),
      particles_(particles),
      to_rest_(1.0f + scene.physics.membrane_prestrain),
      rows_(scene.membrane.rows),
      cols_(scene.membrane.cols) {
  torn_.assign((3 * std::size_t{rows_} * cols_ + 7) / 8, 0);
  for (const SheetProperties& of_row : PropertiesOfRows(scene)) {
    limits_.push_back(of_row.tear_stretch > 0.0f ? of_row.tear_stretch : kNever);
  }
  if (rows_ < 2 || cols_ < 2 || std::ranges::all_of(limits_, [](float limit) { return limit == kNever; })) {
    limits_.clear();
    return;
  }
  const std::size_t cells = std::size_t{rows_ - 1} * cols_;  // With a padding cell at the end of each row.
  for (std::size_t half = 0; half < 2; ++half) {
    for (auto* planes : {&inverse_.cc, &inverse_.cr, &inverse_.rr, &rest_.cc, &rest_.cr, &rest_.rr}) {
      (*planes)[half].assign(cells, 0.0f);
    }
  }
  const Index triangles = 2 * (rows_ - 1) * (cols_ - 1);
  sheet_of_ = SheetOfRows(scene);
  MeasureSheets();
  cell_rows_.stretch2.assign(rows_ - 1, 0.0f);
  cell_rows_.moved.assign(rows_ - 1, kForceEvaluation);
  cell_rows_.gain.assign(rows_ - 1, 0.0f);
  places_.values.assign(3 * std::size_t{rows_} * cols_, 0.0f);
  filtered_.values.assign(kSums * cells, 0.0f);
  smooth_.values.assign(std::size_t{rows_} * cols_, 0.0f);
  places_.pass.assign(rows_, 0);
  filtered_.pass.assign(rows_, 0);
  smooth_.pass.assign(rows_, 0);
  line_.assign(kSums * cols_, 0.0f);
  for (Index t = 0; t < triangles; ++t) RefreshTriangle(t);
}

void TearWatch::MeasureSheets() {
  struct Sums {
    double area = 0, triangles = 0, length[2] = {0, 0}, count[2] = {0, 0};
  };
  std::vector<Sums> sums(sheet_of_.back() + 1);
  for (Index t = 0; t < scene_.membrane.triangle_count(); ++t) {
    if (!HasTriangle(scene_, t)) continue;
    Sums& of = sums[sheet_of_[t / 2 / (cols_ - 1)]];
    const Metric g = RestMetric(t);
    of.area += 0.5 * std::sqrt(std::max(0.0, static_cast<double>(g.cc) * static_cast<double>(g.rr) -
                                                 static_cast<double>(g.cr) * static_cast<double>(g.cr)));
    of.triangles += 1;
  }
  for (std::size_t e = 0; e < scene_.membrane_rest_length.size(); ++e) {
    if (e % 3 == 2 || !(scene_.membrane_rest_length[e] > 0.0f)) continue;
    Sums& of = sums[sheet_of_[e / 3 / cols_]];
    of.length[e % 3] += static_cast<double>(scene_.membrane_rest_length[e]);
    of.count[e % 3] += 1;
  }
  for (const Sums& of : sums) {
    scales_.push_back({kLeastAreaShare * static_cast<float>(of.area / of.triangles),
                       Window(kSmoothing_m * static_cast<float>(of.count[0] / of.length[0])),
                       Window(kSmoothing_m * static_cast<float>(of.count[1] / of.length[1]))});
  }
}

void TearWatch::RefreshTriangle(Index triangle) {
  const std::size_t half = triangle % 2;
  const Index cell = triangle / 2;
  const std::size_t at = std::size_t{cell / (cols_ - 1)} * cols_ + cell % (cols_ - 1);
  Metric rest, inverse;
  if (model_->TriangleAlive(triangle)) {
    const Metric g = RestMetric(triangle);
    const float det = g.cc * g.rr - g.cr * g.cr;
    const float least_area = scales_[sheet_of_[cell / (cols_ - 1)]].least_area;
    if (det > 4.0f * least_area * least_area) {  // Area = sqrt(det) / 2.
      rest = g;
      inverse = {g.rr / det, -g.cr / det, g.cc / det};
    }
  }
  float& gain = cell_rows_.gain[cell / (cols_ - 1)];
  gain = std::max(gain, std::sqrt(8.0f * (inverse.cc + inverse.rr)));
  cell_rows_.moved[cell / (cols_ - 1)] = kForceEvaluation;
  inverse_.cc[half][at] = inverse.cc;
  inverse_.cr[half][at] = inverse.cr;
  inverse_.rr[half][at] = inverse.rr;
  rest_.cc[half][at] = rest.cc;
  rest_.cr[half][at] = rest.cr;
  rest_.rr[half][at] = rest.rr;
}

void TearWatch::Follow() {
  schedule_.topology_changed = true;
  if (limits_.empty()) return;
  for (const Index edge : model_->edited_edges()) {
    if (!(scene_.membrane_rest_length[edge] > 0.0f)) continue;
    // All triangles around both ends: a dead node also disables triangles of which it edits no edge.
    const Index low = edge / 3, high = OtherEnd(edge);
    const Index row0 = low / cols_, row1 = high / cols_, col0 = low % cols_, col1 = high % cols_;
    for (Index row = row0 > 0 ? row0 - 1 : 0; row <= std::min(row1, rows_ - 2); ++row) {
      for (Index col = col0 > 0 ? col0 - 1 : 0; col <= std::min(col1, cols_ - 2); ++col) {
        RefreshTriangle(2 * (row * (cols_ - 1) + col));
        RefreshTriangle(2 * (row * (cols_ - 1) + col) + 1);
      }
    }
    for (Index row = row0 > 0 ? row0 - 1 : 0; row <= row1; ++row) {
      for (Index col = col0 > 0 ? col0 - 1 : 0; col <= col1; ++col) {
        for (Index d = 0; d < 3; ++d) bare_edges_.push_back(3 * (row * cols_ + col) + d);
      }
    }
  }
  std::sort(bare_edges_.begin(), bare_edges_.end());
  bare_edges_.erase(std::unique(bare_edges_.begin(), bare_edges_.end()), bare_edges_.end());
  // Keep the living edges without a living triangle beside them.
  const auto whole = [this](Index row, Index col, Index half) {
    return row + 1 < rows_ && col + 1 < cols_ && model_->TriangleAlive(2 * (row * (cols_ - 1) + col) + half);
  };
  std::erase_if(bare_edges_, [&](Index edge) {
    const Index node = edge / 3, row = node / cols_, col = node % cols_;
    if (!model_->EdgeAlive(node, static_cast<int>(edge % 3)) || model_->IsDebris(node)) return true;
    switch (edge % 3) {
      case 0:
        return whole(row, col, 0) || (row > 0 && whole(row - 1, col, 1));
      case 1:
        return whole(row, col, 1) || (col > 0 && whole(row, col - 1, 0));
      default:
        return whole(row, col, 0) || whole(row, col, 1);
    }
  });
}

/// True while torn edges are not yet severed, and shortly after a change of the topology.
bool TearWatch::Paused() {
  if (std::exchange(schedule_.restored, false)) schedule_.quiet_until = schedule_.step + kMaxWait;
  if (std::exchange(schedule_.topology_changed, false)) schedule_.quiet_until = schedule_.step + kRelax;
  std::erase_if(pending_, [this](Index edge) { return !model_->EdgeAlive(edge / 3, static_cast<int>(edge % 3)); });
  if (!pending_.empty() && schedule_.step > schedule_.torn_step + kMaxWait) pending_.clear();
  return schedule_.step < schedule_.quiet_until || !pending_.empty();
}

void TearWatch::RowsMoved(std::uint32_t first, std::uint32_t end, float moved) {
  if (limits_.empty()) return;
  for (std::uint32_t row = first > 0 ? first - 1 : 0; row < std::min(end, rows_ - 1); ++row)
    cell_rows_.moved[row] += moved;
}

bool TearWatch::Evaluate(std::uint64_t step) {
  if (limits_.empty() || step % kEvery != 0) return false;
  schedule_.step = step;
  ++pass_;
  const auto near = [this](std::uint32_t row) { return kNear * limits_[row] / to_rest_; };
  const bool all = step % kEveryAll == 0;
  float largest2 = 0, nearest2 = 0;
  std::uint32_t largest_row = 0, nearest_row = 0;
  for (std::uint32_t row = 0; row + 1 < rows_; ++row) {
    const bool may_be_near =
        std::sqrt(cell_rows_.stretch2[row]) + cell_rows_.gain[row] * cell_rows_.moved[row] >= near(row);
    if (cell_rows_.moved[row] > 0.0f && (all || may_be_near)) {
      cell_rows_.stretch2[row] = LargestInRow(row);
      cell_rows_.moved[row] = 0;
    }
    const float stretch2 = cell_rows_.stretch2[row], limit = limits_[row], limit_there = limits_[nearest_row];
    if (IsNearer(stretch2, limit * limit, nearest2, limit_there * limit_there)) {
      nearest2 = stretch2;
      nearest_row = row;
    }
    if (stretch2 > largest2) {
      largest2 = stretch2;
      largest_row = row;
    }
  }
  // Nodes of the rows near their limit, of the one nearest to it, and of the most stretched one.
  std::uint32_t worst_row = 0, worst_col = 0, done = 0;
  largest_ = nearest_.stretch = 0;
  for (std::uint32_t row = 0; row + 1 < rows_; ++row) {
    if (row != largest_row && row != nearest_row && !(cell_rows_.stretch2[row] >= near(row) * near(row))) continue;
    const auto reach = static_cast<std::uint32_t>(scales_[sheet_of_[row]].by_rows.size());
    const std::uint32_t end = std::min(row + reach + 1, rows_);
    for (std::uint32_t r = std::max(done, row + 1 > reach ? row + 1 - reach : 0); r < end; ++r) {
      SmoothRow(r);
      for (std::uint32_t c = 0; c < cols_; ++c) {
        const float stretch = smooth_.values[r * cols_ + c];
        largest_ = std::max(largest_, stretch);
        if (IsNearer(stretch, limits_[r], nearest_.stretch, limits_[worst_row])) {
          nearest_.stretch = stretch;
          worst_row = r;
          worst_col = c;
        }
      }
    }
    done = std::max(done, end);
  }
  nearest_.limit = limits_[worst_row];
  const bool paused = Paused();
  if (schedule_.step >= schedule_.quiet_until) largest_ever_ = std::max(largest_ever_, largest_);
  if (paused) return false;
  const std::uint32_t before = torn_count_;
  TearBareEdges();
  if (nearest_.stretch >= nearest_.limit) Crack(worst_row, worst_col);
  if (torn_count_ != before) schedule_.torn_step = schedule_.step;
  return torn_count_ != before;
}

bool TearWatch::Fits(std::span<const std::uint8_t> torn) const {
  if (torn.size() != torn_.size()) return false;
  for (std::size_t edge = 0; edge < 8 * torn.size(); ++edge) {
    const bool exists = edge < scene_.membrane_rest_length.size() && scene_.membrane_rest_length[edge] > 0.0f;
    if (TestBit(torn, edge) && !exists) return false;
  }
  return true;
}

void TearWatch::Restore(std::span<const std::uint8_t> torn) {
  torn_.assign(torn_.size(), 0);
  std::copy(torn.begin(), torn.end(), torn_.begin());
  torn_count_ = CountBits(torn_);
  pending_.clear();
  for (Index edge = 0; edge < 3 * rows_ * cols_; ++edge) {
    if (TestBit(torn_, edge)) pending_.push_back(edge);
  }
  schedule_.restored = true;
  schedule_.topology_changed = false;
  std::fill(cell_rows_.moved.begin(), cell_rows_.moved.end(), kForceEvaluation);
}

}  // namespace fulcrum::physics
