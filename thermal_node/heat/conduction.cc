// Kernels of HeatField's explicit step: conductances, fluxes, temperatures.
//
//   dH_c/dt = 1/(sqrt(g) W) (sum over faces of F - sum over faces of F') - loss theta_c,   theta = H / rc(water)
//   f = G (theta_a - theta_b),   F = clamp(f - f'' / 12, 0, gain f)
//   G = d k_ab sqrt(g) g^nn,   k_ab = 2 k_a k_b / (k_a + k_b)
//
// H enthalpy of cell c [J/m^3], theta temperature above body temperature [K], rc heat capacity [J/(m^3 K)], k thermal
// conductivity [W/(m K)], d thickness of the sheet [m], g metric of the rest shape over material space (n: s or t),
// W = cell_m^2 d volume of a cell in material space [m^3], f two-point flux through the face from a to b, f'' its
// second difference along the line of faces, F inflow, F' outflow, loss sink per kelvin [W/(m^3 K)]. The arrays hold
// G / W, so fluxes are in W/m^3.
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

/// Harmonic mean; 0 when either side does not conduct. The guard only turns 0/0 into 0.
inline float Harmonic(float a, float b) { return 2.0f * a * b / (a + b + std::numeric_limits<float>::min()); }

/// Flux through a face from its two-point flux and those of the faces before and after it on its line. The divergence
/// of f - f'' / 12 is of fourth order where f is smooth. The result is limited to between 0 and `gain` times the
/// two-point flux, so it remains a conductance times the difference of the two cells: the maximum principle holds,
/// closed faces stay closed, and both cells of the face get the same flux.
[[gnu::always_inline]] inline float FourthOrder(float before, float flux, float after, float gain) {
  const float f = (14.0f / 12.0f) * flux - (1.0f / 12.0f) * (before + after);
  const float most = gain * flux;
  const float low = most < 0.0f ? most : 0.0f, high = most > 0.0f ? most : 0.0f;
  const float above = f > low ? f : low;
  return above < high ? above : high;
}

/// Conductance of a diagonal link along the main diagonal (stored with positive sign) and the antidiagonal (negative).
[[gnu::always_inline]] inline float Main(float link) { return link > 0.0f ? link : 0.0f; }
[[gnu::always_inline]] inline float Anti(float link) { return link < 0.0f ? -link : 0.0f; }

/// One stage for the rows of the tile: enthalpy <- enthalpy + dt dH/dt, with `loss` = dt times the sink per kelvin. In
/// the last stage the result is averaged with the enthalpy before the step, whose weight is `first`; see DiffuseIsland.
template <bool kLast, bool kSheared>
[[gnu::always_inline]] inline void Stage(Tile* tile, float dt_s, float gain, float loss, float first) {
  // Each pass covers the whole tile: a shifted read of values that were just written would stall until the store has
  // completed.
  alignas(64) float across_s[kTile * kFaceStride], across_t[(kTile + 3) * kTile], face_s[kTile * kFaceStride];
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
    float* __restrict face = &face_s[FaceS(0, j)];
    for (int i = 0; i <= kTile; ++i) face[i] = FourthOrder(f[i - 1], f[i], f[i + 1], gain);
  }
  alignas(64) float above[kTile], below[kTile];
  for (int i = 0; i < kTile; ++i) {
    const float* f = &across_t[FaceT(i, 0)];
    below[i] = FourthOrder(f[-kTile], f[0], f[kTile], gain);
  }
  for (int j = 0; j < kTile; ++j) {
    const float* __restrict t = &tile->theta[ThetaIndex(0, j)];
    const float* __restrict fs = &face_s[FaceS(0, j)];
    const float* __restrict ft = &across_t[FaceT(0, j + 1)];
    const float* __restrict inverse_area = &tile->geometry.inverse_area[j * kTile];
    float* __restrict h = &tile->state.enthalpy[j * kTile];
    const float* __restrict before = &tile->before[j * kTile];
    for (int i = 0; i < kTile; ++i) above[i] = below[i];
    for (int i = 0; i < kTile; ++i) below[i] = FourthOrder(ft[i - kTile], ft[i], ft[i + kTile], gain);
    const float* __restrict l = kSheared ? &tile->links[Corner(0, j)] : nullptr;
    for (int i = 0; i < kTile; ++i) {
      float flux = (fs[i] - fs[i + 1]) + (above[i] - below[i]);
      if constexpr (kSheared) {
        const float* up = &t[i - kThetaStride];
        const float* down = &t[i + kThetaStride];
        flux += Main(l[i]) * (up[-1] - t[i]) + Main(l[i + kCornerStride + 1]) * (down[1] - t[i]) +
                Anti(l[i + 1]) * (up[1] - t[i]) + Anti(l[i + kCornerStride]) * (down[-1] - t[i]);
      }
      const float after = h[i] + (dt_s * inverse_area[i] * flux - loss * t[i]);
      h[i] = kLast ? after + first * (before[i] - after) : after;
    }
  }
}

