// Stretch of the membrane: of each triangle, and averaged over the triangles around each node (tear_watch.h).
//
//   triangle   lambda^2 = t + sqrt(t^2 - det g det G^-1),   t = tr(G^-1 g) / 2
//   node       lambda = (1 + prestrain) sqrt(largest eigenvalue of <G>^-1 <g>),   <m> = sum_cells w_r w_c m
//   edge       lambda = (1 + prestrain) l / L
//
//   g, G      metric (e_c.e_c, e_c.e_r, e_r.e_r) now and at rest [m^2]      l, L      length now and at rest [m]
//   w_r, w_c  weights of the window by rows and columns from the node: 1 within kSmoothing_m, the last cell in part
//
// Stencil of cell (r, c): half 0 has the edges e_c from (r, c) to (r, c+1) and e_r from (r, c+1) to (r+1, c+1); half 1
// has e_c from (r+1, c) to (r+1, c+1) and e_r from (r, c) to (r+1, c).
//
// Layout: a row of nodes as planes x, y, z of `cols` floats, without the lanes of the particle store; sums over the
// cells of a row as kSums planes of `cols` floats. Rows are computed once per examination (`pass_`).
#include <algorithm>
#include <cmath>

#include "physics_node/tear/tear_watch.h"

namespace fulcrum::physics {
namespace {

/// Largest of the values and 0; NaN is ignored. Independent lanes, so that the compiler vectorises it.
float Largest(const float* values, std::size_t count) {
  float lanes[kLanes] = {};
  std::size_t i = 0;
  for (; i + kLanes <= count; i += kLanes) {
    for (std::size_t k = 0; k < kLanes; ++k) lanes[k] = values[i + k] > lanes[k] ? values[i + k] : lanes[k];
  }
  float largest = 0;
  for (const float lane : lanes) largest = std::max(largest, lane);
  for (; i < count; ++i) largest = values[i] > largest ? values[i] : largest;
  return largest;
}

/// Nodes of a row of triangles, as planes x, y and z of n columns each: e_c joins neighbours in `along`, e_r leads from
/// `top` to `bottom`.
struct RowEdges {
  const float *along, *top, *bottom;
  std::size_t n;
};

/// Squared larger principal stretch of each triangle of a row; (icc, icr, irr): inverse of its metric at rest.
void PrincipalStretches(const RowEdges& e, const float* icc, const float* icr, const float* irr, std::size_t count,
                        float* __restrict stretch2) {
  const float *ax = e.along, *ay = ax + e.n, *az = ay + e.n, *tx = e.top, *ty = tx + e.n, *tz = ty + e.n,
              *bx = e.bottom, *by = bx + e.n, *bz = by + e.n;
  for (std::size_t c = 0; c < count; ++c) {
    const float ux = ax[c + 1] - ax[c], uy = ay[c + 1] - ay[c], uz = az[c + 1] - az[c];
    const float vx = bx[c] - tx[c], vy = by[c] - ty[c], vz = bz[c] - tz[c];
    const float cc = ux * ux + uy * uy + uz * uz, cr = ux * vx + uy * vy + uz * vz, rr = vx * vx + vy * vy + vz * vz;
    const float half_trace = 0.5f * (icc[c] * cc + irr[c] * rr) + icr[c] * cr;
    const float det = (cc * rr - cr * cr) * (icc[c] * irr[c] - icr[c] * icr[c]);
    const float root2 = half_trace * half_trace - det;
    stretch2[c] = half_trace + std::sqrt(root2 > 0.0f ? root2 : 0.0f);
  }
}

}  // namespace

/// From the positions at rest: the rest lengths of a scene can differ from them.
TearWatch::Metric TearWatch::RestMetric(Index triangle) const {
  const auto nodes = model_->TriangleNodes(triangle);
  const auto at = [&](std::size_t i) { return scene_.rest_position[scene_.membrane.first + nodes[i]]; };
  // Half 0 is (n00, n01, n11), half 1 is (n00, n11, n10).
  const bool first = triangle % 2 == 0;
  const Vec3f col = first ? at(1) - at(0) : at(1) - at(2), row = first ? at(2) - at(1) : at(2) - at(0);
  return {col.dot(col), col.dot(row), row.dot(row)};
}

Index TearWatch::OtherEnd(Index edge) const {
  return edge / 3 + (edge % 3 == 0 ? 1 : edge % 3 == 1 ? cols_ : cols_ + 1);
}

/// The larger eigenvalue of G^-1 g and its eigenvector.
TearWatch::Principal TearWatch::PrincipalOf(const Metric& g, const Metric& rest) {
  const float det_rest = rest.cc * rest.rr - rest.cr * rest.cr;
  if (!(det_rest > 0.0f)) return {};
  // M = G^-1 g, not symmetric.
  const float m00 = (rest.rr * g.cc - rest.cr * g.cr) / det_rest, m01 = (rest.rr * g.cr - rest.cr * g.rr) / det_rest;
  const float m10 = (rest.cc * g.cr - rest.cr * g.cc) / det_rest, m11 = (rest.cc * g.rr - rest.cr * g.cr) / det_rest;
  const float mean = 0.5f * (m00 + m11), half = 0.5f * (m00 - m11);
  Principal p;
  p.stretch2 = mean + std::sqrt(std::max(0.0f, half * half + m01 * m10));
  // (M - lambda^2) v = 0: the row with the larger entries.
  const float a = p.stretch2 - m00, d = p.stretch2 - m11;
  p.along = std::abs(a) + std::abs(m01) > std::abs(d) + std::abs(m10) ? Place{m01, a} : Place{d, m10};
  return p;
}

const float* TearWatch::RowPlaces(std::uint32_t row) {
  float* out = &places_.values[3 * std::size_t{row} * cols_];
  if (places_.pass[row] == pass_) return out;
  places_.pass[row] = pass_;
  const GridLayout& layout = particles_->layout();
  for (int axis = 0; axis < 3; ++axis) {
    const float* at = particles_->plane(axis) + std::size_t{row} * layout.stride;
    float* to = out + static_cast<std::size_t>(axis) * cols_;
    std::uint32_t col = 0;
    for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
      for (std::uint32_t slot = 0; slot < layout.slots && col < cols_; ++slot) to[col++] = at[slot * kLanes + lane];
    }
  }
  return out;
}

