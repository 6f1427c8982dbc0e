// Kernels of HeatField's explicit step: fluxes and temperatures; conductances are in faces.cc.
//
//   dH_c/dt = 1/(sqrt(g) W) (sum over faces of F - sum over faces of F') - loss theta_c,   theta = H / rc(water)
//   f = G (theta_a - theta_b),   F = clamp(f - f'' / 12, 0, gain f), near a front f
//
// H enthalpy of cell c [J/m^3], theta temperature above body temperature [K], rc heat capacity [J/(m^3 K)], g
// metric of the rest shape over material space, W volume of a cell there [m^3], G conductance of a face, f two-point
// flux through the face from a to b, f'' its second difference along the line of faces, F inflow, F' outflow, loss sink
// per kelvin [W/(m^3 K)]. The arrays hold G / W, so fluxes are in W/m^3.
//
// Stencil: five cells along s and five along t; with shear also the two cells at the ends of one diagonal, the one
// that the sign of g^st selects, with two-point fluxes.
#include <algorithm>
#include <cmath>
#include <limits>

#include "thermal_node/heat/heat_field.h"
#include "thermal_node/heat/wide.h"

namespace fulcrum::thermal {
namespace {

/// Flux through a face from its two-point flux and those of the faces before and after it on its line. The divergence
/// of f - f'' / 12 is of fourth order where f is smooth. The result is limited to between 0 and `gain` times the
/// two-point flux, so it remains a conductance times the difference of the two cells: the maximum principle holds,
/// closed faces stay closed, and both cells of the face get the same flux.
[[gnu::always_inline]] inline float Limited(float f, float flux, float gain) {
  // Not a literal: the compiler would take two operations for a maximum with 0.
  const float most = gain * flux, zero = gain - gain;
  const float low = most < zero ? most : zero, high = most > zero ? most : zero;
  const float above = f > low ? f : low;
  return above < high ? above : high;
}
/// The limited flux; with kFront, where `smooth` is 0 instead of 1, the two-point flux: a product, because a choice is
/// not vectorised.
template <bool kFront>
[[gnu::always_inline]] inline float FourthOrder(float before, float flux, float after, float gain,
                                                const float* __restrict smooth) {
  const float fourth = (14.0f / 12.0f) * flux - (1.0f / 12.0f) * (before + after);
  if constexpr (!kFront) return Limited(fourth, flux, gain);
  return Limited(*smooth * fourth + (1.0f - *smooth) * flux, flux, gain);
}

/// One stage for the rows of the tile: enthalpy <- enthalpy + dt dH/dt, with `loss` = dt times the sink per kelvin.
/// kMain, kAnti: the tile has links along that diagonal.
template <bool kMain, bool kAnti, bool kFront>
[[gnu::always_inline]] inline void Stage(Tile* tile, float dt_s, float gain, float loss) {
  // Each pass covers the whole tile: a shifted read of values that were just written would stall until the store has
  // completed.
  alignas(64) float across_s[kTile * kFaceStride], across_t[(kTile + 3) * kTile];
  alignas(64) float face_s[kTile * kFaceStride], face_t[(kTile + 1) * kTile];
  for (int j = -1; j <= kTile + 1; ++j) {
    const float* __restrict t = &tile->theta[ThetaIndex(0, j)];
    const float* __restrict g = &tile->face_t[FaceT(0, j)];
    float* __restrict f = &across_t[FaceT(0, j)];
    for (int i = 0; i < kTile; ++i) f[i] = g[i] * (t[i - kThetaStride] - t[i]);
  }
  for (int j = 0; j < kTile; ++j) {
    const float* __restrict t = &tile->theta[ThetaIndex(0, j)];
    const float* __restrict g = &tile->face_s[FaceS(0, j)];
    float* __restrict f = &across_s[FaceS(0, j)];
    for (int i = -8; i < kTile + 8; ++i) f[i] = g[i] * (t[i - 1] - t[i]);  // whole vectors; beyond the halo g is 0
  }
  for (int j = 0; j < kTile; ++j) {
    const float* __restrict f = &across_s[FaceS(0, j)];
    const float* __restrict smooth = kFront ? &tile->smooth_s[FaceS(0, j)] : nullptr;
    float* __restrict face = &face_s[FaceS(0, j)];
    for (int i = 0; i <= kTile; ++i)
      face[i] = FourthOrder<kFront>(f[i - 1], f[i], f[i + 1], gain, kFront ? smooth + i : nullptr);
  }
  const float* __restrict smooth_t = kFront ? &tile->smooth_t[FaceT(0, 0)] : nullptr;
  const float* __restrict f = &across_t[FaceT(0, 0)];
  for (int i = 0; i < (kTile + 1) * kTile; ++i) {
    face_t[i] = FourthOrder<kFront>(f[i - kTile], f[i], f[i + kTile], gain, kFront ? smooth_t + i : nullptr);
  }
  for (int j = 0; j < kTile; ++j) {
    const float* __restrict t = &tile->theta[ThetaIndex(0, j)];
    const float* __restrict fs = &face_s[FaceS(0, j)];
    const float* __restrict ft = &face_t[j * kTile];
    const float* __restrict inverse_area = &tile->geometry.inverse_area[j * kTile];
    float* __restrict h = &tile->state.enthalpy[j * kTile];
    const float* __restrict l = kMain || kAnti ? &tile->links[Corner(0, j)] : nullptr;
    for (int i = 0; i < kTile; ++i) {
      float flux = (fs[i] - fs[i + 1]) + (ft[i] - ft[i + kTile]);
      const float* up = &t[i - kThetaStride];
      const float* down = &t[i + kThetaStride];
      // With links along one diagonal only, all have the sign of that diagonal.
      if constexpr (kMain && kAnti) {
        flux += Main(l[i]) * (up[-1] - t[i]) + Main(l[i + kCornerStride + 1]) * (down[1] - t[i]) +
                Anti(l[i + 1]) * (up[1] - t[i]) + Anti(l[i + kCornerStride]) * (down[-1] - t[i]);
      } else if constexpr (kMain) {
        flux += l[i] * (up[-1] - t[i]) + l[i + kCornerStride + 1] * (down[1] - t[i]);
      } else if constexpr (kAnti) {
        flux += l[i + 1] * (t[i] - up[1]) + l[i + kCornerStride] * (t[i] - down[-1]);
      }
      h[i] += dt_s * inverse_area[i] * flux - loss * t[i];
    }
  }
}

FULCRUM_WIDE
void StageOfTile(Tile* tile, float dt_s, float gain, float loss) {
  const bool main = tile->geometry.has_main, anti = tile->geometry.has_anti, sheared = main || anti;
  if (!tile->smooth_s.empty()) {
    sheared ? Stage<true, true, true>(tile, dt_s, gain, loss) : Stage<false, false, true>(tile, dt_s, gain, loss);
  } else if (main) {
    anti ? Stage<true, true, false>(tile, dt_s, gain, loss) : Stage<true, false, false>(tile, dt_s, gain, loss);
  } else {
    anti ? Stage<false, true, false>(tile, dt_s, gain, loss) : Stage<false, false, false>(tile, dt_s, gain, loss);
  }
}

/// Averages the enthalpy after the last stage with that before the step, whose weight is `first`; see DiffuseIsland.
FULCRUM_WIDE
void Average(float first, const float* __restrict before, float* __restrict h) {
  for (int k = 0; k < kTileCells; ++k) h[k] += first * (before[k] - h[k]);
}

/// Computes theta, its column sums and extremes; rc = rc_dry + water * rc_water.
FULCRUM_WIDE
void ThetaOf(Tile* tile, float rc_dry, float rc_water) {
  alignas(64) float sum[kTile] = {}, high[kTile] = {}, low[kTile] = {}, odd[kTile] = {};
  for (int j = 0; j < kTile; ++j) {
    float* __restrict t = &tile->theta[ThetaIndex(0, j)];
    const float* __restrict h = &tile->state.enthalpy[j * kTile];
    const float* __restrict w = &tile->state.water[j * kTile];
    const float* __restrict area = &tile->geometry.area[j * kTile];
    for (int i = 0; i < kTile; ++i) {
      t[i] = h[i] / (rc_dry + w[i] * rc_water);
      sum[i] += t[i] * area[i];
      high[i] = high[i] > t[i] ? high[i] : t[i];
      low[i] = low[i] < t[i] ? low[i] : t[i];
      const float off = std::abs(w[i] - 0.5f);
      odd[i] = odd[i] > off ? odd[i] : off;
    }
  }
  std::copy_n(sum, kTile, tile->theta_sum.begin());
  tile->theta_max = *std::max_element(high, high + kTile);
  tile->theta_min = *std::min_element(low, low + kTile);
  tile->water_off = *std::max_element(odd, odd + kTile);
}

/// Computes theta and its column sums between the stages. Values that are not finite are replaced by 0, so that the
/// next stage does not spread them to neighbours; the cells are quarantined after the last stage.
FULCRUM_WIDE
void MiddleThetaOf(Tile* tile, float rc_dry, float rc_water) {
  alignas(64) float sum[kTile] = {};
  for (int j = 0; j < kTile; ++j) {
    float* __restrict t = &tile->theta[ThetaIndex(0, j)];
    const float* __restrict h = &tile->state.enthalpy[j * kTile];
    const float* __restrict w = &tile->state.water[j * kTile];
    const float* __restrict area = &tile->geometry.area[j * kTile];
    for (int i = 0; i < kTile; ++i) {
      const float theta = h[i] / (rc_dry + w[i] * rc_water);
      const float size = theta < 0.0f ? -theta : theta;
      t[i] = size <= kThetaPlausible ? theta : 0.0f;
      sum[i] += t[i] * area[i];
    }
  }
  std::copy_n(sum, kTile, tile->theta_sum.begin());
}

}  // namespace

void HeatField::ExchangeHalos(Tile* tile) {
  // Every face to an absent or sleeping neighbour is closed, so the old value in its halo has no effect; it is finite.
  const std::array<const Tile*, 9> around = Around(*tile);
  float* theta = tile->theta.data();
  for (const auto& [other, to, from] : {std::tuple{around[3], -kHalo, kTile - kHalo}, {around[5], kTile, 0}}) {
    if (other == nullptr) continue;
    for (int j = 0; j < kTile; ++j) {
      std::copy_n(&other->theta[ThetaIndex(from, j)], kHalo, &theta[ThetaIndex(to, j)]);
    }
  }
  for (const auto& [other, to, from] : {std::tuple{around[1], -kHalo, kTile - kHalo}, {around[7], kTile, 0}}) {
    if (other == nullptr) continue;
    for (int j = 0; j < kHalo; ++j) {
      std::copy_n(&other->theta[ThetaIndex(0, from + j)], kTile, &theta[ThetaIndex(0, to + j)]);
    }
  }
  if (tile->links.empty()) return;
  for (const auto& [other, i, j] :
       {std::tuple{around[0], -1, -1}, {around[2], kTile, -1}, {around[6], -1, kTile}, {around[8], kTile, kTile}}) {
    if (other == nullptr) continue;
    theta[ThetaIndex(i, j)] = other->theta[ThetaIndex((i + kTile) % kTile, (j + kTile) % kTile)];
  }
}

void HeatField::RunStage(Tile* tile, const StageOf& stage, Ledger* ledger) {
  const float loss = stage.sink ? stage.dt_s * SinkOf(*tile) : 0.0f;
  const float first = 1.0f / static_cast<float>(stage.count);
  if (stage.index == 0) tile->before = tile->state.enthalpy;
  StageOfTile(tile, stage.dt_s, stage.gain, loss);
  if (stage.last()) Average(first, tile->before.data(), tile->state.enthalpy.data());
  double sum = 0;
  for (const float s : tile->theta_sum) sum += s;
  ledger->lost += static_cast<double>(1.0f - first) * sum * loss * tile->flat_volume;
}

void HeatField::Cool(Tile* tile, float dt_s, Ledger* ledger) const {
  const float loss = dt_s * SinkOf(*tile);
  const double before = tile->Heat();
  for (int cell = 0; cell < kTileCells; ++cell) {
    tile->state.enthalpy[cell] *= std::exp(-loss / tile->material->HeatCapacity(tile->state.water[cell]));
  }
  ledger->lost += before - tile->Heat();
}

void HeatField::ComputeMiddleTheta(Tile* tile) const {
  MiddleThetaOf(tile, tile->material->rc_dry, tile->material->rc_wet - tile->material->rc_dry);
}

void HeatField::RefreshTheta(Tile* tile, Ledger* ledger) {
  ThetaOf(tile, tile->material->rc_dry, tile->material->rc_wet - tile->material->rc_dry);
  float total = 0;
  for (const float s : tile->theta_sum) total += s;
  if (!std::isfinite(total) || tile->theta_max > kThetaPlausible || tile->theta_min < -kThetaPlausible ||
      tile->water_off > 0.5f) {
    Quarantine(tile, ledger);
  }
}

}  // namespace fulcrum::thermal
