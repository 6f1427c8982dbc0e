// Cracks: straight lines through the most stretched place, across the principal stretch.
//
//   v . G w = 0             w: direction of the crack, perpendicular to the principal direction v in the rest metric G
//   x_k+1 = x_k +- kCrackStep w     from the middle of the most stretched edge, while lambda(x_k+1) >= kNear limit, at
//                                   most kAdvance_m to either side; x, v, w in (column, row) [cells]
//
// All edges that the line between the two ends crosses are torn.
#include <algorithm>
#include <cmath>

#include "physics_node/tear/tear_watch.h"

namespace fulcrum::physics {
namespace {

/// Steps along a crack [cells]. They only find its ends: edges are crossed by the straight line.
constexpr float kCrackStep = 0.25f;
/// Least number of steps to either side, so that a crack crosses at least the edge where it begins.
constexpr int kMinSteps = 2;
/// Least length of a cell's edge in the length of a step [m]; bounds the number of steps.
constexpr float kLeastCellEdge = 1e-6f;

}  // namespace

void TearWatch::Tear(Index edge) {
  if (TestBit(torn_, edge) || !model_->EdgeAlive(edge / 3, static_cast<int>(edge % 3))) return;
  SetBit(torn_, edge);
  ++torn_count_;
  pending_.push_back(edge);
}

void TearWatch::TearBareEdges() {
  for (const Index edge : bare_edges_) {
    const float limit = limits_[edge / 3 / cols_];
    if (EdgeStretch2(edge) >= limit * limit) Tear(edge);
  }
}

/// Tears all edges that the straight line crosses.
void TearWatch::TearAcross(const Place& from, const Place& to) {
  const auto index = [](float value, std::uint32_t count) {
    return static_cast<std::uint32_t>(std::clamp(value, 0.0f, static_cast<float>(count - 1)));
  };
  const std::uint32_t row0 = index(std::floor(std::min(from.row, to.row)) - 1, rows_),
                      row1 = index(std::ceil(std::max(from.row, to.row)), rows_),
                      col0 = index(std::floor(std::min(from.col, to.col)) - 1, cols_),
                      col1 = index(std::ceil(std::max(from.col, to.col)), cols_);
  const auto side = [](const Place& a, const Place& b, const Place& p) {
    return (b.col - a.col) * (p.row - a.row) - (b.row - a.row) * (p.col - a.col);
  };
  for (std::uint32_t row = row0; row <= row1; ++row) {
    for (std::uint32_t col = col0; col <= col1; ++col) {
      const Place a{static_cast<float>(col), static_cast<float>(row)};
      for (Index d = 0; d < 3; ++d) {
        const Index edge = 3 * (row * cols_ + col) + d;
        if (!(scene_.membrane_rest_length[edge] > 0.0f)) continue;
        const Place b{a.col + (d == 1 ? 0.0f : 1.0f), a.row + (d == 0 ? 0.0f : 1.0f)};
        if ((side(from, to, a) >= 0) != (side(from, to, b) >= 0) && (side(a, b, from) >= 0) != (side(a, b, to) >= 0)) {
          Tear(edge);
        }
      }
    }
  }
}

/// A crack from the most stretched place, which is at node (row, col).
void TearWatch::Crack(std::uint32_t row, std::uint32_t col) {
  // Through the middle of an edge: at a node rounding would decide on which side of it the crack passes.
  const Index node = row * cols_ + col;
  Index begin = kNoIndex;
  float most = 0;
  const auto examine = [&](bool inside, Index a, Index d) {
    if (!inside || !model_->EdgeAlive(a, static_cast<int>(d)) || TestBit(torn_, 3 * a + d)) return;
    const float stretch2 = EdgeStretch2(3 * a + d);
    if (stretch2 > most) {
      most = stretch2;
      begin = 3 * a + d;
    }
  };
  for (Index d = 0; d < 3; ++d) examine(true, node, d);
  examine(col > 0, node - 1, 0);
  examine(row > 0, node - cols_, 1);
  examine(row > 0 && col > 0, node - cols_ - 1, 2);
  if (begin == kNoIndex) return;
  const Index a = begin / 3, b = OtherEnd(begin);
  const Index cols_sum = a % cols_ + b % cols_, rows_sum = a / cols_ + b / cols_;
  const Place middle{0.5f * static_cast<float>(cols_sum), 0.5f * static_cast<float>(rows_sum)};
  Tear(begin);

  const auto sum = SumsAt(row, col);  // 3, 4, 5: the metric at rest, times the sum of the weights, which cancels.
  const Place v = At(row, col).along;
  Place w{-(sum[4] * v.col + sum[5] * v.row), sum[3] * v.col + sum[4] * v.row};
  // At the last column or row of a sheet there is no edge beyond: the one before.
  const auto cell_edge = [&](Index d, Index before) {
    const float length_m = scene_.membrane_rest_length[3 * a + d];
    return length_m > 0.0f || a < before ? length_m : scene_.membrane_rest_length[3 * (a - before) + d];
  };
  const float cell_col = cell_edge(0, 1), cell_row = cell_edge(1, cols_);
  const float length = std::hypot(w.col, w.row);
  if (!(length > 0.0f)) return;
  w = {w.col / length, w.row / length};
  const float metres =
      std::hypot(w.col * std::max(cell_col, kLeastCellEdge), w.row * std::max(cell_row, kLeastCellEdge));
  const int most_steps = std::max(kMinSteps, static_cast<int>(kAdvance_m / (kCrackStep * metres)));
  Place ends[2];
  for (int side = 0; side < 2; ++side) {
    const float step = side == 0 ? kCrackStep : -kCrackStep;
    Place at = middle;
    for (int i = 0; i < most_steps; ++i) {
      at = {at.col + step * w.col, at.row + step * w.row};
      if (!(StretchAt(at) >= kNear * limits_[row])) break;
    }
    ends[side] = at;
  }
  TearAcross(ends[0], ends[1]);
}

}  // namespace fulcrum::physics