/// Largest squared stretch of a triangle between rows `row` and `row` + 1, an upper bound of that of the averages.
float TearWatch::LargestInRow(std::uint32_t row) {
  const float *a = RowPlaces(row), *b = RowPlaces(row + 1);
  const std::size_t n = cols_, cells = cols_ - 1, first = std::size_t{row} * cols_;
  float* stretch2 = line_.data();
  float largest = 0;
  for (std::size_t half = 0; half < 2; ++half) {
    // Half 0: along the upper row and down the right side. Half 1: along the lower row and down the left side.
    const float *col_row = half == 0 ? a : b, *top = half == 0 ? a + 1 : a, *bottom = half == 0 ? b + 1 : b;
    const float *icc = &inverse_.cc[half][first], *icr = &inverse_.cr[half][first], *irr = &inverse_.rr[half][first];
    PrincipalStretches({col_row, top, bottom, n}, icc, icr, irr, cells, stretch2);
    largest = std::max(largest, Largest(stretch2, cells));
  }
  return largest;
}

/// Weighted sums over the triangles of a row of cells for the nodes along it: g (cc, cr, rr), then G.
const float* TearWatch::FilteredRow(std::uint32_t row) {
  float* out = &filtered_.values[kSums * std::size_t{row} * cols_];
  if (filtered_.pass[row] == pass_) return out;
  filtered_.pass[row] = pass_;
  const float *a = RowPlaces(row), *b = RowPlaces(row + 1);
  const std::size_t n = cols_, cells = cols_ - 1, first = std::size_t{row} * cols_;
  std::fill(line_.begin(), line_.end(), 0.0f);
  std::fill_n(out, kSums * n, 0.0f);
  for (std::size_t half = 0; half < 2; ++half) {
    const float *col_row = half == 0 ? a : b, *top = half == 0 ? a + 1 : a, *bottom = half == 0 ? b + 1 : b;
    for (std::size_t c = 0; c < cells; ++c) {
      const float ux = col_row[c + 1] - col_row[c], uy = col_row[n + c + 1] - col_row[n + c],
                  uz = col_row[2 * n + c + 1] - col_row[2 * n + c];
      const float vx = bottom[c] - top[c], vy = bottom[n + c] - top[n + c], vz = bottom[2 * n + c] - top[2 * n + c];
      const float alive = rest_.cc[half][first + c] > 0.0f ? 1.0f : 0.0f;
      line_[c] += alive * (ux * ux + uy * uy + uz * uz);
      line_[n + c] += alive * (ux * vx + uy * vy + uz * vz);
      line_[2 * n + c] += alive * (vx * vx + vy * vy + vz * vz);
      line_[3 * n + c] += rest_.cc[half][first + c];
      line_[4 * n + c] += rest_.cr[half][first + c];
      line_[5 * n + c] += rest_.rr[half][first + c];
    }
  }
  const std::vector<float>& by_cols = scales_[sheet_of_[row]].by_cols;
  for (std::size_t k = 0; k < kSums; ++k) {
    const float* in = &line_[k * n];
    float* sum = out + k * n;
    for (std::size_t i = 0; i < by_cols.size(); ++i) {
      const float w = by_cols[i];
      for (std::size_t c = 0; c + i < cells; ++c) sum[c] += w * in[c + i];  // Cell to the right of node c.
      for (std::size_t c = i + 1; c < n; ++c) sum[c] += w * in[c - 1 - i];  // Cell to its left.
    }
  }
  return out;
}

