#include "thermal_node/coupling/source_window.h"

#include <algorithm>
#include <cmath>

#include "thermal_node/heat/wide.h"

namespace fulcrum::thermal {
namespace {

/// Rows with less than this share of the heat are left out of Change(): their heat density is too low to matter.
constexpr float kFaintRow = 0.01f;
/// Distance of a contact from the last one from which on the heat beyond the window is put down first [cells]. Assumed.
constexpr float kFarAway = 8.0f;
/// Longest coupling step in a mode with discharges [s]: cells that boil dry beneath a film are removed only at its end.
constexpr float kFilmStep_s = 1.6e-3f;
/// Maximum number of evaluations of Change() for one step: one more than needed where the change is proportional to the
/// step. From a step of seconds, which dries everything, each evaluation shortens the step by up to 1 / max_change.
constexpr int kStepTrials = 6;

/// Computes the inverse volume of a run of cells and their electrical conductivity, wet at body temperature.
FULCRUM_WIDE
void LoadTissue(const std::uint8_t* __restrict flags, const float* __restrict inverse_area, float flat_volume,
                float sigma, int count, float* __restrict inverse_volume, float* __restrict tissue) {
  for (int n = 0; n < count; ++n) {
    inverse_volume[n] = inverse_area[n] / flat_volume;
    tissue[n] = (flags[n] & kNoTissue) != 0 ? 0.0f : sigma;
  }
}

}  // namespace

SourceWindow::SourceWindow(std::span<const Material> materials, const Sheet& sheet)
    : materials_(materials), sheet_(sheet), material_(materials.data()), far_(materials.begin(), materials.end()) {
  gap_.fill(kFarGap);
}

void SourceWindow::Export(State* state) const {
  state->corner = corner_;
  state->step_s = step_s_;
  state->interface = interface_;
  potential_.ExportStart(&state->start);
}

void SourceWindow::Import(const State& state) {
  corner_ = state.corner;
  step_s_ = state.step_s;
  interface_ = state.interface;
  potential_.ImportStart(state.start);
}

void SourceWindow::MoveTo(CellIndex corner) {
  if (corner == corner_) return;
  const int di = corner.ix - corner_.ix, dj = corner.iy - corner_.iy;
  // After a touch-down elsewhere the last potential is no useful start value.
  const bool near = std::abs(di) < kWindow / 4 && std::abs(dj) < kWindow / 4;
  near ? potential_.Shift(di, dj) : potential_.ImportStart({});
  if (!near) step_s_ = 0;
  corner_ = corner;
}

void SourceWindow::SelectMaterial(int number) {
  number_ = number;
  material_ = &materials_[static_cast<std::size_t>(number)];
}

Tile* SourceWindow::TileAt(HeatField* field, int ix, int iy) const {
  if (ix < 0 || iy < 0 || sheet_.MaterialOf(ix / kTile, iy / kTile) != number_) return nullptr;
  return field->Wake(ix / kTile, iy / kTile);
}

/// Visits every run of cells of one window row within one tile: visit(tile, cell in tile, cell in window, count). Cells
/// beyond the sheet or of another material are visited with tile == nullptr.
template <class Visit>
void SourceWindow::ForTileRows(HeatField* field, const Visit& visit) {
  const auto place = [](int cell) { return ((cell % kTile) + kTile) % kTile; };  // in its tile
  for (int j = 0, rows = 0; j < kWindow; j += rows) {
    const int iy = corner_.iy + j, in_y = place(iy);
    rows = std::min(kTile - in_y, kWindow - j);
    for (int i = 0, run = 0; i < kWindow; i += run) {
      const int ix = corner_.ix + i, in_x = place(ix);
      run = std::min(kTile - in_x, kWindow - i);
      Tile* tile = TileAt(field, ix, iy);
      for (int n = 0; n < rows; ++n) visit(tile, (in_y + n) * kTile + in_x, (j + n) * kWindow + i, run);
    }
  }
}

void SourceWindow::RefreshTiles(HeatField* field, Ledger* ledger) {
  for (int n = 0; n < 9; ++n) {
    const int ix = corner_.ix + std::min((n % 3) * kTile, kWindow - 1);
    const int iy = corner_.iy + std::min((n / 3) * kTile, kWindow - 1);
    Tile* tile = TileAt(field, ix, iy);
    if (tile != nullptr) field->RefreshTheta(tile, ledger);
  }
}

void SourceWindow::Load(HeatField* field, Ledger* ledger) {
  // Cells with values that are not finite are quarantined first: one of them would ruin the potential of the whole
  // window.
  RefreshTiles(field, ledger);
  ForTileRows(field, [&](const Tile* tile, int from, int to, int count) {
    if (tile == nullptr) {
      std::fill_n(&enthalpy_[to], count, 0.0f);
      std::fill_n(&water_[to], count, 0.0f);
      std::fill_n(&flags_[to], count, kOutside);
      std::fill_n(&inverse_volume_[to], count, 0.0f);
      std::fill_n(&tissue_[to], count, 0.0f);
      return;
    }
    std::copy_n(&tile->state.enthalpy[from], count, &enthalpy_[to]);
    std::copy_n(&tile->state.water[from], count, &water_[to]);
    std::copy_n(&tile->state.flags[from], count, &flags_[to]);
    LoadTissue(&tile->state.flags[from], &tile->geometry.inverse_area[from], tile->flat_volume, material_->sigma, count,
               &inverse_volume_[to], &tissue_[to]);
  });
}

void SourceWindow::Store(HeatField* field, bool tented) {
  ForTileRows(field, [&](Tile* tile, int to, int from, int count) {
    if (tile == nullptr) return;
    tile->state.tented = tented ? 1 : 0;
    std::copy_n(&enthalpy_[from], count, &tile->state.enthalpy[to]);
    if (std::equal(&water_[from], &water_[from] + count, &tile->state.water[to]) &&
        std::equal(&flags_[from], &flags_[from] + count, &tile->state.flags[to])) {
      return;
    }
    std::copy_n(&water_[from], count, &tile->state.water[to]);
    std::copy_n(&flags_[from], count, &tile->state.flags[to]);
    tile->material_stale = tile->patch_stale = true;
  });
}

FULCRUM_WIDE
void SourceWindow::SetSigma() {
  const float rc_dry = material_->rc_dry, rc_water = material_->rc_wet - material_->rc_dry;
  const float boil = material_->theta_boil, slope = material_->sigma_per_K;
  for (int k = 0; k < kWindowCells; ++k) {
    const float theta = enthalpy_[k] / (rc_dry + water_[k] * rc_water);
    const float capped = std::min(std::max(theta, 0.0f), boil);
    const float wet = std::max(water_[k], kDrySigmaFraction);
    problem_.sigma[k] = tissue_[k] * (1.0f + slope * capped) * wet;
  }
}

void SourceWindow::SetContact(const Drive& drive) {
  problem_.contact.fill(0);
  problem_.lost.fill(0);
  const float cell = material_->cell_m, area = cell * cell * metric_.area();
  // Conductance per area from the touched face to the middle of the sheet: sigma / (d / 2).
  const float per_sigma = (1.0f - interface_.film) * 2.0f * area / material_->thickness_m;
  const float burning = interface_.film * interface_.burning * kDischarge_S_m2 * area;
  const float per_arc = drive.arc_m > 0.0f ? cell / drive.arc_m : 1e6f, per_reach = cell / kFilmReach_m;
  for (int j = gap_low_.iy; j <= gap_high_.iy; ++j) {
    for (int i = gap_low_.ix; i <= gap_high_.ix; ++i) {
      const int k = j * kWindow + i;
      if (!(gap_[k] < kFarGap) || !(tissue_[k] > 0.0f)) continue;
      const float covered = Electrode::Covered(gap_[k]);
      // Distance of the middle of the part that is not covered [cells].
      const float beyond = std::max(gap_[k], 0.5f * (1.0f - covered));
      const float rarer = std::max(1.0f - beyond * per_arc, 0.0f), fewer = std::max(1.0f - beyond * per_reach, 0.0f);
      const float wet = covered + (1.0f - covered) * kArcConductance * rarer * rarer;
      const float film = burning * (covered + (1.0f - covered) * fewer * fewer);
      problem_.contact[k] = wet * per_sigma * problem_.sigma[k] + film;
      problem_.lost[k] = (1.0f - kTissueShare) * film;
    }
  }
}

float SourceWindow::Boiling() const {
  const float rc_dry = material_->rc_dry, rc_water = material_->rc_wet - material_->rc_dry;
  constexpr float kNearlyBoils = 0.98f;
  const float reach = kFilmReach_m / material_->cell_m;
  float all = 0, boiling = 0;
  for (int j = gap_low_.iy; j <= gap_high_.iy; ++j) {
    for (int i = gap_low_.ix; i <= gap_high_.ix; ++i) {
      const int k = j * kWindow + i;
      if (!(gap_[k] < reach) || !(tissue_[k] > 0.0f)) continue;
      const float weight = std::min(1.0f - gap_[k] / reach, 1.0f);
      all += weight;
      const bool boils = enthalpy_[k] >= kNearlyBoils * (rc_dry + water_[k] * rc_water) * material_->theta_boil;
      boiling += boils ? weight : 0.0f;
    }
  }
  return all > 0.0f ? boiling / all : 0.0f;
}

void SourceWindow::ExchangeWithHook(float dt_s, Ledger* ledger) {
  const float rc_dry = material_->rc_dry, rc_water = material_->rc_wet - material_->rc_dry;
  const float transfer = kHookContact_W_m2K + interface_.film * (kHookFilm_W_m2K - kHookContact_W_m2K);
  const float per_area = transfer * dt_s / material_->thickness_m;  // [J/m^3K] of a covered cell
  double given = 0;
  for (int j = gap_low_.iy; j <= gap_high_.iy; ++j) {
    for (int i = gap_low_.ix; i <= gap_high_.ix; ++i) {
      const int k = j * kWindow + i;
      if (!(gap_[k] < 0.5f) || !(tissue_[k] > 0.0f)) continue;
      const float rc = rc_dry + water_[k] * rc_water;
      // At most half of the difference from equilibrium, for any time step: keeps the explicit exchange stable.
      const float rate = std::min(per_area * Electrode::Covered(gap_[k]), 0.5f * rc);
      const float heat = rate * (interface_.hook_theta - enthalpy_[k] / rc);
      enthalpy_[k] += heat;
      given += static_cast<double>(heat) / static_cast<double>(inverse_volume_[k]);
    }
  }
  ledger->hook += given;
  interface_.hook_theta -= static_cast<float>(given) / kHookHeatCapacity_J_K;
}

/// Fraction of the electrode voltage that drops across the film: root of the mean square, weighted by conductance.
float SourceWindow::FilmDrop() const {
  double conductance = 0;
  for (int j = gap_low_.iy; j <= gap_high_.iy; ++j) {
    for (int i = gap_low_.ix; i <= gap_high_.ix; ++i)
      conductance += static_cast<double>(problem_.lost[j * kWindow + i]);
  }
  return conductance > 0.0 ? static_cast<float>(std::sqrt(static_cast<double>(solved_.lost_S) / conductance)) : 1.0f;
}

/// Subtracts the film's heat from dissipated_, because it does not depend on the tissue beneath.
void SourceWindow::LeaveOutFilm() {
  for (int j = gap_low_.iy; j <= gap_high_.iy; ++j) {
    for (int i = gap_low_.ix; i <= gap_high_.ix; ++i) {
      const int k = j * kWindow + i;
      if (!(problem_.lost[k] > 0.0f)) continue;
      const float drop = 1.0f - potential_.Voltage(i, j);
      const float film = problem_.lost[k] * (kTissueShare / (1.0f - kTissueShare)) * drop * drop;
      dissipated_[k] = std::max(dissipated_[k] - film, 0.0f);
    }
  }
}

FULCRUM_WIDE
float SourceWindow::Change(float v2_s, float heat_S) const {
  const float rc_dry = material_->rc_dry, rc_water = material_->rc_wet - material_->rc_dry;
  const float boil = material_->theta_boil, slope = material_->sigma_per_K, per_latent = 1.0f / material_->latent;
  alignas(64) float sum[kWindow] = {};
  for (int j = 0; j < kWindow; ++j) {
    if (potential_.row_heat()[j] < kFaintRow * heat_S) continue;
    const float* __restrict q = &potential_.heat()[j * kWindow];
    const float* __restrict dissipated = &dissipated_[j * kWindow];
    const float* __restrict h = &enthalpy_[j * kWindow];
    const float* __restrict w = &water_[j * kWindow];
    const float* __restrict iv = &inverse_volume_[j * kWindow];
    const float* __restrict sigma = &problem_.sigma[j * kWindow];
    const float* __restrict tissue = &tissue_[j * kWindow];
    for (int i = 0; i < kWindow; ++i) {
      const float after = h[i] + v2_s * q[i] * iv[i];
      const float rc = rc_dry + w[i] * rc_water;
      const float excess = (after - rc * boil) * per_latent;
      const float some = excess > 0.0f ? excess : 0.0f;
      const float boiled = some < w[i] ? some : w[i];
      const float theta = after / rc;
      const float capped = theta < boil ? theta : boil;
      const float left = w[i] - boiled;
      const float wet = w[i] > kDrySigmaFraction ? w[i] : kDrySigmaFraction;
      const float dried = left > kDrySigmaFraction ? left : kDrySigmaFraction;
      const float warmed = tissue[i] * (1.0f + slope * capped) * wet;
      const float change = (warmed - sigma[i]) / (warmed + sigma[i] + 1e-20f) + (wet - dried) / (wet + dried);
      sum[i] += dissipated[i] * change * change;
    }
  }
  float total = 0;
  for (const float s : sum) total += s;
  return std::sqrt(total / heat_S);
}

float SourceWindow::StepByChange(float v2, float heat_S, float longest) const {
  float step = longest;
  for (int n = 0; n < kStepTrials; ++n) {
    const float change = Change(v2 * step, heat_S);
    if (!(change > 1.1f * max_change)) break;  // also false for NaN, where nothing is heated
    step *= max_change / change;
  }
  return step;
}

FULCRUM_WIDE
void SourceWindow::BoilRow(int j, float remove_theta, Ledger* ledger) {
  const float rc_dry = material_->rc_dry, rc_water = material_->rc_wet - material_->rc_dry;
  const float boil = material_->theta_boil, latent = material_->latent, too_hot = rc_dry * std::max(remove_theta, boil);
  float* __restrict h = &enthalpy_[j * kWindow];
  float* __restrict w = &water_[j * kWindow];
  const float* __restrict tissue = &tissue_[j * kWindow];
  alignas(64) float before[kWindow], after[kWindow], boiled[kWindow];
  // Evaluated for every cell, with 0 where nothing boils, and the choices in loops of their own: a branch would prevent
  // vectorisation.
  for (int i = 0; i < kWindow; ++i) {
    const float water = w[i], excess = h[i] - (rc_dry + water * rc_water) * boil;
    const float some = (excess > 0.0f ? excess : 0.0f) / latent, there = tissue[i] > 0.0f ? water : 0.0f;
    boiled[i] = some < there ? some : there;
    w[i] = water - boiled[i];
    before[i] = h[i];
    after[i] = (rc_dry + w[i] * rc_water) * boil + (excess - boiled[i] * latent);
  }
  for (int i = 0; i < kWindow; ++i) h[i] = boiled[i] > 0.0f ? after[i] : before[i];
  std::uint32_t removable = 0;
  for (int i = 0; i < kWindow; ++i) {
    const float dry = w[i] > 0.0f ? 0.0f : h[i], hot = tissue[i] > 0.0f ? dry : 0.0f;
    removable |= hot >= too_hot ? 1u : 0u;
  }
  double steam = 0;
  for (int i = 0; i < kWindow; ++i) {
    if (h[i] == before[i]) continue;
    steam += (static_cast<double>(before[i]) - static_cast<double>(h[i])) / inverse_volume_[j * kWindow + i];
  }
  ledger->vapour += steam;
  if (removable != 0) RemoveDry(j, too_hot, ledger);
}

/// Removes dry cells whose enthalpy is at least `too_hot` [J/m^3].
void SourceWindow::RemoveDry(int j, float too_hot, Ledger* ledger) {
  for (int i = 0; i < kWindow; ++i) {
    const int k = j * kWindow + i;
    if (!(tissue_[k] > 0.0f) || water_[k] > 0.0f || !(enthalpy_[k] >= too_hot)) continue;
    ledger->removed += static_cast<double>(enthalpy_[k]) / static_cast<double>(inverse_volume_[k]);
    enthalpy_[k] = 0;
    water_[k] = 0;
    flags_[k] = static_cast<std::uint8_t>(flags_[k] | kRemoved);
    tissue_[k] = 0;
    ++stats_.removed_cells;
    const CellIndex cell{corner_.ix + i, corner_.iy + j};
    stats_.low = {std::min(stats_.low.ix, cell.ix), std::min(stats_.low.iy, cell.iy)};
    stats_.high = {std::max(stats_.high.ix, cell.ix), std::max(stats_.high.iy, cell.iy)};
  }
}

FULCRUM_WIDE
void SourceWindow::Deposit(float v2_s, float remove_theta, Ledger* ledger) {
  const float rc_dry = material_->rc_dry, rc_water = material_->rc_wet - material_->rc_dry;
  const float boil = material_->theta_boil;
  for (int j = 0; j < kWindow; ++j) {
    const float* __restrict q = &potential_.heat()[j * kWindow];
    float* __restrict h = &enthalpy_[j * kWindow];
    const float* __restrict w = &water_[j * kWindow];
    const float* __restrict iv = &inverse_volume_[j * kWindow];
    std::uint32_t boiling = 0;
    for (int i = 0; i < kWindow; ++i) {
      h[i] += v2_s * q[i] * iv[i];
      boiling |= h[i] >= (rc_dry + w[i] * rc_water) * boil ? 1u : 0u;
    }
    if (boiling != 0) BoilRow(j, remove_theta, ledger);
  }
}

void SourceWindow::Run(HeatField* field, const TipPath& path, const Drive& drive, float duration_s, Ledger* ledger) {
  const Vec2f centre = 0.5f * (path.from + path.to);
  const CellIndex middle = sheet_.CellOf(centre);
  // The heat beyond the window belongs to the place and the kind of contact before.
  const float away = (centre - far_middle_).norm() / material_->cell_m;
  const int number = sheet_.MaterialAt(middle);
  if (path.tented != far_tented_ || away > kFarAway || number != number_) DepositFar(field, false, ledger);
  SelectMaterial(number);
  MoveTo({middle.ix - kWindow / 2, middle.iy - kWindow / 2});
  Load(field, ledger);
  metric_ = sheet_.MetricAt(static_cast<float>(middle.ix), static_cast<float>(middle.iy));
  problem_.face_s = material_->thickness_m * metric_.tt / metric_.area();
  problem_.face_t = material_->thickness_m * metric_.ss / metric_.area();
  SetSigma();
  const float reach_m = std::max(drive.arc_m, kFilmReach_m);
  SetGaps(path, 0.5f, reach_m);
  SetLeak(centre, path.tented);
  SetGround(centre, path.tented);
  const float cells = (path.to - path.from).norm() / material_->cell_m;
  const float by_travel = duration_s / std::clamp(cells / kMaxTravel, 1.0f, kMaxStepsByTravel);
  const float by_film = drive.discharges ? kFilmStep_s : by_travel;
  const float longest = std::max(std::min(by_travel, by_film), std::min(min_step_s, duration_s));
  leak_V2s_.fill(0);
  float t = 0;
  for (bool last = !(duration_s > 0.0f); !last;) {
    const float rest = duration_s - t;
    SetGaps(path, (t + 0.5f * std::min(step_s_, rest)) / duration_s, reach_m);
    const float asked = drive.power_W > 0.0f ? SolveStep(drive, longest) : longest;
    const float step = std::max(asked, min_step_s);
    // The rest is divided into steps of equal length, which avoids a very short last step.
    const float steps = std::ceil(rest / step);
    last = steps <= 1.0f;
    const float dt = last ? rest : rest / steps;
    if (drive.power_W > 0.0f) Heat(drive, path.tented, dt, ledger);
    ExchangeWithHook(dt, ledger);
    interface_.Follow(Boiling(), drive.power_W > 0.0f && drive.discharges, dt);
    SetSigma();
    if (!last)
      ++(std::min(asked, by_travel) < min_step_s ? stats_.by_floor
         : asked < longest                       ? stats_.by_change
                                                 : stats_.by_travel);
    t += dt;
    step_s_ = dt;
  }
  Store(field, path.tented);
  RefreshTiles(field, ledger);
}

/// Solves for the potential; returns the length of the coupling step for which it is valid [s].
float SourceWindow::SolveStep(const Drive& drive, float longest) {
  SetContact(drive);
  solved_ = potential_.Solve(problem_, tolerance);
  stats_.voltage_V = RegulatedVoltage(drive, solved_.conductance_S);
  stats_.current_A = stats_.voltage_V * solved_.conductance_S;
  stats_.imbalance = std::max(stats_.imbalance, solved_.imbalance);
  stats_.iterations += solved_.iterations;
  ++stats_.solves;
  if (drive.discharges && interface_.film > 0.0f && stats_.voltage_V > 0.0f) {
    interface_.Regulate(FilmDrop() * stats_.voltage_V / std::sqrt(drive.duty));
  }
  dissipated_ = potential_.heat();
  if (interface_.film > 0.0f) LeaveOutFilm();
  return StepByChange(stats_.voltage_V * stats_.voltage_V, static_cast<float>(solved_.heat_S), longest);
}

void SourceWindow::Heat(const Drive& drive, bool tented, float dt_s, Ledger* ledger) {
  const float v2_s = stats_.voltage_V * stats_.voltage_V * dt_s;
  if (keep_leak_ && !tented) AddLeak(v2_s);
  AddFar(v2_s);
  Deposit(v2_s, drive.remove_theta, ledger);
  const double film = static_cast<double>(v2_s) * solved_.lost_S;
  const double metal = film * static_cast<double>(kMetalShare / (1.0f - kTissueShare));
  interface_.hook_theta += static_cast<float>(metal) / kHookHeatCapacity_J_K;
  ledger->joule += static_cast<double>(v2_s) * solved_.heat_S;
  ledger->film += film;
  ledger->plume += film - metal;
  ledger->generator += static_cast<double>(v2_s) * static_cast<double>(solved_.conductance_S);
}

}  // namespace fulcrum::thermal
