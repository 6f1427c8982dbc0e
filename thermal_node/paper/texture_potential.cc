#include "thermal_node/paper/texture_potential.h"

#include <algorithm>
#include <cstddef>

#include "thermal_node/heat/wide.h"

namespace fulcrum::thermal {
namespace {

FULCRUM_WIDE
void SweepRow(int stride, const float* __restrict weight, const float* __restrict fixed, const float* __restrict v,
              float* __restrict out) {
  for (int i = 0; i < kTexture; ++i) {
    out[i] = weight[i] * ((v[i - 1] + v[i + 1]) + (v[i - stride] + v[i + stride])) + fixed[i];
  }
}

FULCRUM_WIDE
void WeightRow(int stride, const float* __restrict tissue, float* __restrict weight) {
  for (int i = 0; i < kTexture; ++i) {
    const float neighbours = (tissue[i - 1] + tissue[i + 1]) + (tissue[i - stride] + tissue[i + stride]);
    weight[i] = tissue[i] / (neighbours > 1.0f ? neighbours : 1.0f);
  }
}

FULCRUM_WIDE
void HeatRow(int stride, const float* __restrict t, const float* __restrict v, float* __restrict out) {
  for (int i = 0; i < kTexture; ++i) {
    const float left = v[i] - v[i - 1], right = v[i] - v[i + 1];
    const float above = v[i] - v[i - stride], below = v[i] - v[i + stride];
    const float along = t[i - 1] * left * left + t[i + 1] * right * right;
    const float across = t[i - stride] * above * above + t[i + stride] * below * below;
    out[i] = 0.5f * t[i] * (along + across);
  }
}

}  // namespace

TexturePotential::TexturePotential() {
  const std::size_t size = static_cast<std::size_t>(kTexture + 2) * kStride;
  tissue_.assign(size, 1.0f);
  weight_.assign(size, 0.0f);
  fixed_.assign(size, 0.0f);
  volt_.assign(size, 0.0f);
  next_.assign(size, 0.0f);
  electrode_.reserve(4096);
}

void TexturePotential::SetElectrode(int i, int j) {
  if (tissue_[At(i, j)] == 0.0f) return;
  fixed_[At(i, j)] = 1.0f;
  electrode_.push_back(At(i, j));
}

void TexturePotential::SetWeights() {
  for (int j = 0; j < kTexture; ++j) WeightRow(kStride, &tissue_[At(0, j)], &weight_[At(0, j)]);
  for (const int k : electrode_) weight_[k] = 0.0f;
}

void TexturePotential::Relax(int count) {
  SetWeights();
  for (int n = 0; n < count; ++n) {
    for (int j = 0; j < kTexture; ++j) {
      SweepRow(kStride, &weight_[At(0, j)], &fixed_[At(0, j)], &volt_[At(0, j)], &next_[At(0, j)]);
    }
    volt_.swap(next_);
  }
}

float TexturePotential::TakeConductance() {
  float current = 0;
  for (const int k : electrode_) {
    for (const int n : {k - 1, k + 1, k - kStride, k + kStride}) current += tissue_[n] * (volt_[k] - volt_[n]);
    fixed_[k] = 0.0f;
  }
  electrode_.clear();
  return current;
}

void TexturePotential::HeatOfRow(int j, std::span<float> out) const {
  HeatRow(kStride, &tissue_[At(0, j)], &volt_[At(0, j)], out.data());
}

void TexturePotential::Shift(int di, int dj) {
  std::fill(next_.begin(), next_.end(), 0.0f);
  const int i0 = std::max(0, -di), i1 = std::min(kTexture, kTexture - di);
  for (int j = std::max(0, -dj); j < std::min(kTexture, kTexture - dj) && i0 < i1; ++j) {
    std::copy_n(&volt_[At(i0 + di, j + dj)], i1 - i0, &next_[At(i0, j)]);
  }
  volt_.swap(next_);
}

void TexturePotential::Clear() { std::fill(volt_.begin(), volt_.end(), 0.0f); }

}  // namespace fulcrum::thermal