FULCRUM_WIDE
void AnyStage(Tile* tile, float dt_s, float gain, float loss) { Stage<false, false>(tile, dt_s, gain, loss, 0); }
FULCRUM_WIDE
void LastStage(Tile* tile, float dt_s, float gain, float loss, float first) {
  Stage<true, false>(tile, dt_s, gain, loss, first);
}
FULCRUM_WIDE
void AnyStageSheared(Tile* tile, float dt_s, float gain, float loss) { Stage<false, true>(tile, dt_s, gain, loss, 0); }
FULCRUM_WIDE
void LastStageSheared(Tile* tile, float dt_s, float gain, float loss, float first) {
  Stage<true, true>(tile, dt_s, gain, loss, first);
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

/// A field of cells with the halo of theta.
using Padded = std::array<float, kThetaCount>;

/// Fills the halo of a padded field with value(tile, i, j) of the adjacent cells of the eight neighbours. Without a
/// neighbour the halo is set to 0 (`clear`) or left unchanged.
template <class Value>
void FillHalo(const std::array<const Tile*, 9>& around, const Value& value, bool clear, float* field) {
  for (int n = 0; n < 9; ++n) {
    const Tile* other = around[n];
    if (n == 4 || (other == nullptr && !clear)) continue;
    const int dx = n % 3 - 1, dy = n / 3 - 1;
    const int i0 = dx < 0 ? -kHalo : (dx > 0 ? kTile : 0), i1 = dx < 0 ? 0 : (dx > 0 ? kTile + kHalo : kTile);
    const int j0 = dy < 0 ? -kHalo : (dy > 0 ? kTile : 0), j1 = dy < 0 ? 0 : (dy > 0 ? kTile + kHalo : kTile);
    for (int j = j0; j < j1; ++j) {
      for (int i = i0; i < i1; ++i) {
        field[ThetaIndex(i, j)] = other != nullptr ? value(*other, i - dx * kTile, j - dy * kTile) : 0.0f;
      }
    }
  }
}

/// Writes the thermal conductivity of each cell to `out`, 0 where there is no tissue; k = k_dry + water * k_water.
FULCRUM_WIDE
void ConductivityOf(const TileState& state, float k_dry, float k_water, float* out) {
  for (int j = 0; j < kTile; ++j) {
    float* __restrict k = &out[ThetaIndex(0, j)];
    const float* __restrict water = &state.water[j * kTile];
    const std::uint8_t* __restrict flags = &state.flags[j * kTile];
    for (int i = 0; i < kTile; ++i) {
      const float tissue = (flags[i] & kNoTissue) != 0 ? 0.0f : 1.0f;
      k[i] = tissue * (k_dry + water[i] * k_water);
    }
  }
}

FULCRUM_WIDE
void FacesOf(Tile* tile, float scale) {
  const TileGeometry& geometry = tile->geometry;
  for (int j = 0; j < kTile; ++j) {
    const float* __restrict k = &tile->conductivity[ThetaIndex(0, j)];
    const float* __restrict ratio = &geometry.across_s[FaceS(0, j)];
    float* __restrict face = &tile->face_s[FaceS(0, j)];
    for (int i = -1; i <= kTile + 1; ++i) face[i] = scale * ratio[i] * Harmonic(k[i - 1], k[i]);
  }
  for (int j = -1; j <= kTile + 1; ++j) {
    const float* __restrict k = &tile->conductivity[ThetaIndex(0, j)];
    const float* __restrict ratio = &geometry.across_t[FaceT(0, j)];
    float* __restrict face = &tile->face_t[FaceT(0, j)];
    for (int i = 0; i < kTile; ++i) face[i] = scale * ratio[i] * Harmonic(k[i - kThetaStride], k[i]);
  }
}

/// Heat is conducted across a corner only along tissue: the link is 0 if neither of the two other cells at the corner
/// is tissue.
FULCRUM_WIDE
void LinksOf(Tile* tile, float scale) {
  for (int j = 0; j <= kTile; ++j) {
    const float* __restrict below = &tile->conductivity[ThetaIndex(0, j)];
    const float* __restrict above = below - kThetaStride;
    const float* __restrict shear = &tile->geometry.shear[Corner(0, j)];
    float* __restrict link = &tile->links[Corner(0, j)];
    for (int i = 0; i <= kTile; ++i) {
      const float main = above[i] + below[i - 1] > 0.0f ? Harmonic(above[i - 1], below[i]) : 0.0f;
      const float anti = above[i - 1] + below[i] > 0.0f ? Harmonic(above[i], below[i - 1]) : 0.0f;
      link[i] = scale * shear[i] * (shear[i] > 0.0f ? main : anti);
    }
  }
}

/// Rate of the explicit step with two-point fluxes, in each cell [1/s].
FULCRUM_WIDE
void RatesOf(Tile* tile, float rc_dry, float rc_water, float sink) {
  for (int j = 0; j < kTile; ++j) {
    const float* __restrict s = &tile->face_s[FaceS(0, j)];
    const float* __restrict t = &tile->face_t[FaceT(0, j)];
    const float* __restrict water = &tile->state.water[j * kTile];
    const float* __restrict inverse_area = &tile->geometry.inverse_area[j * kTile];
    float* __restrict rate = &tile->cell_rate[j * kTile];
    alignas(64) float sum[kTile];
    for (int i = 0; i < kTile; ++i) sum[i] = (s[i] + s[i + 1]) + (t[i] + t[i + kTile]);
    if (!tile->links.empty()) {
      const float* __restrict l = &tile->links[Corner(0, j)];
      for (int i = 0; i < kTile; ++i) {
        sum[i] += (Main(l[i]) + Main(l[i + kCornerStride + 1])) + (Anti(l[i + 1]) + Anti(l[i + kCornerStride]));
      }
    }
    for (int i = 0; i < kTile; ++i) rate[i] = (sum[i] * inverse_area[i] + sink) / (rc_dry + water[i] * rc_water);
  }
}

}  // namespace

