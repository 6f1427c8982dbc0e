// The levels above the particles at work: down to the coarse nodes, their solve, and up again.
#include <algorithm>

#include "physics_node/implicit/coarse_space.h"
#include "physics_node/simd/sse.h"

namespace fulcrum::physics::implicit {

void CoarseSpace::Solve(std::span<const Task> tasks, const float* row_sums, const float* tube_residual,
                        const float* tube, Workers* workers) {
  // The two layers give to the coarse nodes apart from each other.
  workers->Run(coarse_rests_ ? 1 : 2, 0, [&](int layer, int) {
    if (layer == 0) {
      SumRows(tasks, row_sums);
      if (!coarse_rests_) RestrictMiddle();
      return;
    }
    std::fill_n(tube_nodes4_.data(), tube_nodes4_.size(), 0.0f);
    for (const Task& task : tasks) {
      if (!task.sheet && !organ_alone_) {
        RestrictTube(task.first, task.end, tube_residual, tube);
      }
    }
  });
  if (!coarse_rests_) {
    for (std::size_t i = 0; i < nodes4_.size(); ++i) {
      nodes4_[i] += tube_nodes4_[i];
    }
    factor_.Solve(kernels_, nodes4_.data());
  }
  constexpr int kPieces = 4;
  workers->Run(kPieces, 0, [&](int piece, int) {
    ProlongMiddle(middle_rows_ * piece / kPieces, middle_rows_ * (piece + 1) / kPieces);
  });
}

void CoarseSpace::SumRows(std::span<const Task> tasks, const float* row_sums) {
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
}

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
      float* out = tube_nodes4_.data() + 4 * std::size_t{cell->node[i]};
      _mm_store_ps(out, _mm_add_ps(_mm_load_ps(out), sum[i]));
    }
  };
  for (std::size_t v = at; v < static_cast<std::size_t>(end); ++v) {
    const Weights8& w = tube_weights_[v];
    if (w.new_cell) {
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
  std::fill_n(nodes4_.data(), nodes4_.size(), 0.0f);
  for (std::size_t r = 0; r < static_cast<std::size_t>(middle_rows_); ++r) {
    const float *x = residual_.data() + 3 * r * width_, *y = x + width_, *z = y + width_;
    const float* yields = yields_.data() + r * width_;
    const RowPlace row = row_place_[static_cast<std::size_t>(centre_[r])];
    for (std::size_t c = 0; c < static_cast<std::size_t>(columns_); ++c) {
      const float* share = column_share_.data() + c * width_;
      __m128 sum_x = _mm_setzero_ps(), sum_y = sum_x, sum_z = sum_x, none = sum_x;
      for (std::size_t i = 0; i < width_; i += 4) {
        const __m128 w = _mm_mul_ps(_mm_load_ps(share + i), _mm_loadu_ps(yields + i));
        sum_x = _mm_add_ps(sum_x, _mm_mul_ps(w, _mm_load_ps(x + i)));
        sum_y = _mm_add_ps(sum_y, _mm_mul_ps(w, _mm_load_ps(y + i)));
        sum_z = _mm_add_ps(sum_z, _mm_mul_ps(w, _mm_load_ps(z + i)));
      }
      _MM_TRANSPOSE4_PS(sum_x, sum_y, sum_z, none);
      const __m128 sum = _mm_add_ps(_mm_add_ps(sum_x, sum_y), _mm_add_ps(sum_z, none));
      for (int i = 0; i < 2 && row.cell + i < coarse_rows_; ++i) {
        float* to = nodes4_.data() + 4 * (static_cast<std::size_t>((row.cell + i) * columns_) + c);
        const __m128 weight = _mm_set1_ps(i == 0 ? 1 - row.fraction : row.fraction);
        _mm_store_ps(to, _mm_add_ps(_mm_load_ps(to), _mm_mul_ps(weight, sum)));
      }
    }
  }
}

/// The middle level's value: its blocks times the residual, and the coarse nodes' part where it yields.
void CoarseSpace::ProlongMiddle(int first, int end) {
  for (auto r = static_cast<std::size_t>(first); r < static_cast<std::size_t>(end); ++r) {
    if (middle_rests_[r] != 0) {
      continue;
    }
    const RowPlace row = row_place_[static_cast<std::size_t>(centre_[r])];
    const float* low = nodes4_.data() + 4 * static_cast<std::size_t>(row.cell * columns_);
    const float* high = row.cell + 1 < coarse_rows_ ? low + 4 * static_cast<std::size_t>(columns_) : low;
    const std::size_t at = 3 * r * width_, plane = r * width_;
    for (std::size_t i = 0; i < width_; i += 4) {
      __m128 far[3] = {_mm_setzero_ps(), _mm_setzero_ps(), _mm_setzero_ps()}, b[6], v[3];
      for (std::size_t c = 0; c < static_cast<std::size_t>(columns_); ++c) {
        const __m128 share = _mm_load_ps(column_share_.data() + c * width_ + i);
        for (std::size_t axis = 0; axis < 3; ++axis) {
          const float node = (1 - row.fraction) * low[4 * c + axis] + row.fraction * high[4 * c + axis];
          far[axis] = _mm_add_ps(far[axis], _mm_mul_ps(share, _mm_set1_ps(node)));
        }
      }
      for (std::size_t k = 0; k < 6; ++k) {
        b[k] = _mm_load_ps(block_[k].data() + plane + i);
      }
      for (std::size_t axis = 0; axis < 3; ++axis) {
        v[axis] = _mm_load_ps(residual_.data() + at + axis * width_ + i);
      }
      const __m128 yields = _mm_loadu_ps(yields_.data() + plane + i);
      const auto put = [&](std::size_t axis, __m128 bx, __m128 by, __m128 bz) {
        const __m128 near = _mm_add_ps(_mm_add_ps(_mm_mul_ps(bx, v[0]), _mm_mul_ps(by, v[1])), _mm_mul_ps(bz, v[2]));
        _mm_store_ps(value_.data() + at + axis * width_ + i, _mm_add_ps(near, _mm_mul_ps(yields, far[axis])));
      };
      put(0, b[0], b[3], b[4]);
      put(1, b[3], b[1], b[5]);
      put(2, b[4], b[5], b[2]);
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

}  // namespace fulcrum::physics::implicit
