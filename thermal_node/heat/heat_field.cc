#include "thermal_node/heat/heat_field.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

namespace fulcrum::thermal {

bool IsBlank(const TileState& s) {
  // Water and charring need no check: heat that boils water or chars or removes a cell also damages it.
  const auto zero = [](float omega) { return omega == 0.0f; };
  const auto bad = [](std::uint8_t flags) { return (flags & (kRemoved | kQuarantined)) != 0; };
  return s.awake == 0 && std::all_of(s.omega_cell.begin(), s.omega_cell.end(), zero) &&
         std::none_of(s.flags.begin(), s.flags.end(), bad);
}

double Tile::Heat() const {
  double heat = 0;
  for (int cell = 0; cell < kTileCells; ++cell) {
    heat += static_cast<double>(state.enthalpy[cell]) * static_cast<double>(geometry.area[cell]);
  }
  return heat * flat_volume;
}

HeatField::HeatField(Sheet sheet, const Material& material)
    : sheet_(std::move(sheet)),
      materials_(static_cast<std::size_t>(sheet_.materials), material),
      tiles_(sheet_.tile_count()) {}

HeatField::HeatField(Sheet sheet, std::vector<Material> materials)
    : sheet_(std::move(sheet)), materials_(std::move(materials)), tiles_(sheet_.tile_count()) {
  if (materials_.size() != static_cast<std::size_t>(sheet_.materials)) {
    throw std::logic_error("HeatField: as many materials as the sheet has");
  }
}

Tile* HeatField::Find(int tx, int ty) const {
  if (tx < 0 || ty < 0 || tx >= sheet_.tiles_x || ty >= sheet_.tiles_y) return nullptr;
  return tiles_[ty * sheet_.tiles_x + tx].get();
}

Tile* HeatField::Create(int index) {
  auto tile = std::make_unique<Tile>();
  tile->index = index;
  tile->tx = index % sheet_.tiles_x;
  tile->ty = index / sheet_.tiles_x;
  tile->material = &materials_[static_cast<std::size_t>(sheet_.MaterialOf(tile->tx, tile->ty))];
  tile->flat_volume = tile->material->cell_m * tile->material->cell_m * tile->material->thickness_m;
  SetGeometry(sheet_, tile.get());
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
  MarkNeighboursStale(*tile);
  const auto before = std::lower_bound(awake_.begin(), awake_.end(), index,
                                       [](const Tile* t, int wanted) { return t->index < wanted; });
  awake_.insert(before, tile);
  return tile;
}

void HeatField::MarkNeighboursStale(const Tile& tile) {
  for (int n = 0; n < 9; ++n) {
    Tile* other = n == 4 ? nullptr : Find(tile.tx + n % 3 - 1, tile.ty + n / 3 - 1);
    if (other != nullptr) other->faces_stale = true;
  }
}

void HeatField::RebuildStaleFaces() {
  for (Tile* tile : awake_) {
    // Cells begin and cease to boil without a change of the material; see CellResistance.
    const bool may_boil = tile->has_front || tile->theta_max >= kFrontTheta * tile->material->theta_boil;
    if (!std::exchange(tile->material_stale, false) && !may_boil) continue;
    tile->faces_stale = true;
    ComputeResistance(tile);
  }
  for (Tile* tile : awake_) {
    if (std::exchange(tile->faces_stale, false)) BuildFaces(tile);
  }
}

void HeatField::Quarantine(Tile* tile, Ledger* ledger) {
  for (int cell = 0; cell < kTileCells; ++cell) {
    const float theta = tile->theta[ThetaIndex(cell % kTile, cell / kTile)];
    const bool material_good = tile->state.water[cell] >= 0.0f && tile->state.water[cell] <= 1.0f;
    if (material_good && std::abs(theta) <= kThetaPlausible) continue;
    TakeOut(tile, cell, kQuarantined, &ledger->quarantined);
    ++quarantined_;
    last_quarantined_ = {tile->tx * kTile + cell % kTile, tile->ty * kTile + cell / kTile};
  }
  RefreshTheta(tile, ledger);  // all cells are plausible now
}

void HeatField::TakeOut(Tile* tile, int cell, CellFlag why, double* account) {
  TileState& s = tile->state;
  // Finite heat is booked; a value that is not finite cannot be.
  if (std::isfinite(s.enthalpy[cell])) *account += static_cast<double>(s.enthalpy[cell]) * tile->Volume(cell);
  s.enthalpy[cell] = 0;
  s.water[cell] = 0;
  s.flags[cell] = static_cast<std::uint8_t>(s.flags[cell] | why);
  tile->theta[ThetaIndex(cell % kTile, cell / kTile)] = 0;
  tile->material_stale = true;
  tile->patch_stale = true;
}

void HeatField::Boil(Tile* tile, Ledger* ledger) {
  const Material& material = *tile->material;
  if (tile->theta_max <= material.theta_boil) return;
  TileState& s = tile->state;
  double steam = 0;
  for (int cell = 0; cell < kTileCells; ++cell) {
    const float excess = s.enthalpy[cell] - material.BoilingEnthalpy(s.water[cell]);
    if (excess <= 0.0f || s.water[cell] <= 0.0f) continue;
    const float before = s.enthalpy[cell];
    const float boiled = std::min(s.water[cell], excess / material.latent);
    s.water[cell] -= boiled;
    s.enthalpy[cell] = material.BoilingEnthalpy(s.water[cell]) + (excess - boiled * material.latent);
    steam += (static_cast<double>(before) - static_cast<double>(s.enthalpy[cell])) * tile->geometry.area[cell];
  }
  if (steam > 0) {
    ledger->vapour += steam * tile->flat_volume;
    tile->material_stale = true;
    RefreshTheta(tile, ledger);
  }
}

int HeatField::Diffuse(float dt_s, Ledger* ledger) {
  if (awake_.empty()) return 0;
  WakeNeighbours();
  RebuildStaleFaces();
  int most = 0;
  for (Tile* tile : awake_) tile->substeps = 0;
  for (Tile* seed : awake_) {
    if (seed->substeps > 0) continue;
    CollectIsland(seed);
    most = std::max(most, DiffuseIsland(dt_s, ledger));
  }
  SleepCold(ledger);
  return most;
}

void HeatField::CollectIsland(Tile* seed) {
  // The seed is the tile of lowest index, so the order within an island does not depend on other islands.
  island_.assign(1, seed);
  seed->substeps = 1;
  for (std::size_t n = 0; n < island_.size(); ++n) {
    const int tx = island_[n]->tx, ty = island_[n]->ty;
    for (Tile* other : {Find(tx - 1, ty), Find(tx + 1, ty), Find(tx, ty - 1), Find(tx, ty + 1)}) {
      if (other == nullptr || other->state.awake == 0 || other->substeps > 0) continue;
      if (other->material != seed->material) continue;
      other->substeps = 1;
      island_.push_back(other);
    }
  }
}

/// A step of n times the stable length takes n + 1 stages of that length, u <- u + h F(u), the last of which is
/// averaged with the state before the step: u <- u0 / (n + 1) + n / (n + 1) (u + h F(u)). It is of second order and
/// keeps the maximum principle of its stages; with n = 1 it is Heun's method (SSPRK(s, 2); Spiteri and Ruuth, SIAM J.
/// Numer. Anal. 40, 2002).
int HeatField::DiffuseIsland(float dt_s, Ledger* ledger) {
  float rate = 0;
  for (const Tile* tile : island_) rate = std::max(rate, tile->rate);
  const float needed = std::ceil(dt_s * rate / kExplicitLimit);
  const bool stiff = !(needed <= kMaxSubsteps);
  // In wet tissue the limiter must not reduce the fourth-order fluxes of waves of four cells and longer.
  const Material& material = *island_[0]->material;
  const float wet_rate = 4.0f * material.k_wet / (material.rc_wet * material.cell_m * material.cell_m);
  const float wanted = std::max(needed, std::ceil(dt_s * kResolvedGain * wet_rate / kExplicitLimit));
  const int substeps = stiff ? kMaxSubsteps : static_cast<int>(std::clamp<float>(wanted, 1, kMaxSubsteps));
  const float h = dt_s / static_cast<float>(substeps);
  if (stiff) {
    ++stiff_steps_;
    for (Tile* tile : island_) LimitFaces(tile, kExplicitLimit / h);
  }
  const float gain = stiff ? 1.0f : std::min(kFluxGain, kExplicitLimit / (h * rate));
  for (StageOf stage{0, substeps + 1, h, gain, !stiff}; stage.index < stage.count; ++stage.index) {
    // All halos are exchanged first, so that each tile passes through the whole stage while it is in the cache.
    for (Tile* tile : island_) ExchangeHalos(tile);
    for (Tile* tile : island_) {
      RunStage(tile, stage, ledger);
      if (!stage.last()) {
        ComputeMiddleTheta(tile);
        continue;
      }
      if (stiff) Cool(tile, dt_s, ledger);
      RefreshTheta(tile, ledger);
      Boil(tile, ledger);
    }
  }
  for (Tile* tile : island_) {
    tile->substeps = substeps;
    tile->patch_stale = tile->patch_stale || std::max(tile->theta_max, -tile->theta_min) > kVisibleTheta;
    tile->faces_stale = tile->faces_stale || stiff;
  }
  return substeps;
}

void HeatField::WakeNeighbours() {
  // Iterates over a copy: tiles that wake here are cold and wake no neighbours.
  scratch_.assign(awake_.begin(), awake_.end());
  int material = 0;
  const auto hold = [&](int tx, int ty) {
    if (sheet_.MaterialOf(tx, ty) != material) return;
    if (Tile* tile = Wake(tx, ty)) tile->held = true;
  };
  for (const Tile* tile : scratch_) {
    material = sheet_.MaterialOf(tile->tx, tile->ty);
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
    ledger->dropped += tile->Heat();
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

void HeatField::QuarantineBadDamage(Tile* tile, Ledger* ledger) {
  TileState& s = tile->state;
  for (int k = 0; k < kTileCells; ++k) {
    if (std::isfinite(s.omega_cell[k] + s.omega_collagen[k] + s.charred[k])) continue;
    s.omega_cell[k] = s.omega_collagen[k] = s.charred[k] = 0;
    TakeOut(tile, k, kQuarantined, &ledger->quarantined);
    // Its heat is booked; NaN makes RefreshTheta() count the cell.
    s.enthalpy[k] = std::numeric_limits<float>::quiet_NaN();
  }
  RefreshTheta(tile, ledger);
}

double HeatField::Stored() const {
  double total = 0;
  for (const Tile* tile : awake_) total += tile->Heat();
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

void HeatField::Restore(int index, const TileState& state, bool held) {
  Tile* tile = Create(index);
  tile->state = state;
  tile->state.awake = 0;
  tile->held = held;
  if (state.awake != 0) Wake(tile->tx, tile->ty);
  Ledger none;  // unused: a checkpoint holds no bad cells
  RefreshTheta(tile, &none);
}

}  // namespace fulcrum::thermal