void SetGeometry(const Sheet& sheet, Tile* tile) {
  TileGeometry& geometry = tile->geometry;
  if (sheet.metric.empty()) {
    geometry.area.fill(1);
    geometry.inverse_area.fill(1);
    geometry.across_s.fill(1);
    geometry.across_t.fill(1);
    return;
  }
  const auto at = [&](float x, float y) {
    return sheet.MetricAt(static_cast<float>(tile->tx * kTile) + x, static_cast<float>(tile->ty * kTile) + y);
  };
  // The conductance of diagonal links is subtracted from the faces around them; neither may become negative.
  const auto shear_at = [&](int i, int j) {
    const SurfaceMetric g = at(static_cast<float>(i), static_cast<float>(j));
    const float most = std::min(g.ss, g.tt) / g.area(), b = -g.st / g.area();
    return std::abs(b) < kShearIgnored * most ? 0.0f : std::clamp(b, -most, most);
  };
  constexpr int kSide = kTile + 3;
  std::array<float, kSide * kSide> shear;  // corners -1 ... kTile + 1
  for (int j = -1; j <= kTile + 1; ++j) {
    for (int i = -1; i <= kTile + 1; ++i) {
      shear[(j + 1) * kSide + i + 1] = shear_at(i, j);
    }
  }
  const auto carried = [&](int i, int j) { return std::abs(shear[(j + 1) * kSide + i + 1]); };
  for (int j = 0; j < kTile; ++j) {
    for (int i = -1; i <= kTile + 1; ++i) {
      const SurfaceMetric g = at(static_cast<float>(i), static_cast<float>(j) + 0.5f);
      geometry.across_s[FaceS(i, j)] = std::max(0.0f, g.tt / g.area() - 0.5f * (carried(i, j) + carried(i, j + 1)));
    }
  }
  for (int j = -1; j <= kTile + 1; ++j) {
    for (int i = 0; i < kTile; ++i) {
      const SurfaceMetric g = at(static_cast<float>(i) + 0.5f, static_cast<float>(j));
      geometry.across_t[FaceT(i, j)] = std::max(0.0f, g.ss / g.area() - 0.5f * (carried(i, j) + carried(i + 1, j)));
    }
  }
  for (int k = 0; k < kTileCells; ++k) {
    const int i = k % kTile, j = k / kTile;
    geometry.area[k] = at(static_cast<float>(i) + 0.5f, static_cast<float>(j) + 0.5f).area();
    geometry.inverse_area[k] = 1.0f / geometry.area[k];
  }
  if (std::all_of(shear.begin(), shear.end(), [](float b) { return b == 0.0f; })) return;
  geometry.shear.assign((kTile + 1) * kCornerStride, 0.0f);
  for (int j = 0; j <= kTile; ++j) {
    for (int i = 0; i <= kTile; ++i) geometry.shear[Corner(i, j)] = shear[(j + 1) * kSide + i + 1];
  }
}