std::array<float, TearWatch::kSums> TearWatch::SumsAt(std::uint32_t row, std::uint32_t col) {
  std::array<float, kSums> sum{};
  const std::vector<float>& by_rows = scales_[sheet_of_[row]].by_rows;
  for (std::uint32_t i = 0; i < by_rows.size(); ++i) {
    for (int side = 0; side < 2; ++side) {
      if (side == 0 ? row + i + 1 >= rows_ : row < i + 1) continue;
      const std::uint32_t other = side == 0 ? row + i : row - 1 - i;
      if (sheet_of_[other] != sheet_of_[row]) continue;
      const float* in = FilteredRow(other);
      for (std::size_t k = 0; k < kSums; ++k) sum[k] += by_rows[i] * in[k * cols_ + col];
    }
  }
  return sum;
}

TearWatch::Principal TearWatch::At(std::uint32_t row, std::uint32_t col) {
  const auto sum = SumsAt(row, col);
  return PrincipalOf({sum[0], sum[1], sum[2]}, {sum[3], sum[4], sum[5]});
}

/// lambda of the nodes of a row; 0 for nodes without living triangles and in debris.
void TearWatch::SmoothRow(std::uint32_t row) {
  if (smooth_.pass[row] == pass_) return;
  smooth_.pass[row] = pass_;
  for (std::uint32_t col = 0; col < cols_; ++col) {
    const Index node = row * cols_ + col;
    const bool tissue = model_->NodeAlive(node) && !model_->IsDebris(node);
    const float stretch = tissue ? to_rest_ * std::sqrt(At(row, col).stretch2) : 0.0f;
    smooth_.values[node] = stretch > 0.0f ? stretch : 0.0f;  // 0 for NaN.
  }
}

float TearWatch::StretchAt(const Place& place) const {
  const float col = std::round(place.col), row = std::round(place.row);
  if (!(col >= 0.0f && row >= 0.0f && col < static_cast<float>(cols_) && row < static_cast<float>(rows_))) return 0;
  const auto r = static_cast<std::uint32_t>(row), c = static_cast<std::uint32_t>(col);
  return smooth_.pass[r] == pass_ ? smooth_.values[r * cols_ + c] : 0.0f;
}

float TearWatch::EdgeStretch2(Index edge) const {
  const Index a = edge / 3, b = OtherEnd(edge);
  const float now = (particles_->At(particles_->NodeRef(a / cols_, a % cols_)) -
                     particles_->At(particles_->NodeRef(b / cols_, b % cols_)))
                        .squaredNorm();
  const float rest = scene_.membrane_rest_length[edge];
  return to_rest_ * to_rest_ * now / (rest * rest);
}

}  // namespace fulcrum::physics
