// Conductances of the faces of a tile, and with them the rates of its cells.
//
//   G = d sqrt(g) g^nn / (r_a + r_b),   r = 1 / (2 k), in a boiling cell (1 - w) / k_dry and w / k_wet
//
// G conductance of a face between cells a and b [W/K], d thickness of the sheet [m], g metric of the rest shape over
// material space (n: s or t), r resistance from a cell's place of temperature theta to its face, over cell_m [m K/W],
// k thermal conductivity [W/(m K)], w water. The arrays hold G / W, W = cell_m^2 d.
//
// A boiling cell is at one temperature, that of the front between its dry and its wet part. With 1 / (2 k) the front
// would be a third of a cell ahead of Neumann's solution (16 % after 1 s in cells of 100 um, instead of 0.5).
#include <algorithm>
#include <cmath>
#include <limits>

#include "thermal_node/heat/heat_field.h"
#include "thermal_node/heat/wide.h"

namespace fulcrum::thermal {
namespace {

/// Difference of water from which on the material of two cells differs: their fluxes are of second order.
constexpr float kWaterJump = 0.25f;

/// The entries of CellResistance for one cell.
struct Half {
  float water, to_drier, to_wetter;
};
[[gnu::always_inline]] inline Half HalfAt(const CellResistance& of, int at) {
  return {of.water[at], of.to_drier[at], of.to_wetter[at]};
}
/// Conductance of a face over d: 0 if either cell is no tissue.
[[gnu::always_inline]] inline float Conductance(const Half& a, const Half& b) {
  const float of_a = b.water < a.water ? a.to_drier : a.to_wetter;
  const float of_b = a.water < b.water ? b.to_drier : b.to_wetter;
  return 1.0f / (of_a + of_b);
}

/// A field of cells with the halo of theta.
using Padded = std::array<float, kThetaCount>;
constexpr std::array<Padded CellResistance::*, 3> kResistances = {&CellResistance::water, &CellResistance::to_drier,
                                                                  &CellResistance::to_wetter};

/// Fills the halo of a padded field with value(tile, i, j) of the adjacent cells of the eight neighbours; without a
/// neighbour with `none`, or, if that is NaN, not at all.
template <class Value>
void FillHalo(const std::array<const Tile*, 9>& around, const Value& value, float none, float* field) {
  for (int n = 0; n < 9; ++n) {
    const Tile* other = around[n];
    if (n == 4 || (other == nullptr && std::isnan(none))) continue;
    const int dx = n % 3 - 1, dy = n / 3 - 1;
    const int i0 = dx < 0 ? -kHalo : (dx > 0 ? kTile : 0), i1 = dx < 0 ? 0 : (dx > 0 ? kTile + kHalo : kTile);
    const int j0 = dy < 0 ? -kHalo : (dy > 0 ? kTile : 0), j1 = dy < 0 ? 0 : (dy > 0 ? kTile + kHalo : kTile);
    for (int j = j0; j < j1; ++j) {
      for (int i = i0; i < i1; ++i) {
        field[ThetaIndex(i, j)] = other != nullptr ? value(*other, i - dx * kTile, j - dy * kTile) : none;
      }
    }
  }
}

/// Resistances of the cells of a tile; true if one of them boils.
FULCRUM_WIDE
bool ResistancesOf(const Tile& tile, const Material& material, CellResistance* out) {
  const float k_dry = material.k_dry, k_water = material.k_wet - material.k_dry;
  const float per_dry = 1.0f / material.k_dry, per_wet = 1.0f / material.k_wet;
  const float boiling = kFrontTheta * material.theta_boil;
  alignas(64) float fronts[kTile] = {};
  for (int j = 0; j < kTile; ++j) {
    const float* __restrict w = &tile.state.water[j * kTile];
    const float* __restrict theta = &tile.theta[ThetaIndex(0, j)];
    const std::uint8_t* __restrict flags = &tile.state.flags[j * kTile];
    float* __restrict water = &out->water[ThetaIndex(0, j)];
    float* __restrict to_drier = &out->to_drier[ThetaIndex(0, j)];
    float* __restrict to_wetter = &out->to_wetter[ThetaIndex(0, j)];
    for (int i = 0; i < kTile; ++i) {
      const float closed = (flags[i] & kNoTissue) != 0 ? std::numeric_limits<float>::infinity() : 0.0f;
      const float half = 0.5f / (k_dry + w[i] * k_water);
      const float dry = 1.0f - w[i], wet = w[i];
      const float from_dry = per_dry * (dry > kLeastFrontDistance ? dry : kLeastFrontDistance);
      const float from_wet = per_wet * (wet > kLeastFrontDistance ? wet : kLeastFrontDistance);
      const float front = theta[i] >= boiling && dry > 0.0f && wet > 0.0f ? 1.0f : 0.0f;
      water[i] = wet;
      to_drier[i] = closed + (front > 0.0f ? from_dry : half);
      to_wetter[i] = closed + (front > 0.0f ? from_wet : half);
      fronts[i] = fronts[i] > front ? fronts[i] : front;
    }
  }
  return *std::max_element(fronts, fronts + kTile) > 0.0f;
}

FULCRUM_WIDE
void FacesOf(Tile* tile, float scale) {
  const TileGeometry& geometry = tile->geometry;
  const CellResistance& cells = tile->resistance;
  for (int j = 0; j < kTile; ++j) {
    const float* __restrict ratio = &geometry.across_s[FaceS(0, j)];
    float* __restrict face = &tile->face_s[FaceS(0, j)];
    const int at = ThetaIndex(0, j);
    for (int i = -1; i <= kTile + 1; ++i) {
      face[i] = scale * ratio[i] * Conductance(HalfAt(cells, at + i - 1), HalfAt(cells, at + i));
    }
  }
  for (int j = -1; j <= kTile + 1; ++j) {
    const float* __restrict ratio = &geometry.across_t[FaceT(0, j)];
    float* __restrict face = &tile->face_t[FaceT(0, j)];
    const int at = ThetaIndex(0, j);
    for (int i = 0; i < kTile; ++i) {
      face[i] = scale * ratio[i] * Conductance(HalfAt(cells, at + i - kThetaStride), HalfAt(cells, at + i));
    }
  }
}

/// 1 if the slope of theta may change at the face between two cells of tissue: one of them boils, or their material
/// differs.
[[gnu::always_inline]] inline float Kink(const CellResistance& cells, int a, int b) {
  const float jump = cells.water[a] - cells.water[b];
  // Bitwise, which is vectorised.
  const int front = static_cast<int>(cells.to_drier[a] != cells.to_wetter[a]) |
                    static_cast<int>(cells.to_drier[b] != cells.to_wetter[b]);
  const int differs = static_cast<int>(jump > kWaterJump) | static_cast<int>(jump < -kWaterJump);
  const int tissue = static_cast<int>(cells.to_wetter[a] + cells.to_wetter[b] < std::numeric_limits<float>::infinity());
  return static_cast<float>(tissue & (front | differs));
}

/// Tile::smooth_s and smooth_t: a flux of fourth order takes in three faces, none of which may be a kink.
FULCRUM_WIDE
void SmoothOf(Tile* tile) {
  const CellResistance& cells = tile->resistance;
  alignas(64) float s[kTile * kFaceStride] = {}, t[(kTile + 3) * kTile] = {}, most[kTile + 3] = {};
  for (int j = 0; j < kTile; ++j) {
    const int at = ThetaIndex(0, j);
    float* __restrict kink = &s[FaceS(0, j)];
    for (int i = -1; i <= kTile + 1; ++i) kink[i] = Kink(cells, at + i - 1, at + i);
    for (int i = 0; i < kTile + 3; ++i) most[i] = most[i] > kink[i - 1] ? most[i] : kink[i - 1];
  }
  for (int j = -1; j <= kTile + 1; ++j) {
    const int at = ThetaIndex(0, j);
    float* __restrict kink = &t[FaceT(0, j)];
    for (int i = 0; i < kTile; ++i) kink[i] = Kink(cells, at + i - kThetaStride, at + i);
    for (int i = 0; i < kTile; ++i) most[i] = most[i] > kink[i] ? most[i] : kink[i];
  }
  if (*std::max_element(most, most + kTile + 3) == 0.0f) {
    tile->smooth_s.clear();
    tile->smooth_t.clear();
    return;
  }
  tile->smooth_s.resize(tile->face_s.size());
  tile->smooth_t.resize(tile->face_t.size());
  for (int j = 0; j < kTile; ++j) {
    const float* __restrict kink = &s[FaceS(0, j)];
    float* __restrict smooth = &tile->smooth_s[FaceS(0, j)];
    for (int i = 0; i <= kTile; ++i) smooth[i] = kink[i - 1] + kink[i] + kink[i + 1] > 0.0f ? 0.0f : 1.0f;
  }
  for (int j = 0; j <= kTile; ++j) {
    const float* __restrict kink = &t[FaceT(0, j)];
    float* __restrict smooth = &tile->smooth_t[FaceT(0, j)];
    for (int i = 0; i < kTile; ++i) smooth[i] = kink[i - kTile] + kink[i] + kink[i + kTile] > 0.0f ? 0.0f : 1.0f;
  }
}

/// Heat is conducted across a corner only along tissue: the link is 0 if neither of the two other cells at the corner
/// is tissue.
FULCRUM_WIDE
void LinksOf(Tile* tile, float scale) {
  const CellResistance& cells = tile->resistance;
  for (int j = 0; j <= kTile; ++j) {
    const float* __restrict shear = &tile->geometry.shear[Corner(0, j)];
    float* __restrict link = &tile->links[Corner(0, j)];
    alignas(64) float main[kTile + 1], anti[kTile + 1];
    for (int i = 0; i <= kTile; ++i) {
      const int at = ThetaIndex(i, j), above = at - kThetaStride;
      main[i] = Conductance(HalfAt(cells, above - 1), HalfAt(cells, at));
      anti[i] = Conductance(HalfAt(cells, above), HalfAt(cells, at - 1));
    }
    // A loop of its own: in one the choices would become branches, which are not vectorised.
    const float* __restrict wetter = &cells.to_wetter[ThetaIndex(0, j)];
    for (int i = 0; i <= kTile; ++i) {
      const float a = wetter[i - 1 - kThetaStride], b = wetter[i - kThetaStride], c = wetter[i - 1], d = wetter[i];
      constexpr float kNoneThere = std::numeric_limits<float>::infinity();
      const float across = (b < c ? b : c) < kNoneThere ? main[i] : 0.0f;
      const float along = (a < d ? a : d) < kNoneThere ? anti[i] : 0.0f;
      link[i] = scale * shear[i] * (shear[i] > 0.0f ? across : along);
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
  geometry.has_main = std::any_of(geometry.shear.begin(), geometry.shear.end(), [](float b) { return b > 0.0f; });
  geometry.has_anti = std::any_of(geometry.shear.begin(), geometry.shear.end(), [](float b) { return b < 0.0f; });
}

std::array<const Tile*, 9> HeatField::Around(const Tile& tile) const {
  std::array<const Tile*, 9> around{};
  for (int n = 0; n < 9; ++n) {
    const Tile* other = n == 4 ? &tile : Find(tile.tx + n % 3 - 1, tile.ty + n / 3 - 1);
    // A face or link to a tile that sleeps, or to one of another sheet, is closed.
    around[n] = other != nullptr && other->state.awake != 0 && other->material == tile.material ? other : nullptr;
  }
  return around;
}

void HeatField::ComputeResistance(Tile* tile) {
  alignas(64) CellResistance now;
  tile->has_front = ResistancesOf(*tile, *tile->material, &now);
  // Faces of neighbours depend on the two cells next to the border.
  std::array<bool, 9> changed{};
  const auto differs = [&](int from, int count) {
    return std::any_of(kResistances.begin(), kResistances.end(), [&](Padded CellResistance::*part) {
      const float* before = &(tile->resistance.*part)[from];
      return !std::equal(before, before + count, &(now.*part)[from]);
    });
  };
  for (int j = 0; j < kTile; ++j) {
    const int at = ThetaIndex(0, j), row = j < kHalo ? 0 : (j >= kTile - kHalo ? 6 : 3);
    if (row != 3 && differs(at, kTile)) changed[row + 1] = true;
    if (differs(at, kHalo)) changed[row] = changed[3] = true;
    if (differs(at + kTile - kHalo, kHalo)) changed[row + 2] = changed[5] = true;
    for (Padded CellResistance::*part : kResistances) {
      std::copy_n(&(now.*part)[at], kTile, &(tile->resistance.*part)[at]);
    }
  }
  for (int n = 0; n < 9; ++n) {
    if (Tile* other = changed[n] ? Find(tile->tx + n % 3 - 1, tile->ty + n / 3 - 1) : nullptr) {
      other->faces_stale = true;
    }
  }
}

void HeatField::BuildFaces(Tile* tile) {
  const TileGeometry& geometry = tile->geometry;
  for (Padded CellResistance::*part : kResistances) {
    FillHalo(
        Around(*tile), [part](const Tile& of, int i, int j) { return (of.resistance.*part)[ThetaIndex(i, j)]; },
        std::numeric_limits<float>::infinity(), (tile->resistance.*part).data());
  }
  const Material& material = *tile->material;
  const float scale = 1.0f / (material.cell_m * material.cell_m);  // d / flat_volume
  FacesOf(tile, scale);
  SmoothOf(tile);
  if (!geometry.shear.empty()) {
    tile->links.resize(geometry.shear.size());
    LinksOf(tile, scale);
  }
  RatesOf(tile, material.rc_dry, material.rc_wet - material.rc_dry,
          std::max(material.loss_resting, material.loss_tented));
  tile->rate = *std::max_element(tile->cell_rate.begin(), tile->cell_rate.end());
}

void HeatField::LimitFaces(Tile* tile, float rate) {
  const auto part_of = [&](const Tile& of, int i, int j) { return std::min(1.0f, rate / of.cell_rate[j * kTile + i]); };
  alignas(64) Padded part{};
  for (int j = 0; j < kTile; ++j) {
    for (int i = 0; i < kTile; ++i) part[ThetaIndex(i, j)] = part_of(*tile, i, j);
  }
  FillHalo(Around(*tile), part_of, std::numeric_limits<float>::quiet_NaN(), part.data());
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

}  // namespace fulcrum::thermal