std::array<const Tile*, 9> HeatField::Around(const Tile& tile) const {
  std::array<const Tile*, 9> around{};
  for (int n = 0; n < 9; ++n) {
    const Tile* other = n == 4 ? &tile : Find(tile.tx + n % 3 - 1, tile.ty + n / 3 - 1);
    // A face or link to a tile that sleeps is closed.
    around[n] = other != nullptr && other->state.awake != 0 ? other : nullptr;
  }
  return around;
}

void HeatField::ComputeConductivity(Tile* tile) {
  alignas(64) Padded now;
  ConductivityOf(tile->state, material_.k_dry, material_.k_wet - material_.k_dry, now.data());
  // Faces of neighbours depend on the two cells next to the border.
  std::array<bool, 9> changed{};
  for (int j = 0; j < kTile; ++j) {
    const float* before = &tile->conductivity[ThetaIndex(0, j)];
    const float* after = &now[ThetaIndex(0, j)];
    const int row = j < kHalo ? 0 : (j >= kTile - kHalo ? 6 : 3);
    if (row != 3 && !std::equal(before, before + kTile, after)) changed[row + 1] = true;
    if (!std::equal(before, before + kHalo, after)) changed[row] = changed[3] = true;
    if (!std::equal(before + kTile - kHalo, before + kTile, after + kTile - kHalo))
      changed[row + 2] = changed[5] = true;
    std::copy_n(after, kTile, &tile->conductivity[ThetaIndex(0, j)]);
  }
  for (int n = 0; n < 9; ++n) {
    if (Tile* other = changed[n] ? Find(tile->tx + n % 3 - 1, tile->ty + n / 3 - 1) : nullptr) {
      other->faces_stale = true;
    }
  }
}

