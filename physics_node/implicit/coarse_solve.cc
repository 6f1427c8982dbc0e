// One application of the levels above the particles: restriction to hats and coarse nodes, the coarse solve, and
// prolongation to the hats and the organ. (Hats to the membrane: SheetKernels::precondition.)
#include <algorithm>

#include "physics_node/implicit/coarse_space.h"
#include "physics_node/simd/sse.h"

namespace fulcrum::physics::implicit {
namespace {

/// Floats of a register of SSE, in which the loops of this file run.
constexpr std::size_t kSse = 4;
/// Tasks of the prolongation to the hats: a few microseconds each. Assumed.
constexpr int kProlongTasks = 4;

}  // namespace

void CoarseSpace::Solve(std::span<const Task> tasks, const float* row_sums, const float* tube_residual,
                        const float* tube, Workers* workers) {
  // The two layers are restricted side by side, each to memory of its own.
  workers->Run(coarse_off_ ? 1 : 2, 0, [&](int layer, int) {
    if (layer == 0) {
      SumRows(tasks, row_sums);
      if (!coarse_off_) RestrictHats();
      return;
    }
    std::fill_n(scratch_.tube_nodes4.data(), scratch_.tube_nodes4.size(), 0.0f);
    for (const Task& task : tasks) {
      if (!task.sheet) {
        RestrictTube(task.first, task.end, tube_residual, tube);
      }
    }
  });
  if (!coarse_off_) {
    for (std::size_t i = 0; i < scratch_.nodes4.size(); ++i) {
      scratch_.nodes4[i] += scratch_.tube_nodes4[i];
    }
    const auto clear = [this](std::size_t node) {
      std::fill_n(scratch_.nodes4.data() + kVertexFloats * node, kVertexFloats, 0.0f);
    };
    for (const int node : grid_.off) clear(static_cast<std::size_t>(node));
    for (const std::uint32_t node : grid_.folded) clear(node);
    matrix_.factor.Solve(kernels_, scratch_.nodes4.data(), matrix_.left_out);
    // Their neighbours in the matrix have moved them.
    for (const std::uint32_t node : grid_.folded) clear(node);
  }
  workers->Run(kProlongTasks, 0, [&](int task, int) {
    ProlongToHats(hats_.rows * task / kProlongTasks, hats_.rows * (task + 1) / kProlongTasks);
  });
}

void CoarseSpace::SumRows(std::span<const Task> tasks, const float* row_sums) {
  std::fill_n(scratch_.residual.data(), scratch_.residual.size(), 0.0f);
  const std::size_t width = row_width();
  for (const Task& task : tasks) {
    if (!task.sheet) {
      continue;
    }
    for (auto row = static_cast<std::size_t>(task.first); row < static_cast<std::size_t>(task.end); ++row) {
      const float* sums = row_sums + row * width;
      float* low = scratch_.residual.data() + static_cast<std::size_t>(hats_.cell[row]) * width;
      const __m128 up = _mm_set1_ps(hats_.fraction[row]), down = _mm_set1_ps(1.0f - hats_.fraction[row]);
      const std::size_t next = hats_.fraction[row] > 0.0f ? width : 0;
      for (std::size_t i = 0; i < width; i += kSse) {
        const __m128 sum = _mm_load_ps(sums + i);
        _mm_store_ps(low + i, _mm_add_ps(_mm_load_ps(low + i), _mm_mul_ps(down, sum)));
        _mm_store_ps(low + next + i, _mm_add_ps(_mm_load_ps(low + next + i), _mm_mul_ps(up, sum)));
      }
    }
  }
}

/// Vertices that follow one another mostly lie in the same cell, so the sums of its nodes stay in registers.
void CoarseSpace::RestrictTube(int first, int end, const float* tube_residual, const float* tube) {
  if (first >= end) {
    return;
  }
  const auto at = static_cast<std::size_t>(first);
  const LatticePlace* cell = grid_.tube_weights.data() + at;
  __m128 sum[kCellCorners];
  std::fill(std::begin(sum), std::end(sum), _mm_setzero_ps());
  const auto flush = [&] {
    for (std::size_t i = 0; i < kCellCorners; ++i) {
      float* out = scratch_.tube_nodes4.data() + kVertexFloats * std::size_t{cell->node[i]};
      _mm_store_ps(out, _mm_add_ps(_mm_load_ps(out), sum[i]));
    }
  };
  for (std::size_t v = at; v < static_cast<std::size_t>(end); ++v) {
    const LatticePlace& w = grid_.tube_weights[v];
    if (w.new_cell) {
      flush();
      std::fill(std::begin(sum), std::end(sum), _mm_setzero_ps());
      cell = &w;
    }
    if (tube[kVertexFloats * v + 3] > 0.0f) {
      const __m128 r = _mm_load_ps(tube_residual + kVertexFloats * v);
      for (std::size_t i = 0; i < kCellCorners; ++i) {
        sum[i] = _mm_add_ps(sum[i], _mm_mul_ps(_mm_set1_ps(w.weight[i]), r));
      }
    }
  }
  flush();
}

/// Right side of the coarse nodes from the hats' residual: first along a row, then to the two coarse rows.
void CoarseSpace::RestrictHats() {
  std::fill_n(scratch_.nodes4.data(), scratch_.nodes4.size(), 0.0f);
  for (std::size_t r = 0; r < static_cast<std::size_t>(hats_.rows); ++r) {
    const float *x = scratch_.residual.data() + 3 * r * hats_.width, *y = x + hats_.width, *z = y + hats_.width;
    const float* weight_of_hat = contacts_.coarse_weight.data() + r * hats_.width;
    const auto centre = static_cast<std::size_t>(hats_.centre[r]);
    const CellPlace row = grid_.row_place[centre];
    const CoarseGrid::Columns& columns = grid_.sheets[grid_.sheet_of[centre]];
    for (std::size_t c = 0; c < static_cast<std::size_t>(grid_.columns); ++c) {
      const float* share = columns.share.data() + c * hats_.width;
      __m128 sum_x = _mm_setzero_ps(), sum_y = sum_x, sum_z = sum_x, none = sum_x;
      for (std::size_t i = 0; i < hats_.width; i += kSse) {
        const __m128 w = _mm_mul_ps(_mm_load_ps(share + i), _mm_loadu_ps(weight_of_hat + i));
        sum_x = _mm_add_ps(sum_x, _mm_mul_ps(w, _mm_load_ps(x + i)));
        sum_y = _mm_add_ps(sum_y, _mm_mul_ps(w, _mm_load_ps(y + i)));
        sum_z = _mm_add_ps(sum_z, _mm_mul_ps(w, _mm_load_ps(z + i)));
      }
      _MM_TRANSPOSE4_PS(sum_x, sum_y, sum_z, none);
      const __m128 sum = _mm_add_ps(_mm_add_ps(sum_x, sum_y), _mm_add_ps(sum_z, none));
      for (int i = 0; i < 2 && row.cell + i < grid_.rows; ++i) {
        float* to =
            scratch_.nodes4.data() + kVertexFloats * (static_cast<std::size_t>((row.cell + i) * grid_.columns) + c);
        const __m128 weight = _mm_set1_ps(i == 0 ? 1 - row.fraction : row.fraction);
        _mm_store_ps(to, _mm_add_ps(_mm_load_ps(to), _mm_mul_ps(weight, sum)));
      }
    }
  }
}

/// The hats' correction: their blocks times the residual, and the weighted part of the coarse nodes.
void CoarseSpace::ProlongToHats(int first, int end) {
  for (auto r = static_cast<std::size_t>(first); r < static_cast<std::size_t>(end); ++r) {
    if (blocks_.off[r] != 0) {
      continue;
    }
    const auto centre = static_cast<std::size_t>(hats_.centre[r]);
    const CellPlace row = grid_.row_place[centre];
    const CoarseGrid::Columns& columns = grid_.sheets[grid_.sheet_of[centre]];
    const float* low = scratch_.nodes4.data() + kVertexFloats * static_cast<std::size_t>(row.cell * grid_.columns);
    const float* high = row.cell + 1 < grid_.rows ? low + kVertexFloats * static_cast<std::size_t>(grid_.columns) : low;
    const std::size_t at = 3 * r * hats_.width, plane = r * hats_.width;
    for (std::size_t i = 0; i < hats_.width; i += kSse) {
      __m128 coarse[3] = {_mm_setzero_ps(), _mm_setzero_ps(), _mm_setzero_ps()}, b[6], v[3];
      for (std::size_t c = 0; c < static_cast<std::size_t>(grid_.columns); ++c) {
        const __m128 share = _mm_load_ps(columns.share.data() + c * hats_.width + i);
        for (std::size_t axis = 0; axis < 3; ++axis) {
          const float node =
              (1 - row.fraction) * low[kVertexFloats * c + axis] + row.fraction * high[kVertexFloats * c + axis];
          coarse[axis] = _mm_add_ps(coarse[axis], _mm_mul_ps(share, _mm_set1_ps(node)));
        }
      }
      for (std::size_t k = 0; k < 6; ++k) {
        b[k] = _mm_load_ps(blocks_.inverse[k].data() + plane + i);
      }
      for (std::size_t axis = 0; axis < 3; ++axis) {
        v[axis] = _mm_load_ps(scratch_.residual.data() + at + axis * hats_.width + i);
      }
      const __m128 coarse_weight = _mm_loadu_ps(contacts_.coarse_weight.data() + plane + i);
      const auto put = [&](std::size_t axis, __m128 bx, __m128 by, __m128 bz) {
        const __m128 own = _mm_add_ps(_mm_add_ps(_mm_mul_ps(bx, v[0]), _mm_mul_ps(by, v[1])), _mm_mul_ps(bz, v[2]));
        _mm_store_ps(scratch_.value.data() + at + axis * hats_.width + i,
                     _mm_add_ps(own, _mm_mul_ps(coarse_weight, coarse[axis])));
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
    float* z = tube_z + kVertexFloats * v;
    if (tube[kVertexFloats * v + 3] > 0.0f && !coarse_off_) {
      const LatticePlace& w = grid_.tube_weights[v];
      __m128 sum = _mm_load_ps(z);
      for (std::size_t i = 0; i < kCellCorners; ++i) {
        sum = _mm_add_ps(sum, _mm_mul_ps(_mm_set1_ps(w.weight[i]),
                                         _mm_load_ps(scratch_.nodes4.data() + kVertexFloats * std::size_t{w.node[i]})));
      }
      _mm_store_ps(z, sum);
    }
    const float* r = tube_residual + kVertexFloats * v;
    dot += static_cast<double>(r[0] * z[0] + r[1] * z[1] + r[2] * z[2]);
  }
  return dot;
}

}  // namespace fulcrum::physics::implicit
