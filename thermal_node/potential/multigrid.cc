#include "thermal_node/potential/multigrid.h"

#include "thermal_node/heat/wide.h"

namespace fulcrum::thermal {
namespace {

/// Sweeps on the 2 x 2 level: enough that its error is negligible beside that of the finer levels. Even: each one goes
/// from z to x or back.
constexpr int kCoarsestSweeps = 8;
static_assert(kCoarsestSweeps % 2 == 0);

// The kernels are inlined into the three functions at the end, which are compiled for each kind of CPU.

/// Sets diag and smooth.
template <int kSize>
[[gnu::always_inline]] inline void Finish(Level<kSize>* level) {
  constexpr int kUp = Level<kSize>::kStride;
  for (int j = 0; j < kSize; ++j) {
    const int o = Level<kSize>::At(0, j);
    const float* __restrict fx = &level->face_x[o];
    const float* __restrict fy = &level->face_y[o];
    const float* __restrict m = &level->mass[o];
    float* __restrict d = &level->diag[o];
    float* __restrict s = &level->smooth[o];
    for (int i = 0; i < kSize; ++i) {
      d[i] = fx[i] + fx[i + 1] + fy[i] + fy[i + kUp] + m[i];
      s[i] = kJacobiWeight / (d[i] + kTiny);
    }
    // diag is 0 for a cell without any conductance: no tissue, or on a coarse level a floating island. The sum of an
    // island's residuals is rounding error, which must not be divided by a tiny number. A loop of its own: in one the
    // choice would become a branch, which is not vectorised.
    for (int i = 0; i < kSize; ++i) s[i] = d[i] > 0.0f ? s[i] : 0.0f;
  }
}

/// (A v) of the cell i of a row, `v` and the faces at its first cell.
template <int kSize>
[[gnu::always_inline]] inline float Product(const Level<kSize>& level, int o, int i, const float* __restrict v) {
  constexpr int kUp = Level<kSize>::kStride;
  const float* fx = &level.face_x[o];
  const float* fy = &level.face_y[o];
  return level.diag[o + i] * v[i] - fx[i] * v[i - 1] - fx[i + 1] * v[i + 1] - fy[i] * v[i - kUp] -
         fy[i + kUp] * v[i + kUp];
}

/// z = b - A x.
template <int kSize>
[[gnu::always_inline]] inline void Residual(Level<kSize>* level) {
  for (int j = 0; j < kSize; ++j) {
    const int o = Level<kSize>::At(0, j);
    const float* __restrict b = &level->b[o];
    float* __restrict r = &level->z[o];
    for (int i = 0; i < kSize; ++i) r[i] = b[i] - Product(*level, o, i, &level->x[o]);
  }
}

/// to = from + smooth * (b - A from).
template <int kSize>
[[gnu::always_inline]] inline void Sweep(const Level<kSize>& level, const float* from, float* to) {
  for (int j = 0; j < kSize; ++j) {
    const int o = Level<kSize>::At(0, j);
    const float* __restrict v = from + o;
    const float* __restrict b = &level.b[o];
    const float* __restrict s = &level.smooth[o];
    float* __restrict out = to + o;
    for (int i = 0; i < kSize; ++i) out[i] = v[i] + s[i] * (b[i] - Product(level, o, i, v));
  }
}

/// One sweep from 0.
template <int kSize>
[[gnu::always_inline]] inline void SweepFromZero(const Level<kSize>& level, float* to) {
  for (int j = 0; j < kSize; ++j) {
    const int o = Level<kSize>::At(0, j);
    const float* __restrict b = &level.b[o];
    const float* __restrict s = &level.smooth[o];
    float* __restrict out = to + o;
    for (int i = 0; i < kSize; ++i) out[i] = s[i] * b[i];
  }
}

/// Faces and mass of the next coarser level.
template <int kSize>
[[gnu::always_inline]] inline void Coarsen(const Level<kSize>& fine, Level<kSize / 2>* coarse) {
  constexpr int kUp = Level<kSize>::kStride;
  for (int j = 0; j < kSize / 2; ++j) {
    const int f = Level<kSize>::At(0, 2 * j), c = Level<kSize / 2>::At(0, j);
    const float* __restrict fx = &fine.face_x[f];
    const float* __restrict fy = &fine.face_y[f];
    const float* __restrict m = &fine.mass[f];
    float* __restrict face_x = &coarse->face_x[c];
    float* __restrict face_y = &coarse->face_y[c];
    float* __restrict mass = &coarse->mass[c];
    for (int i = 0; i < kSize / 2; ++i) {
      face_x[i] = 0.5f * (fx[2 * i] + fx[2 * i + kUp]);
      face_y[i] = 0.5f * (fy[2 * i] + fy[2 * i + 1]);
      mass[i] = m[2 * i] + m[2 * i + 1] + m[2 * i + kUp] + m[2 * i + kUp + 1];
    }
  }
}

/// Sets b of the coarse level to the sum of the fine residuals.
template <int kSize>
[[gnu::always_inline]] inline void Restrict(const Level<kSize>& fine, Level<kSize / 2>* coarse) {
  for (int j = 0; j < kSize / 2; ++j) {
    const float* __restrict r0 = &fine.z[Level<kSize>::At(0, 2 * j)];
    const float* __restrict r1 = r0 + Level<kSize>::kStride;
    float* __restrict b = &coarse->b[Level<kSize / 2>::At(0, j)];
    for (int i = 0; i < kSize / 2; ++i) b[i] = (r0[2 * i] + r0[2 * i + 1]) + (r1[2 * i] + r1[2 * i + 1]);
  }
}

/// Adds the correction of each coarse cell to its four fine cells.
template <int kSize>
[[gnu::always_inline]] inline void Prolong(const Level<kSize / 2>& coarse, Level<kSize>* fine) {
  for (int j = 0; j < kSize / 2; ++j) {
    const float* __restrict e = &coarse.z[Level<kSize / 2>::At(0, j)];
    float* __restrict x0 = &fine->x[Level<kSize>::At(0, 2 * j)];
    float* __restrict x1 = x0 + Level<kSize>::kStride;
    for (int i = 0; i < kSize / 2; ++i) {
      x0[2 * i] += e[i];
      x0[2 * i + 1] += e[i];
      x1[2 * i] += e[i];
      x1[2 * i + 1] += e[i];
    }
  }
}

template <int kSize>
[[gnu::always_inline]] inline void SetUpFrom(Grid<kSize>* grid) {
  Finish(&grid->level);
  if constexpr (kSize > 2) {
    Coarsen(grid->level, &grid->coarser.level);
    SetUpFrom(&grid->coarser);
  }
}

template <int kSize>
[[gnu::always_inline]] inline void CycleFrom(Grid<kSize>* grid) {
  Level<kSize>& level = grid->level;
  if constexpr (kSize == 2) {
    SweepFromZero(level, level.z.data());
    for (int sweep = 0; sweep < kCoarsestSweeps; sweep += 2) {
      Sweep(level, level.z.data(), level.x.data());
      Sweep(level, level.x.data(), level.z.data());
    }
  } else {
    SweepFromZero(level, level.x.data());
    Residual(&level);
    Restrict(level, &grid->coarser.level);
    CycleFrom(&grid->coarser);
    Prolong(grid->coarser.level, &level);
    Sweep(level, level.x.data(), level.z.data());
  }
}

}  // namespace

FULCRUM_WIDE
void SetUp(Grid<kWindow>* grid) { SetUpFrom(grid); }

FULCRUM_WIDE
void Apply(const Fine& level, const Fine::Field& v, Fine::Field* out) {
  for (int j = 0; j < kWindow; ++j) {
    const int o = Fine::At(0, j);
    float* __restrict y = out->data() + o;
    for (int i = 0; i < kWindow; ++i) y[i] = Product(level, o, i, v.data() + o);
  }
}

FULCRUM_WIDE
void VCycle(Grid<kWindow>* grid) { CycleFrom(grid); }

}  // namespace fulcrum::thermal
