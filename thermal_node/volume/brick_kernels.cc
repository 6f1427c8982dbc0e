#include "thermal_node/volume/brick_kernels.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "thermal_node/damage/arrhenius.h"
#include "thermal_node/heat/wide.h"

namespace fulcrum::thermal {
namespace {

/// Sum and maximum of a row's cells by repeated halving: an order that is the same with any vector width.
inline float SumRow(float* values) {
  for (int width = kBrick / 2; width > 0; width /= 2) {
    for (int i = 0; i < width; ++i) values[i] += values[i + width];
  }
  return values[0];
}
inline float MaxRow(float* values) {
  for (int width = kBrick / 2; width > 0; width /= 2) {
    for (int i = 0; i < width; ++i) values[i] = values[i] > values[i + width] ? values[i] : values[i + width];
  }
  return values[0];
}

}  // namespace

FULCRUM_WIDE
void ConductLayer(Brick* brick, int k, const LayerStep& step) {
  const WarmBox box = brick->box;
  const int count = box.col1 - box.col0;
  const float cs = step.along_s, ct = step.along_t, above = step.above, below = step.below, loss = step.loss;
  for (int j = box.row0; j < box.row1; ++j) {
    const float* __restrict t = &brick->theta[BrickThetaIndex(box.col0, j, k)];
    // At the border of the box the row itself is used as its neighbour, so that no heat crosses. At the border of the
    // brick there is a halo row.
    const float* __restrict before = j > box.row0 || j == 0 ? t - kBrickStride : t;
    const float* __restrict after = j + 1 < box.row1 || j + 1 == kBrick ? t + kBrickStride : t;
    const float* __restrict up = k > 0 ? t - kLayerStride : t;
    const float* __restrict down = k + 1 < box.layers ? t + kLayerStride : t;
    float* __restrict h = &brick->enthalpy[BrickIndex(box.col0, j, k)];
    for (int i = 0; i < count; ++i) {
      h[i] += cs * ((t[i - 1] - t[i]) + (t[i + 1] - t[i])) + ct * ((before[i] - t[i]) + (after[i] - t[i])) +
              above * (up[i] - t[i]) + below * (down[i] - t[i]) - loss * t[i];
    }
    if (step.source == 0.0f) continue;
    const float* __restrict q = &brick->source[j * kBrick + box.col0];
    for (int i = 0; i < count; ++i) h[i] += step.source * q[i];
  }
}

FULCRUM_WIDE
double ApplyLid(Brick* brick, float dt_s) {
  const WarmBox box = brick->box;
  const int count = box.col1 - box.col0;
  double total = 0;
  for (int j = box.row0; j < box.row1; ++j) {
    const float* __restrict t = &brick->theta[BrickThetaIndex(box.col0, j, 0)];
    const float* __restrict flux = &brick->lid_flux[j * kBrick + box.col0];
    const float* __restrict rate = &brick->lid_rate[j * kBrick + box.col0];
    float* __restrict h = &brick->enthalpy[BrickIndex(box.col0, j, 0)];
    alignas(64) float in[kBrick] = {};
    for (int i = 0; i < count; ++i) {
      in[i] = dt_s * (flux[i] - rate[i] * t[i]);
      h[i] += in[i];
    }
    total += SumRow(in);
  }
  return total;
}

FULCRUM_WIDE
void RefreshLayer(Brick* brick, int k, float boil, float latent_K) {
  const float spent = boil + latent_K;
  const WarmBox box = brick->box;
  const int count = box.col1 - box.col0;
  alignas(64) float sum[kBrick] = {};
  for (int j = box.row0; j < box.row1; j += kBoxRows) {
    alignas(64) float high[kBrick] = {};
    for (int row = j; row < j + kBoxRows; ++row) {
      float* __restrict t = &brick->theta[BrickThetaIndex(box.col0, row, k)];
      const float* __restrict h = &brick->enthalpy[BrickIndex(box.col0, row, k)];
      for (int i = 0; i < count; ++i) {
        const float below = h[i] > boil ? boil : h[i];
        const float dry = h[i] - spent;
        const float value = below + (dry > 0.0f ? dry : 0.0f);
        const float size = std::abs(value);
        t[i] = value;
        sum[i] += value;
        high[i] = high[i] > size ? high[i] : size;
      }
    }
    brick->pair_max[k * kBrickPairs + j / 2] = MaxRow(high);
  }
  brick->layer_sum[k] = SumRow(sum);
}

FULCRUM_WIDE
bool DamageRow(const float* __restrict theta, float* __restrict omega, int count, DamageRate rate, float dt_s) {
  std::uint32_t dead = 0;
  for (int i = 0; i < count; ++i) {
    const float dt = theta[i] < kDamageStart ? 0.0f : dt_s;
    const float inverse_K = rate.InverseKelvin(theta[i] > kDamageStart ? theta[i] : kDamageStart);
    const float sum = omega[i] + dt * rate.OfInverse(inverse_K);
    const float capped = sum < kOmegaMax ? sum : kOmegaMax;
    omega[i] = capped;
    dead |= sum >= 1.0f ? 1u : 0u;
  }
  return dead != 0;
}

}  // namespace fulcrum::thermal
