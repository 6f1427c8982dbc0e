// The levels above the particles at work: down to the coarse nodes, their solve, and up again.
#include <xmmintrin.h>

#include <algorithm>

#include "physics_node/accurate/coarse_space.h"

namespace fulcrum::physics::accurate {

void CoarseSpace::Solve(std::span<const Task> tasks, const float* row_sums, const float* tube_residual,
                        const float* tube) {
  std::fill_n(residual_.data(), residual_.size(), 0.0f);
  const std::size_t width = row_width();
  for (const Task& task : tasks) {
    if (!task.sheet) {
      continue;
    }
    for (auto row = static_cast<std::size_t>(task.first); row < static_cast<std::size_t>(task.end); ++row) {
      const float* sums = row_sums + row * width;
      float* low = residual_.data() + static_cast<std::size_t>(cell_[row]) * width;
      const __m128 up = _mm_set1_ps(fraction_[row]), down = _mm_set1_ps(1.0f - fraction_[row]);
      const std::size_t next = fraction_[row] > 0.0f ? width : 0;
      for (std::size_t i = 0; i < width; i += 4) {
        const __m128 sum = _mm_load_ps(sums + i);
        _mm_store_ps(low + i, _mm_add_ps(_mm_load_ps(low + i), _mm_mul_ps(down, sum)));
        _mm_store_ps(low + next + i, _mm_add_ps(_mm_load_ps(low + next + i), _mm_mul_ps(up, sum)));
      }
    }
  }
  if (!coarse_rests_) {
    std::fill_n(nodes4_.data(), nodes4_.size(), 0.0f);
    RestrictMiddle();
    for (const Task& task : tasks) {
      if (!task.sheet && !organ_alone_) {
        RestrictTube(task.first, task.end, tube_residual, tube);
      }
    }
    SolveCoarse();
  }
  ProlongMiddle();
}

void CoarseSpace::SolveCoarse() { factor_.Solve(kernels_, nodes4_.data()); }

/// Vertices that follow one another mostly lie in the same cell: what its nodes get is summed in registers.
void CoarseSpace::RestrictTube(int first, int end, const float* tube_residual, const float* tube) {
  if (first >= end) {
    return;
  }
  const auto at = static_cast<std::size_t>(first);
  const Weights8* cell = tube_weights_.data() + at;
  __m128 sum[8];
  std::fill(std::begin(sum), std::end(sum), _mm_setzero_ps());
  const auto flush = [&] {
    for (std::size_t i = 0; i < 8; ++i) {
      float* out = nodes4_.data() + 4 * std::size_t{cell->node[i]};
      _mm_store_ps(out, _mm_add_ps(_mm_load_ps(out), sum[i]));
    }
  };
  for (std::size_t v = at; v < static_cast<std::size_t>(end); ++v) {
    const Weights8& w = tube_weights_[v];
    if (w.node != cell->node) {
      flush();
      std::fill(std::begin(sum), std::end(sum), _mm_setzero_ps());
      cell = &w;
    }
    if (tube[4 * v + 3] > 0.0f) {
      const __m128 r = _mm_load_ps(tube_residual + 4 * v);
      for (std::size_t i = 0; i < 8; ++i) {
        sum[i] = _mm_add_ps(sum[i], _mm_mul_ps(_mm_set1_ps(w.weight[i]), r));
      }
    }
  }
  flush();
}

/// Right side of the coarse nodes from the middle level's residual: first along a row, then to the two coarse rows.
void CoarseSpace::RestrictMiddle() {
  __m128 sum[kSheetColumns + 1];
  for (std::size_t r = 0; r < static_cast<std::size_t>(middle_rows_); ++r) {
    const float *x = residual_.data() + 3 * r * width_, *y = x + width_, *z = y + width_;
    std::fill(std::begin(sum), std::end(sum), _mm_setzero_ps());
    for (std::size_t i = 0; i < width_; ++i) {
      const RowPlace column = column_place_[column_of_[i]];
      const auto c = static_cast<std::size_t>(column.cell);
      const __m128 value = _mm_mul_ps(_mm_set1_ps(yields_[r * width_ + i]), _mm_set_ps(0, z[i], y[i], x[i])),
                   part = _mm_mul_ps(_mm_set1_ps(column.fraction), value);
      sum[c] = _mm_add_ps(sum[c], _mm_sub_ps(value, part));
      sum[c + 1] = _mm_add_ps(sum[c + 1], part);
    }
    const RowPlace row = row_place_[static_cast<std::size_t>(centre_[r])];
    for (int i = 0; i < 2 && row.cell + i < coarse_rows_; ++i) {
      const __m128 weight = _mm_set1_ps(i == 0 ? 1 - row.fraction : row.fraction);
      float* to = nodes4_.data() + 4 * static_cast<std::size_t>((row.cell + i) * columns_);
      for (std::size_t c = 0; c < static_cast<std::size_t>(columns_); ++c, to += 4) {
        _mm_store_ps(to, _mm_add_ps(_mm_load_ps(to), _mm_mul_ps(weight, sum[c])));
      }
    }
  }
}

/// value <- B^-1 residual + what the coarse nodes say.
void CoarseSpace::ProlongMiddle() {
  std::array<std::array<float, 4>, kSheetColumns + 1> at_column{};
  for (std::size_t r = 0; r < static_cast<std::size_t>(middle_rows_); ++r) {
    if (middle_rests_[r] != 0) {
      continue;
    }
    const RowPlace row = row_place_[static_cast<std::size_t>(centre_[r])];
    const float* low = nodes4_.data() + 4 * static_cast<std::size_t>(row.cell * columns_);
    const float* high = row.cell + 1 < coarse_rows_ ? low + 4 * static_cast<std::size_t>(columns_) : low;
    for (std::size_t c = 0; c < static_cast<std::size_t>(columns_); ++c) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        at_column[c][axis] = (1 - row.fraction) * low[4 * c + axis] + row.fraction * high[4 * c + axis];
      }
    }
    const std::size_t at = 3 * r * width_, plane = r * width_;
    const float *x = residual_.data() + at, *y = x + width_, *z = y + width_;
    float* v = value_.data() + at;
    for (std::size_t i = 0; i < width_; ++i) {
      const RowPlace column = column_place_[column_of_[i]];
      const auto &a = at_column[static_cast<std::size_t>(column.cell)],
                 &b = at_column[static_cast<std::size_t>(column.cell) + 1];
      const std::size_t k = plane + i;
      const float up = column.fraction * yields_[k], down = yields_[k] - up;
      v[i] = block_[0][k] * x[i] + block_[3][k] * y[i] + block_[4][k] * z[i] + (down * a[0] + up * b[0]);
      v[width_ + i] = block_[3][k] * x[i] + block_[1][k] * y[i] + block_[5][k] * z[i] + (down * a[1] + up * b[1]);
      v[2 * width_ + i] = block_[4][k] * x[i] + block_[5][k] * y[i] + block_[2][k] * z[i] + (down * a[2] + up * b[2]);
    }
  }
}

double CoarseSpace::Prolong(const float* tube, const float* tube_residual, float* tube_z, int first, int end) const {
  double dot = 0;
  for (auto v = static_cast<std::size_t>(first); v < static_cast<std::size_t>(end); ++v) {
    float* z = tube_z + 4 * v;
    if (tube[4 * v + 3] > 0.0f && !coarse_rests_ && !organ_alone_) {
      const Weights8& w = tube_weights_[v];
      __m128 sum = _mm_load_ps(z);
      for (std::size_t i = 0; i < 8; ++i) {
        sum = _mm_add_ps(
            sum, _mm_mul_ps(_mm_set1_ps(w.weight[i]), _mm_load_ps(nodes4_.data() + 4 * std::size_t{w.node[i]})));
      }
      _mm_store_ps(z, sum);
    }
    const float* r = tube_residual + 4 * v;
    dot += static_cast<double>(r[0] * z[0] + r[1] * z[1] + r[2] * z[2]);
  }
  return dot;
}

}  // namespace fulcrum::physics::accurate
