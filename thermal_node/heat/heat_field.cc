#include "thermal_node/heat/heat_field.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "thermal_node/heat/wide.h"

namespace fulcrum::thermal {
namespace {

/// Harmonic mean; 0 when either side does not conduct. The guard only turns 0/0 into 0.
inline float Harmonic(float a, float b) { return 2.0f * a * b / (a + b + std::numeric_limits<float>::min()); }

/// One explicit step of conduction, with `loss` = dt times the sink per kelvin.
FULCRUM_WIDE
void Conduct(Tile* tile, float dt_s, float loss) {
  for (int j = 0; j < kTile; ++j) {
    const float* __restrict t = &tile->theta[ThetaIndex(0, j)];
    const float* __restrict fx = &tile->face_x[j * kFaceStride];
    const float* __restrict fy = &tile->face_y[j * kTile];
    float* __restrict h = &tile->state.enthalpy[j * kTile];
    for (int i = 0; i < kTile; ++i) {
      const float flux = fx[i] * (t[i - 1] - t[i]) + fx[i + 1] * (t[i + 1] - t[i]) +
                         fy[i] * (t[i - kThetaStride] - t[i]) + fy[i + kTile] * (t[i + kThetaStride] - t[i]);
      h[i] += dt_s * flux - loss * t[i];
    }
  }
}

/// theta with its column sums and extremes; rc = rc_dry + water * rc_water.
FULCRUM_WIDE
void ComputeTheta(Tile* tile, float rc_dry, float rc_water) {
  alignas(64) float sum[kTile] = {}, high[kTile] = {}, low[kTile] = {};
  for (int j = 0; j < kTile; ++j) {
    float* __restrict t = &tile->theta[ThetaIndex(0, j)];
    const float* __restrict h = &tile->state.enthalpy[j * kTile];
    const float* __restrict w = &tile->state.water[j * kTile];
    for (int i = 0; i < kTile; ++i) {
      t[i] = h[i] / (rc_dry + w[i] * rc_water);
      sum[i] += t[i];
      high[i] = high[i] > t[i] ? high[i] : t[i];
      low[i] = low[i] < t[i] ? low[i] : t[i];
    }
  }
  std::copy_n(sum, kTile, tile->theta_sum.begin());
  tile->theta_max = *std::max_element(high, high + kTile);
  tile->theta_min = *std::min_element(low, low + kTile);
}

}  // namespace

bool IsBlank(const TileState& s) {
  // Water only goes with heat, and heat that boils or takes out a cell also damages it.
  const auto zero = [](float omega) { return omega == 0.0f; };
  const auto bad = [](std::uint8_t flags) { return (flags & (kRemoved | kQuarantined)) != 0; };
  return s.awake == 0 && std::all_of(s.omega_cell.begin(), s.omega_cell.end(), zero) &&
         std::none_of(s.flags.begin(), s.flags.end(), bad);
}

HeatField::HeatField(Sheet sheet, const Material& material)
    : sheet_(std::move(sheet)), material_(material), tiles_(sheet_.tile_count()) {}

Tile* HeatField::Find(int tx, int ty) const {
  if (tx < 0 || ty < 0 || tx >= sheet_.tiles_x || ty >= sheet_.tiles_y) return nullptr;
  return tiles_[ty * sheet_.tiles_x + tx].get();
}

Tile* HeatField::Create(int index) {
  auto tile = std::make_unique<Tile>();
  tile->index = index;
  tile->tx = index % sheet_.tiles_x;
  tile->ty = index / sheet_.tiles_x;
  const CellMetric metric = sheet_.metric[index];
  tile->volume = material_.cell_m * material_.cell_m * metric.s * metric.t * material_.thickness_m;
  for (int j = 0; j < kTile; ++j) {
    for (int i = 0; i < kTile; ++i) {
      const bool outside = sheet_.IsOutside(tile->tx * kTile + i, tile->ty * kTile + j);
      tile->state.flags[j * kTile + i] = outside ? kOutside : 0;
      tile->state.water[j * kTile + i] = outside ? 0.0f : 1.0f;
    }
  }
  tiles_[index] = std::move(tile);
  return tiles_[index].get();
}

Tile* HeatField::Wake(int tx, int ty) {
  if (tx < 0 || ty < 0 || tx >= sheet_.tiles_x || ty >= sheet_.tiles_y) return nullptr;
  const int index = ty * sheet_.tiles_x + tx;
  Tile* tile = tiles_[index] ? tiles_[index].get() : Create(index);
  if (tile->state.awake) return tile;
  tile->state.awake = 1;
  tile->faces_stale = true;
  const auto before = std::lower_bound(awake_.begin(), awake_.end(), index,
                                       [](const Tile* t, int wanted) { return t->index < wanted; });
  awake_.insert(before, tile);
  return tile;
}

float HeatField::CellConductivity(const Tile& tile, int cell) const {
  return (tile.state.flags[cell] & kNoTissue) != 0 ? 0.0f : material_.ThermalConductivity(tile.state.water[cell]);
}

void HeatField::BuildFaces(Tile* tile) {
  alignas(64) std::array<float, (kTile + 2) * kThetaStride> k{};  // padded like theta
  for (int j = 0; j < kTile; ++j) {
    for (int i = 0; i < kTile; ++i) k[ThetaIndex(i, j)] = CellConductivity(*tile, j * kTile + i);
  }
  const Tile* left = Find(tile->tx - 1, tile->ty);
  const Tile* right = Find(tile->tx + 1, tile->ty);
  const Tile* up = Find(tile->tx, tile->ty - 1);
  const Tile* down = Find(tile->tx, tile->ty + 1);
  const auto awake = [](const Tile* t) { return t != nullptr && t->state.awake != 0; };
  for (int n = 0; n < kTile; ++n) {
    if (awake(left)) k[ThetaIndex(-1, n)] = CellConductivity(*left, n * kTile + kTile - 1);
    if (awake(right)) k[ThetaIndex(kTile, n)] = CellConductivity(*right, n * kTile);
    if (awake(up)) k[ThetaIndex(n, -1)] = CellConductivity(*up, (kTile - 1) * kTile + n);
    if (awake(down)) k[ThetaIndex(n, kTile)] = CellConductivity(*down, n);
  }
  // Conductance of a face [W/K] is k d lt/ls along s. At a border of tiles both sides must use the same number, so the
  // metric is averaged there, and each side divides by its own volume.
  const auto along_s = [&](int index) { return sheet_.metric[index].t / sheet_.metric[index].s; };
  const auto along_t = [&](int index) { return sheet_.metric[index].s / sheet_.metric[index].t; };
  const auto between = [&](const auto& ratio, const Tile* other) {
    return other == nullptr ? ratio(tile->index) : 0.5f * (ratio(tile->index) + ratio(other->index));
  };
  const float scale = material_.thickness_m / tile->volume;
  for (int j = 0; j < kTile; ++j) {
    float* row = &tile->face_x[j * kFaceStride];
    const float* kr = &k[ThetaIndex(0, j)];
    const float inner = scale * along_s(tile->index);
    for (int i = 0; i <= kTile; ++i) row[i] = inner * Harmonic(kr[i - 1], kr[i]);
    row[0] = scale * between(along_s, left) * Harmonic(kr[-1], kr[0]);
    row[kTile] = scale * between(along_s, right) * Harmonic(kr[kTile - 1], kr[kTile]);
  }
  for (int j = 0; j <= kTile; ++j) {
    const float ratio = j == 0 ? between(along_t, up) : (j == kTile ? between(along_t, down) : along_t(tile->index));
    for (int i = 0; i < kTile; ++i) {
      tile->face_y[j * kTile + i] = scale * ratio * Harmonic(k[ThetaIndex(i, j - 1)], k[ThetaIndex(i, j)]);
    }
  }
  float rate = 0;
  for (int j = 0; j < kTile; ++j) {
    for (int i = 0; i < kTile; ++i) {
      const float* fx = &tile->face_x[j * kFaceStride + i];
      const float* fy = &tile->face_y[j * kTile + i];
      const float sum = fx[0] + fx[1] + fy[0] + fy[kTile];
      rate = std::max(rate, sum / material_.HeatCapacity(tile->state.water[j * kTile + i]));
    }
  }
  tile->rate = rate + std::max(material_.loss_resting, material_.loss_tented) / material_.rc_dry;
}

void HeatField::MarkNeighboursStale(const Tile& tile) {
  for (Tile* other : {Find(tile.tx - 1, tile.ty), Find(tile.tx + 1, tile.ty), Find(tile.tx, tile.ty - 1),
                      Find(tile.tx, tile.ty + 1)}) {
    if (other != nullptr) other->faces_stale = true;
  }
}

void HeatField::RebuildStaleFaces() {
  // Two passes: marking while building would spread over the whole sheet.
  scratch_.clear();
  for (Tile* tile : awake_) {
    if (tile->faces_stale) scratch_.push_back(tile);
  }
  for (const Tile* tile : scratch_) MarkNeighboursStale(*tile);
  for (Tile* tile : awake_) {
    if (tile->faces_stale) BuildFaces(tile);
    tile->faces_stale = false;
  }
}

void HeatField::ExchangeHalos(Tile* tile) {
  const Tile* left = Find(tile->tx - 1, tile->ty);
  const Tile* right = Find(tile->tx + 1, tile->ty);
  const Tile* up = Find(tile->tx, tile->ty - 1);
  const Tile* down = Find(tile->tx, tile->ty + 1);
  float* theta = tile->theta.data();
  // The face to an absent or sleeping neighbour is zero, so the old halo value there does no harm, as long as it is
  // finite: it is.
  for (int n = 0; n < kTile; ++n) {
    if (left != nullptr) theta[ThetaIndex(-1, n)] = left->theta[ThetaIndex(kTile - 1, n)];
    if (right != nullptr) theta[ThetaIndex(kTile, n)] = right->theta[ThetaIndex(0, n)];
  }
  if (up != nullptr) std::copy_n(&up->theta[ThetaIndex(0, kTile - 1)], kTile, &theta[ThetaIndex(0, -1)]);
  if (down != nullptr) std::copy_n(&down->theta[ThetaIndex(0, 0)], kTile, &theta[ThetaIndex(0, kTile)]);
}

void HeatField::Substep(Tile* tile, float dt_s, Ledger* ledger) {
  const float loss = dt_s * (tile->state.tented ? material_.loss_tented : material_.loss_resting);
  Conduct(tile, dt_s, loss);
  double sum = 0;
  for (const float s : tile->theta_sum) sum += s;
  ledger->lost += sum * loss * tile->volume;
}

void HeatField::RefreshTheta(Tile* tile, Ledger* ledger) {
  ComputeTheta(tile, material_.rc_dry, material_.rc_wet - material_.rc_dry);
  float total = 0;
  for (const float s : tile->theta_sum) total += s;
  if (!std::isfinite(total) || tile->theta_max > kThetaPlausible || tile->theta_min < -kThetaPlausible) {
    Quarantine(tile, ledger);
  }
}

void HeatField::Quarantine(Tile* tile, Ledger* ledger) {
  for (int cell = 0; cell < kTileCells; ++cell) {
    const float theta = tile->theta[ThetaIndex(cell % kTile, cell / kTile)];
    const bool material_good = std::isfinite(tile->state.water[cell]);
    if (material_good && std::abs(theta) <= kThetaPlausible) continue;
    TakeOut(tile, cell, kQuarantined, &ledger->quarantined);
    ++quarantined_;
    last_quarantined_ = {tile->tx * kTile + cell % kTile, tile->ty * kTile + cell / kTile};
  }
  RefreshTheta(tile, ledger);  // all cells are plausible now
}

void HeatField::TakeOut(Tile* tile, int cell, CellFlag why, double* account) {
  TileState& s = tile->state;
  // What was not finite cannot be booked as heat; what was, must be.
  if (std::isfinite(s.enthalpy[cell])) *account += static_cast<double>(s.enthalpy[cell]) * tile->volume;
  s.enthalpy[cell] = 0;
  s.water[cell] = 0;
  s.flags[cell] = static_cast<std::uint8_t>(s.flags[cell] | why);
  tile->theta[ThetaIndex(cell % kTile, cell / kTile)] = 0;
  tile->faces_stale = true;
  tile->patch_stale = true;
}

void HeatField::Boil(Tile* tile, Ledger* ledger) {
  if (tile->theta_max <= material_.theta_boil) return;
  TileState& s = tile->state;
  double steam = 0;
  for (int cell = 0; cell < kTileCells; ++cell) {
    const float excess = s.enthalpy[cell] - material_.BoilingEnthalpy(s.water[cell]);
    if (excess <= 0.0f || s.water[cell] <= 0.0f) continue;
    const float before = s.enthalpy[cell];
    const float boiled = std::min(s.water[cell], excess / material_.latent);
    s.water[cell] -= boiled;
    s.enthalpy[cell] = material_.BoilingEnthalpy(s.water[cell]) + (excess - boiled * material_.latent);
    steam += static_cast<double>(before) - static_cast<double>(s.enthalpy[cell]);
  }
  if (steam > 0) {
    ledger->vapour += steam * tile->volume;
    tile->faces_stale = true;
    RefreshTheta(tile, ledger);
  }
}

int HeatField::Diffuse(float dt_s, Ledger* ledger) {
  if (awake_.empty()) return 0;
  WakeNeighbours();
  RebuildStaleFaces();
  float rate = 0;
  for (const Tile* tile : awake_) rate = std::max(rate, tile->rate);
  const int substeps = std::max(1, static_cast<int>(std::ceil(dt_s * rate / kExplicitLimit)));
  const float h = dt_s / static_cast<float>(substeps);
  for (int n = 0; n < substeps; ++n) {
    for (Tile* tile : awake_) ExchangeHalos(tile);
    for (Tile* tile : awake_) Substep(tile, h, ledger);
    for (Tile* tile : awake_) {
      RefreshTheta(tile, ledger);
      Boil(tile, ledger);
      tile->patch_stale = true;
    }
  }
  SleepCold(ledger);
  return substeps;
}

void HeatField::WakeNeighbours() {
  // Over a copy: tiles that wake here are cold and need not be asked.
  scratch_.assign(awake_.begin(), awake_.end());
  const auto hold = [&](int tx, int ty) {
    if (Tile* tile = Wake(tx, ty)) tile->held = true;
  };
  for (const Tile* tile : scratch_) {
    if (tile->theta_max < kWakeTheta) continue;
    float left = 0, right = 0, up = 0, down = 0;
    for (int n = 0; n < kTile; ++n) {
      left = std::max(left, tile->theta[ThetaIndex(0, n)]);
      right = std::max(right, tile->theta[ThetaIndex(kTile - 1, n)]);
      up = std::max(up, tile->theta[ThetaIndex(n, 0)]);
      down = std::max(down, tile->theta[ThetaIndex(n, kTile - 1)]);
    }
    if (left > kWakeTheta) hold(tile->tx - 1, tile->ty);
    if (right > kWakeTheta) hold(tile->tx + 1, tile->ty);
    if (up > kWakeTheta) hold(tile->tx, tile->ty - 1);
    if (down > kWakeTheta) hold(tile->tx, tile->ty + 1);
  }
}

void HeatField::SleepCold(Ledger* ledger) {
  const auto cold = [&](Tile* tile) {
    const bool held = std::exchange(tile->held, false);
    if (held || std::max(tile->theta_max, -tile->theta_min) >= kSleepTheta) return false;
    double heat = 0;
    for (const float h : tile->state.enthalpy) heat += h;
    ledger->dropped += heat * tile->volume;
    tile->state.enthalpy.fill(0);
    tile->theta.fill(0);
    tile->theta_sum.fill(0);
    tile->theta_max = tile->theta_min = 0;
    tile->state.awake = 0;
    tile->patch_stale = true;
    MarkNeighboursStale(*tile);
    return true;
  };
  std::erase_if(awake_, cold);
}

double HeatField::Stored() const {
  double total = 0;
  for (const Tile* tile : awake_) {
    double heat = 0;
    for (const float h : tile->state.enthalpy) heat += h;
    total += heat * tile->volume;
  }
  return total;
}

float HeatField::MaxTheta() const {
  float high = 0;
  for (const Tile* tile : awake_) high = std::max(high, tile->theta_max);
  return high;
}

std::vector<const Tile*> HeatField::Existing() const {
  std::vector<const Tile*> all;
  for (const auto& tile : tiles_) {
    if (tile) all.push_back(tile.get());
  }
  return all;
}

void HeatField::Clear() {
  awake_.clear();
  for (auto& tile : tiles_) tile.reset();
  quarantined_ = 0;
}

void HeatField::Restore(int index, const TileState& state) {
  Tile* tile = Create(index);
  tile->state = state;
  tile->state.awake = 0;
  if (state.awake != 0) Wake(tile->tx, tile->ty);
  MarkNeighboursStale(*tile);
  Ledger none;  // a checkpoint holds no bad cells
  RefreshTheta(tile, &none);
}

}  // namespace fulcrum::thermal
