#include "thermal_node/potential/multigrid.h"

#include <limits>

#include "thermal_node/heat/wide.h"

namespace fulcrum::thermal {
namespace {

/// Sweeps on the 2 x 2 level: enough that its error is negligible beside that of the finer levels.
constexpr int kCoarsestSweeps = 8;

}  // namespace

Level::Level(int size) : n(size), stride(size + kPad), count((size + 2) * stride + kPad) {
  for (auto* field : {&face_x, &face_y, &mass, &diag, &smooth, &x, &b, &r}) field->assign(count, 0.0f);
}

FULCRUM_WIDE
void Level::Finish() {
  for (int j = 0; j < n; ++j) {
    const int o = At(0, j);
    const float* __restrict fx = &face_x[o];
    const float* __restrict fy = &face_y[o];
    const float* __restrict m = &mass[o];
    float* __restrict d = &diag[o];
    float* __restrict s = &smooth[o];
    for (int i = 0; i < n; ++i) {
      d[i] = fx[i] + fx[i + 1] + fy[i] + fy[i + stride] + m[i];
      // diag is 0 for a cell without any conductance: no tissue, or on a coarse level a floating island. The sum of an
      // island's residuals is rounding error, which must not be divided by a tiny number.
      const float weight = kJacobiWeight / (d[i] + kTiny);
      s[i] = d[i] > 0.0f ? weight : 0.0f;
    }
  }
}

FULCRUM_WIDE
void Level::Apply(const float* v, float* out) const {
  for (int j = 0; j < n; ++j) {
    const int o = At(0, j);
    const float* __restrict c = v + o;
    const float* __restrict fx = &face_x[o];
    const float* __restrict fy = &face_y[o];
    const float* __restrict d = &diag[o];
    float* __restrict y = out + o;
    for (int i = 0; i < n; ++i) {
      y[i] = d[i] * c[i] - fx[i] * c[i - 1] - fx[i + 1] * c[i + 1] - fy[i] * c[i - stride] -
             fy[i + stride] * c[i + stride];
    }
  }
}

FULCRUM_WIDE
void Level::Residual() {
  for (int j = 0; j < n; ++j) {
    const int o = At(0, j);
    const float* __restrict c = &x[o];
    const float* __restrict fx = &face_x[o];
    const float* __restrict fy = &face_y[o];
    const float* __restrict d = &diag[o];
    const float* __restrict rhs = &b[o];
    float* __restrict y = &r[o];
    for (int i = 0; i < n; ++i) {
      y[i] = rhs[i] - (d[i] * c[i] - fx[i] * c[i - 1] - fx[i + 1] * c[i + 1] - fy[i] * c[i - stride] -
                       fy[i + stride] * c[i + stride]);
    }
  }
}

FULCRUM_WIDE
void Level::Smooth() {
  Residual();
  const float* __restrict s = smooth.data();
  const float* __restrict res = r.data();
  float* __restrict out = x.data();
  for (int k = 0; k < count; ++k) out[k] += s[k] * res[k];
}

FULCRUM_WIDE
void Coarsen(const Level& fine, Level* coarse) {
  const int fs = fine.stride;
  for (int j = 0; j < coarse->n; ++j) {
    for (int i = 0; i < coarse->n; ++i) {
      const int f = fine.At(2 * i, 2 * j);
      const int c = coarse->At(i, j);
      coarse->face_x[c] = 0.5f * (fine.face_x[f] + fine.face_x[f + fs]);
      coarse->face_y[c] = 0.5f * (fine.face_y[f] + fine.face_y[f + 1]);
      coarse->mass[c] = fine.mass[f] + fine.mass[f + 1] + fine.mass[f + fs] + fine.mass[f + fs + 1];
    }
  }
  coarse->Finish();
}

FULCRUM_WIDE
void Level::SmoothFromZero() {
  const float* __restrict s = smooth.data();
  const float* __restrict rhs = b.data();
  float* __restrict out = x.data();
  for (int k = 0; k < count; ++k) out[k] = s[k] * rhs[k];
}

/// Sets b of the coarse level to the sum of the fine residuals.
FULCRUM_WIDE
void Restrict(const Level& fine, Level* coarse) {
  const int s = fine.stride;
  for (int j = 0; j < coarse->n; ++j) {
    const float* __restrict r0 = &fine.r[fine.At(0, 2 * j)];
    const float* __restrict r1 = r0 + s;
    float* __restrict b = &coarse->b[coarse->At(0, j)];
    for (int i = 0; i < coarse->n; ++i) b[i] = (r0[2 * i] + r0[2 * i + 1]) + (r1[2 * i] + r1[2 * i + 1]);
  }
}

/// Adds the correction of each coarse cell to its four fine cells.
FULCRUM_WIDE
void Prolong(const Level& coarse, Level* fine) {
  for (int j = 0; j < coarse.n; ++j) {
    const float* __restrict e = &coarse.x[coarse.At(0, j)];
    float* __restrict x0 = &fine->x[fine->At(0, 2 * j)];
    float* __restrict x1 = x0 + fine->stride;
    for (int i = 0; i < coarse.n; ++i) {
      x0[2 * i] += e[i];
      x0[2 * i + 1] += e[i];
      x1[2 * i] += e[i];
      x1[2 * i + 1] += e[i];
    }
  }
}

void VCycle(std::vector<Level>* levels, std::size_t l) {
  Level& level = (*levels)[l];
  level.SmoothFromZero();
  if (l + 1 == levels->size()) {
    for (int sweep = 0; sweep < kCoarsestSweeps; ++sweep) level.Smooth();
    return;
  }
  level.Residual();
  Level& coarse = (*levels)[l + 1];
  Restrict(level, &coarse);
  VCycle(levels, l + 1);
  Prolong(coarse, &level);
  level.Smooth();
}

}  // namespace fulcrum::thermal