void HeatField::BuildFaces(Tile* tile) {
  const TileGeometry& geometry = tile->geometry;
  FillHalo(
      Around(*tile), [](const Tile& of, int i, int j) { return of.conductivity[ThetaIndex(i, j)]; }, true,
      tile->conductivity.data());
  const float scale = 1.0f / (material_.cell_m * material_.cell_m);  // d / flat_volume
  FacesOf(tile, scale);
  if (!geometry.shear.empty()) {
    tile->links.resize(geometry.shear.size());
    LinksOf(tile, scale);
  }
  RatesOf(tile, material_.rc_dry, material_.rc_wet - material_.rc_dry,
          std::max(material_.loss_resting, material_.loss_tented));
  tile->rate = *std::max_element(tile->cell_rate.begin(), tile->cell_rate.end());
}

void HeatField::LimitFaces(Tile* tile, float rate) {
  const auto part_of = [&](const Tile& of, int i, int j) { return std::min(1.0f, rate / of.cell_rate[j * kTile + i]); };
  alignas(64) Padded part{};
  for (int j = 0; j < kTile; ++j) {
    for (int i = 0; i < kTile; ++i) part[ThetaIndex(i, j)] = part_of(*tile, i, j);
  }
  FillHalo(Around(*tile), part_of, false, part.data());
  for (int j = 0; j < kTile; ++j) {
    const float* p = &part[ThetaIndex(0, j)];
    for (int i = -1; i <= kTile + 1; ++i) tile->face_s[FaceS(i, j)] *= std::min(p[i - 1], p[i]);
  }
  for (int j = -1; j <= kTile + 1; ++j) {
    const float* p = &part[ThetaIndex(0, j)];
    for (int i = 0; i < kTile; ++i) tile->face_t[FaceT(i, j)] *= std::min(p[i - kThetaStride], p[i]);
  }
  if (tile->links.empty()) return;
  for (int j = 0; j <= kTile; ++j) {
    const float* p = &part[ThetaIndex(0, j)];
    for (int i = 0; i <= kTile; ++i) {
      float& link = tile->links[Corner(i, j)];
      link *= link > 0.0f ? std::min(p[i - 1 - kThetaStride], p[i]) : std::min(p[i - kThetaStride], p[i - 1]);
    }
  }
}

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
  const bool sheared = !tile->links.empty();
  if (stage.index == 0) tile->before = tile->state.enthalpy;
  if (stage.last()) {
    (sheared ? LastStageSheared : LastStage)(tile, stage.dt_s, stage.gain, loss, first);
  } else {
    (sheared ? AnyStageSheared : AnyStage)(tile, stage.dt_s, stage.gain, loss);
  }
  double sum = 0;
  for (const float s : tile->theta_sum) sum += s;
  ledger->lost += static_cast<double>(1.0f - first) * sum * loss * tile->flat_volume;
}

void HeatField::Cool(Tile* tile, float dt_s, Ledger* ledger) const {
  const float loss = dt_s * SinkOf(*tile);
  const double before = tile->Heat();
  for (int cell = 0; cell < kTileCells; ++cell) {
    tile->state.enthalpy[cell] *= std::exp(-loss / material_.HeatCapacity(tile->state.water[cell]));
  }
  ledger->lost += before - tile->Heat();
}

void HeatField::ComputeMiddleTheta(Tile* tile) const {
  MiddleThetaOf(tile, material_.rc_dry, material_.rc_wet - material_.rc_dry);
}

void HeatField::RefreshTheta(Tile* tile, Ledger* ledger) {
  ThetaOf(tile, material_.rc_dry, material_.rc_wet - material_.rc_dry);
  float total = 0;
  for (const float s : tile->theta_sum) total += s;
  if (!std::isfinite(total) || tile->theta_max > kThetaPlausible || tile->theta_min < -kThetaPlausible ||
      tile->water_off > 0.5f) {
    Quarantine(tile, ledger);
  }
}

}  // namespace fulcrum::thermal
