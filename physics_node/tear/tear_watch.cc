#include "physics_node/tear/tear_watch.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

namespace fulcrum::physics {
namespace {

/// A triangle with less than this part of the mean area says nothing: rounding is stretch to it.
constexpr float kLeastArea = 0.05f;
/// Steps along a crack, in cells: an edge is crossed by the straight line, this only asks how far it runs.
constexpr float kCrackStep = 0.25f;
/// The window of the average covers at most so many cells to either side.
constexpr float kMostCells = 16;
/// Movement of a row that must be looked at [m].
constexpr float kUnknown = 1.0f;

std::uint32_t CountBits(std::span<const std::uint8_t> bits) {
  std::uint32_t count = 0;
  for (const std::uint8_t byte : bits) count += static_cast<std::uint32_t>(std::popcount(byte));
  return count;
}

/// Weights of the cells beside a node: whole ones within the window, the last one in part.
std::vector<float> Window(float cells) {
  std::vector<float> weights;
  const float width = std::clamp(cells, 1.0f, kMostCells);
  for (float left = width; left > 0.0f; left -= 1.0f) weights.push_back(std::min(left, 1.0f));
  return weights;
}

/// Largest of the values; NaN counts as none. In lanes, so that it is vectorised.
float Largest(const float* values, std::size_t count) {
  float lanes[8] = {};
  std::size_t i = 0;
  for (; i + 8 <= count; i += 8) {
    for (std::size_t k = 0; k < 8; ++k) lanes[k] = values[i + k] > lanes[k] ? values[i + k] : lanes[k];
  }
  float largest = 0;
  for (const float lane : lanes) largest = std::max(largest, lane);
  for (; i < count; ++i) largest = values[i] > largest ? values[i] : largest;
  return largest;
}

/// Edges of a row of triangles: `along` the columns in one row of nodes, and from `top` down to `bottom`. Planes x, y
/// and z of n columns each.
struct RowEdges {
  const float *along, *top, *bottom;
  std::size_t n;
};

/// Squared principal stretches of a row of triangles, from the inverse of their rest metric:
/// lambda^2 = t + sqrt(t^2 - det g det G^-1), t = trace(G^-1 g) / 2.
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

TearWatch::TearWatch(const SceneView& scene, const TissueModel* model, const ParticleStore* particles)
    : scene_(scene),
      model_(model),
      particles_(particles),
      limit_(scene.physics.tear_stretch),
      to_rest_(1.0f + scene.physics.membrane_prestrain),
      rows_(scene.membrane.rows),
      cols_(scene.membrane.cols) {
  torn_.assign((3 * std::size_t{rows_} * cols_ + 7) / 8, 0);
  if (limit_ == 0.0f || rows_ < 2 || cols_ < 2) {
    limit_ = 0;
    return;
  }
  const std::size_t cells = std::size_t{rows_ - 1} * cols_;  // One more a row than there are: padding.
  for (std::size_t half = 0; half < 2; ++half) {
    for (auto* planes : {&inverse_cc_, &inverse_cr_, &inverse_rr_, &rest_cc_, &rest_cr_, &rest_rr_}) {
      (*planes)[half].assign(cells, 0.0f);
    }
  }
  const Index triangles = 2 * (rows_ - 1) * (cols_ - 1);
  double area = 0, length[2] = {0, 0}, count[2] = {0, 0};
  for (Index t = 0; t < triangles; ++t) {
    const Metric g = RestMetric(t);
    area += 0.5 * std::sqrt(std::max(0.0, static_cast<double>(g.cc) * static_cast<double>(g.rr) -
                                              static_cast<double>(g.cr) * static_cast<double>(g.cr)));
  }
  least_area_ = kLeastArea * static_cast<float>(area / triangles);
  for (std::size_t e = 0; e < scene.membrane_rest_length.size(); ++e) {
    if (e % 3 == 2 || !(scene.membrane_rest_length[e] > 0.0f)) continue;
    length[e % 3] += static_cast<double>(scene.membrane_rest_length[e]);
    count[e % 3] += 1;
  }
  weight_col_ = Window(kSmoothing_m * static_cast<float>(count[0] / length[0]));
  weight_row_ = Window(kSmoothing_m * static_cast<float>(count[1] / length[1]));
  row_stretch2_.assign(rows_ - 1, 0.0f);
  row_moved_.assign(rows_ - 1, kUnknown);
  row_gain_.assign(rows_ - 1, 0.0f);
  places_.assign(3 * std::size_t{rows_} * cols_, 0.0f);
  filtered_.assign(kSums * cells, 0.0f);
  smooth_.assign(std::size_t{rows_} * cols_, 0.0f);
  places_look_.assign(rows_, 0);
  filtered_look_.assign(rows_, 0);
  smooth_look_.assign(rows_, 0);
  line_.assign(kSums * cols_, 0.0f);
  for (Index t = 0; t < triangles; ++t) RefreshTriangle(t);
}

/// From the places at rest, not from lengths: those of a scene may be others.
TearWatch::Metric TearWatch::RestMetric(Index triangle) const {
  const auto nodes = model_->TriangleNodes(triangle);
  const auto at = [&](std::size_t i) { return scene_.rest_position[scene_.membrane.first + nodes[i]]; };
  // Half 0 is (n00, n01, n11), half 1 is (n00, n11, n10).
  const bool first = triangle % 2 == 0;
  const Vec3f col = first ? at(1) - at(0) : at(1) - at(2), row = first ? at(2) - at(1) : at(2) - at(0);
  return {col.dot(col), col.dot(row), row.dot(row)};
}

void TearWatch::RefreshTriangle(Index triangle) {
  const std::size_t half = triangle % 2;
  const Index cell = triangle / 2;
  const std::size_t at = std::size_t{cell / (cols_ - 1)} * cols_ + cell % (cols_ - 1);
  Metric rest, inverse;
  if (model_->TriangleAlive(triangle)) {
    const Metric g = RestMetric(triangle);
    const float det = g.cc * g.rr - g.cr * g.cr;
    if (det > 4.0f * least_area_ * least_area_) {
      rest = g;
      inverse = {g.rr / det, -g.cr / det, g.cc / det};
    }
  }
  // |dF| <= |dE| |E^-1|, where both edges E change by 2 d at most and |E^-1|^2 <= trace G^-1.
  float& gain = row_gain_[cell / (cols_ - 1)];
  gain = std::max(gain, std::sqrt(8.0f * (inverse.cc + inverse.rr)));
  row_moved_[cell / (cols_ - 1)] = kUnknown;  // To be looked at.
  inverse_cc_[half][at] = inverse.cc;
  inverse_cr_[half][at] = inverse.cr;
  inverse_rr_[half][at] = inverse.rr;
  rest_cc_[half][at] = rest.cc;
  rest_cr_[half][at] = rest.cr;
  rest_rr_[half][at] = rest.rr;
}

Index TearWatch::OtherEnd(Index edge) const {
  return edge / 3 + (edge % 3 == 0 ? 1 : edge % 3 == 1 ? cols_ : cols_ + 1);
}

void TearWatch::Follow() {
  followed_ = true;
  if (limit_ == 0.0f) return;
  for (const Index edge : model_->edited_edges()) {
    if (!(scene_.membrane_rest_length[edge] > 0.0f)) continue;
    // All triangles around both ends: a dead node takes those with it of which it edits no edge.
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
        for (Index d = 0; d < 3; ++d) threads_.push_back(3 * (row * cols_ + col) + d);
      }
    }
  }
  std::sort(threads_.begin(), threads_.end());
  threads_.erase(std::unique(threads_.begin(), threads_.end()), threads_.end());
  // A thread is an edge that lives while both triangles beside it are gone.
  const auto whole = [this](Index row, Index col, Index half) {
    return row + 1 < rows_ && col + 1 < cols_ && model_->TriangleAlive(2 * (row * (cols_ - 1) + col) + half);
  };
  std::erase_if(threads_, [&](Index edge) {
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

/// The larger eigenvalue of G^-1 g and its vector.
TearWatch::Principal TearWatch::PrincipalOf(const Metric& g, const Metric& rest) {
  const float det_rest = rest.cc * rest.rr - rest.cr * rest.cr;
  if (!(det_rest > 0.0f)) return {};
  // M = G^-1 g, not symmetric.
  const float m00 = (rest.rr * g.cc - rest.cr * g.cr) / det_rest, m01 = (rest.rr * g.cr - rest.cr * g.rr) / det_rest;
  const float m10 = (rest.cc * g.cr - rest.cr * g.cc) / det_rest, m11 = (rest.cc * g.rr - rest.cr * g.cr) / det_rest;
  const float mean = 0.5f * (m00 + m11), half = 0.5f * (m00 - m11);
  Principal p;
  p.stretch2 = mean + std::sqrt(std::max(0.0f, half * half + m01 * m10));
  // (M - lambda) v = 0: the better conditioned of its rows.
  const float a = p.stretch2 - m00, d = p.stretch2 - m11;
  p.along = std::abs(a) + std::abs(m01) > std::abs(d) + std::abs(m10) ? Place{m01, a} : Place{d, m10};
  return p;
}

const float* TearWatch::RowPlaces(std::uint32_t row) {
  float* out = &places_[3 * std::size_t{row} * cols_];
  if (places_look_[row] == look_) return out;
  places_look_[row] = look_;
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

/// Largest squared stretch of a triangle between rows `row` and `row` + 1. That of an average is never larger.
float TearWatch::LargestInRow(std::uint32_t row) {
  const float *a = RowPlaces(row), *b = RowPlaces(row + 1);
  const std::size_t n = cols_, cells = cols_ - 1, first = std::size_t{row} * cols_;
  float* stretch2 = line_.data();
  float largest = 0;
  for (std::size_t half = 0; half < 2; ++half) {
    // Along the column in the upper row and down the right side, or the other way round.
    const float *col_row = half == 0 ? a : b, *top = half == 0 ? a + 1 : a, *bottom = half == 0 ? b + 1 : b;
    const float *icc = &inverse_cc_[half][first], *icr = &inverse_cr_[half][first], *irr = &inverse_rr_[half][first];
    PrincipalStretches({col_row, top, bottom, n}, icc, icr, irr, cells, stretch2);
    largest = std::max(largest, Largest(stretch2, cells));
  }
  return largest;
}

/// Sums over the triangles of a row of cells, weighted, for the nodes along it: g (cc, cr, rr), then G.
const float* TearWatch::FilteredRow(std::uint32_t row) {
  float* out = &filtered_[kSums * std::size_t{row} * cols_];
  if (filtered_look_[row] == look_) return out;
  filtered_look_[row] = look_;
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
      const float alive = rest_cc_[half][first + c] > 0.0f ? 1.0f : 0.0f;
      line_[c] += alive * (ux * ux + uy * uy + uz * uz);
      line_[n + c] += alive * (ux * vx + uy * vy + uz * vz);
      line_[2 * n + c] += alive * (vx * vx + vy * vy + vz * vz);
      line_[3 * n + c] += rest_cc_[half][first + c];
      line_[4 * n + c] += rest_cr_[half][first + c];
      line_[5 * n + c] += rest_rr_[half][first + c];
    }
  }
  for (std::size_t k = 0; k < kSums; ++k) {
    const float* in = &line_[k * n];
    float* sum = out + k * n;
    for (std::size_t i = 0; i < weight_col_.size(); ++i) {
      const float w = weight_col_[i];
      for (std::size_t c = 0; c + i < cells; ++c) sum[c] += w * in[c + i];  // To the right of node c.
      for (std::size_t c = i + 1; c < n; ++c) sum[c] += w * in[c - 1 - i];  // To its left.
    }
  }
  return out;
}

std::array<float, TearWatch::kSums> TearWatch::SumsAt(std::uint32_t row, std::uint32_t col) {
  std::array<float, kSums> sum{};
  for (std::uint32_t i = 0; i < weight_row_.size(); ++i) {
    for (int side = 0; side < 2; ++side) {
      if (side == 0 ? row + i + 1 >= rows_ : row < i + 1) continue;
      const float* in = FilteredRow(side == 0 ? row + i : row - 1 - i);
      for (std::size_t k = 0; k < kSums; ++k) sum[k] += weight_row_[i] * in[k * cols_ + col];
    }
  }
  return sum;
}

TearWatch::Principal TearWatch::At(std::uint32_t row, std::uint32_t col) {
  const auto sum = SumsAt(row, col);
  return PrincipalOf({sum[0], sum[1], sum[2]}, {sum[3], sum[4], sum[5]});
}

/// lambda of the nodes of a row; 0 at those without live triangles and in debris.
void TearWatch::SmoothRow(std::uint32_t row) {
  if (smooth_look_[row] == look_) return;
  smooth_look_[row] = look_;
  for (std::uint32_t col = 0; col < cols_; ++col) {
    const Index node = row * cols_ + col;
    const bool tissue = model_->NodeAlive(node) && !model_->IsDebris(node);
    const float stretch = tissue ? to_rest_ * std::sqrt(At(row, col).stretch2) : 0.0f;
    smooth_[node] = stretch > 0.0f ? stretch : 0.0f;  // Not for what is no number.
  }
}

float TearWatch::StretchAt(const Place& place) const {
  const float col = std::round(place.col), row = std::round(place.row);
  if (!(col >= 0.0f && row >= 0.0f && col < static_cast<float>(cols_) && row < static_cast<float>(rows_))) return 0;
  const auto r = static_cast<std::uint32_t>(row), c = static_cast<std::uint32_t>(col);
  return smooth_look_[r] == look_ ? smooth_[r * cols_ + c] : 0.0f;
}

float TearWatch::EdgeStretch2(Index edge) const {
  const Index a = edge / 3, b = OtherEnd(edge);
  const float now = (particles_->At(particles_->NodeRef(a / cols_, a % cols_)) -
                     particles_->At(particles_->NodeRef(b / cols_, b % cols_)))
                        .squaredNorm();
  const float rest = scene_.membrane_rest_length[edge];
  return to_rest_ * to_rest_ * now / (rest * rest);
}

void TearWatch::Tear(Index edge) {
  if (TestBit(torn_, edge) || !model_->EdgeAlive(edge / 3, static_cast<int>(edge % 3))) return;
  SetBit(torn_, edge);
  ++torn_count_;
  waiting_.push_back(edge);
}

void TearWatch::TearThreads() {
  for (const Index edge : threads_) {
    if (EdgeStretch2(edge) >= limit_ * limit_) Tear(edge);
  }
}

/// All edges that the straight line crosses.
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

/// From the most stretched place, which is at that node.
void TearWatch::Crack(std::uint32_t row, std::uint32_t col) {
  // Through the middle of an edge: at a node it would be chance on which side of it the crack goes.
  const Index node = row * cols_ + col;
  Index begin = kNoIndex;
  float most = 0;
  const auto look = [&](bool inside, Index a, Index d) {
    if (!inside || !model_->EdgeAlive(a, static_cast<int>(d)) || TestBit(torn_, 3 * a + d)) return;
    const float stretch2 = EdgeStretch2(3 * a + d);
    if (stretch2 > most) {
      most = stretch2;
      begin = 3 * a + d;
    }
  };
  for (Index d = 0; d < 3; ++d) look(true, node, d);
  look(col > 0, node - 1, 0);
  look(row > 0, node - cols_, 1);
  look(row > 0 && col > 0, node - cols_ - 1, 2);
  if (begin == kNoIndex) return;
  const Index a = begin / 3, b = OtherEnd(begin);
  const Index cols_sum = a % cols_ + b % cols_, rows_sum = a / cols_ + b / cols_;
  const Place middle{0.5f * static_cast<float>(cols_sum), 0.5f * static_cast<float>(rows_sum)};
  Tear(begin);

  const auto sum = SumsAt(row, col);  // Of these the metric at rest: 3, 4, 5.
  // Across: v . G w = 0. Of unit length in a typical cell, since the mean metric is a sum of some.
  const Place v = At(row, col).along;
  Place w{-(sum[4] * v.col + sum[5] * v.row), sum[3] * v.col + sum[4] * v.row};
  const float cell_col = scene_.membrane_rest_length[3 * a], cell_row = scene_.membrane_rest_length[3 * a + 1];
  const float length = std::hypot(w.col, w.row);
  if (!(length > 0.0f)) return;
  w = {w.col / length, w.row / length};
  const float metres = std::hypot(w.col * std::max(cell_col, 1e-6f), w.row * std::max(cell_row, 1e-6f));
  const int most_steps = std::max(2, static_cast<int>(kAdvance_m / (kCrackStep * metres)));
  Place ends[2];
  for (int way = 0; way < 2; ++way) {
    const float step = way == 0 ? kCrackStep : -kCrackStep;
    Place at = middle;
    for (int i = 0; i < most_steps; ++i) {
      at = {at.col + step * w.col, at.row + step * w.row};
      if (!(StretchAt(at) >= kNear * limit_)) break;
    }
    ends[way] = at;
  }
  TearAcross(ends[0], ends[1]);
}

/// What has torn is still to be severed, or has just been.
bool TearWatch::Waits() {
  if (std::exchange(restored_, false)) quiet_until_ = step_ + kPatience;
  if (std::exchange(followed_, false)) quiet_until_ = step_ + kRelax;
  std::erase_if(waiting_, [this](Index edge) { return !model_->EdgeAlive(edge / 3, static_cast<int>(edge % 3)); });
  if (!waiting_.empty() && step_ > torn_step_ + kPatience) waiting_.clear();
  return step_ < quiet_until_ || !waiting_.empty();
}

void TearWatch::RowsMoved(std::uint32_t first, std::uint32_t end, float moved) {
  if (limit_ == 0.0f) return;
  for (std::uint32_t row = first > 0 ? first - 1 : 0; row < std::min(end, rows_ - 1); ++row) row_moved_[row] += moved;
}

bool TearWatch::Look(std::uint64_t step) {
  if (limit_ == 0.0f || step % kEvery != 0) return false;
  step_ = step;
  ++look_;
  const float near = kNear * limit_ / to_rest_, near2 = near * near;
  const bool all = step % kEveryAll == 0;
  float largest2 = 0;
  std::uint32_t largest_row = 0;
  for (std::uint32_t row = 0; row + 1 < rows_; ++row) {
    // Of what was far from the limit and has not moved enough since, nothing new is to be learned.
    const bool may_be_near = std::sqrt(row_stretch2_[row]) + row_gain_[row] * row_moved_[row] >= near;
    if (row_moved_[row] > 0.0f && (all || may_be_near)) {
      row_stretch2_[row] = LargestInRow(row);
      row_moved_[row] = 0;
    }
    if (row_stretch2_[row] > largest2) {
      largest2 = row_stretch2_[row];
      largest_row = row;
    }
  }
  // Nodes of the rows near the limit, and those of the most stretched one.
  const auto reach = static_cast<std::uint32_t>(weight_row_.size());
  std::uint32_t worst_row = 0, worst_col = 0, done = 0;
  largest_ = 0;
  for (std::uint32_t row = 0; row + 1 < rows_; ++row) {
    if (row != largest_row && !(row_stretch2_[row] >= near2)) continue;
    const std::uint32_t end = std::min(row + reach + 1, rows_);
    for (std::uint32_t r = std::max(done, row + 1 > reach ? row + 1 - reach : 0); r < end; ++r) {
      SmoothRow(r);
      for (std::uint32_t c = 0; c < cols_; ++c) {
        if (smooth_[r * cols_ + c] > largest_) {
          largest_ = smooth_[r * cols_ + c];
          worst_row = r;
          worst_col = c;
        }
      }
    }
    done = std::max(done, end);
  }
  const bool waits = Waits();
  if (step_ >= quiet_until_) largest_ever_ = std::max(largest_ever_, largest_);
  if (waits) return false;
  const std::uint32_t before = torn_count_;
  TearThreads();
  if (largest_ >= limit_) Crack(worst_row, worst_col);
  if (torn_count_ != before) torn_step_ = step_;
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
  waiting_.clear();
  for (Index edge = 0; edge < 3 * rows_ * cols_; ++edge) {
    if (TestBit(torn_, edge)) waiting_.push_back(edge);
  }
  restored_ = true;
  followed_ = false;
  std::fill(row_moved_.begin(), row_moved_.end(), kUnknown);
}

}  // namespace fulcrum::physics
