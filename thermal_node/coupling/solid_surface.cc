#include "thermal_node/coupling/solid_surface.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>

#include "services/base/core/hash.h"
#include "thermal_node/coupling/tip_parts.h"
#include "thermal_node/protected/protected_structures.h"
#include "thermal_node/volume/volume_material.h"

namespace fulcrum::thermal {
namespace {

constexpr std::uint64_t kMeasureFrames = 10;  ///< Frames between two counts of the dead cells.
constexpr float kReported_m2 = 1e-6f;         ///< Growth of the dead area after which a burn is reported again.

}  // namespace

Material MakeSolidMaterial(const ThermalParams& scene) {
  ThermalParams params = scene;
  params.cell_m = kSolidCell_m;
  params.thickness_m = kSolidLayer_m;
  params.density_kg_m3 = kRectumWall.density_kg_m3;
  params.heat_capacity_J_kgK = kRectumWall.heat_capacity_J_kgK;
  params.conductivity_W_mK = kRectumWall.conductivity_W_mK;
  params.latent_heat_J_m3 = kRectumWall.latent_J_m3;
  params.h_below_W_m2K = 4.0f * kRectumWall.conductivity_W_mK / (std::numbers::pi_v<float> * kSolidDisc_m);
  params.sigma_fat_S_m = params.sigma_S_m;
  params.fat_depth_m = kSolidDepth_m;
  return MakeMaterial(params);
}

SolidSurface::SolidSurface(const TissueScene& scene) : SolidSurface(scene, MakeSolidCharts(scene)) {}

SolidSurface::SolidSurface(const TissueScene& scene, SolidCharts charts)
    : params_(scene.thermal),
      material_(MakeSolidMaterial(scene.thermal)),
      field_(MakeSolidSheet(scene, charts), material_),
      damage_(material_.body_C),
      source_(material_, field_.sheet()),
      charts_(std::move(charts)),
      charts_of_tile_(static_cast<std::size_t>(field_.sheet().tile_count())) {
  const std::vector<Index>& of = charts_.of_triangle;
  const auto without = std::count(of.begin(), of.end(), kNoIndex);
  left_out_ = of.empty() ? 0.0f : static_cast<float>(without) / static_cast<float>(of.size());
}

bool SolidSurface::Step(std::span<const TipInput> tips, float dt_s, Interface* hook) {
  burns_.clear();
  warnings_.clear();
  const bool acts =
      std::any_of(tips.begin(), tips.end(), [&](const TipInput& tip) { return Acts(tip, hook->hook_theta); });
  if (!acts && field_.idle()) {
    power_W_ = set_power_W_ = voltage_V_ = 0;
    return false;
  }
  ++frame_;
  const double before_J = ledger_.generator;
  source_.SetInterface(*hook);
  source_.ClearStats();
  ApplySource(tips, dt_s, 0.0f, 0.5f);
  source_.DepositFar(&field_, true, &ledger_);
  (void)field_.Diffuse(dt_s, &ledger_);
  ApplySource(tips, dt_s, 0.5f, 1.0f);
  source_.DepositFar(&field_, false, &ledger_);
  for (Tile* tile : field_.awake()) {
    if (!damage_.Update(tile, dt_s)) field_.QuarantineBadDamage(tile, &ledger_);
  }
  if (acts) *hook = source_.interface();
  if (!tips.empty()) {
    power_W_ = static_cast<float>(ledger_.generator - before_J) / Duration(tips, dt_s);
    set_power_W_ = tips.back().active ? tips.back().power_W : 0.0f;
    voltage_V_ = tips.back().active ? source_.stats().voltage_V : 0.0f;
    if (Acts(tips.back(), hook->hook_theta)) place_ = tips.back().path.to;
    silent_s_ = 0;
  } else if ((silent_s_ += dt_s) > kSilent_s) {
    power_W_ = set_power_W_ = voltage_V_ = 0;
  }
  shortened_ += source_.stats().shortened ? 1 : 0;
  highest_C_ = std::max(highest_C_, material_.body_C + field_.MaxTheta());
  if (frame_ % kMeasureFrames == 0) MeasureBurns();
  return true;
}

void SolidSurface::ApplySource(std::span<const TipInput> tips, float dt_s, float from, float to) {
  ForPartsOf(tips, dt_s, from, to, [&](const TipInput& tip, const TipPath& part, float length_s) {
    if (!Acts(tip, source_.interface().hook_theta)) return;
    const Drive drive = tip.active ? MakeDrive(params_, tip.mode, tip.power_W) : Drive{};
    source_.Run(&field_, part, drive, length_s, &ledger_);
  });
}

void SolidSurface::CountCells(const Tile& tile, std::array<Count, kMaxSolids>* counts) {
  const CellIndex corner{tile.tx * kTile, tile.ty * kTile};
  std::vector<Index>& charts = charts_of_tile_[static_cast<std::size_t>(tile.index)];
  if (charts.empty()) {
    for (Index i = 0; i < charts_.charts.size(); ++i) {
      const SolidChart& chart = charts_.charts[i];
      const bool apart = chart.x >= corner.ix + kTile || chart.x + chart.width <= corner.ix ||
                         chart.y >= corner.iy + kTile || chart.y + chart.height <= corner.iy;
      if (!apart) charts.push_back(i);
    }
  }
  for (int k = 0; k < kTileCells; ++k) {
    const bool tissue = (tile.state.flags[k] & (kOutside | kQuarantined)) == 0;
    const float omega = tile.state.omega_cell[k], theta = tile.theta[ThetaIndex(k % kTile, k / kTile)];
    if (!tissue || (theta <= 0.0f && omega <= 0.0f)) continue;
    const CellIndex cell{corner.ix + k % kTile, corner.iy + k / kTile};
    const auto here = std::find_if(charts.begin(), charts.end(),
                                   [&](Index i) { return charts_.charts[i].Contains(cell.ix, cell.iy); });
    const Index solid = here != charts.end() ? charts_.charts[*here].solid : 0;
    Count& count = (*counts)[solid];
    if (!count.hottest || theta > count.theta) {
      count.theta = theta;
      count.hottest = cell;
    }
    count.omega = std::max(count.omega, omega);
    if (omega < kInjuryOmega && (tile.state.flags[k] & kRemoved) == 0) continue;
    count.dead += static_cast<double>(tile.geometry.area[k]);
    count.last_dead = cell;
  }
}

void SolidSurface::MeasureBurns() {
  std::array<Count, kMaxSolids> counts;
  for (const auto& tile : field_.tiles()) {
    if (tile) CountCells(*tile, &counts);
  }
  for (Index solid = 0; solid < kMaxSolids; ++solid) {
    const Count& count = counts[solid];
    const float hottest_C = material_.body_C + count.theta;
    if (count.hottest && !warned(solid) && (hottest_C >= kWarning_C || count.omega >= kWarningOmega)) {
      warned_ |= 1u << solid;
      warnings_.push_back({solid, field_.sheet().CentreOf(*count.hottest), hottest_C});
    }
    dead_m2_[solid] = static_cast<float>(count.dead) * kSolidCell_m * kSolidCell_m;
    float& reported_m2 = reported_m2_[solid];
    if (dead_m2_[solid] < reported_m2 + kReported_m2) continue;
    const Vec2f at = SolidAt(place_) == solid ? place_ : field_.sheet().CentreOf(count.last_dead);
    burns_.push_back({solid, reported_m2 == 0.0f, at, material_.body_C + field_.MaxTheta(), dead_m2_[solid]});
    reported_m2 = dead_m2_[solid];
  }
}

bool SolidSurface::IsOn(Index triangle, const Vec2f& material) const {
  const Index chart = ChartOf(triangle);
  const CellIndex cell = field_.sheet().CellOf(material);
  return chart != kNoIndex && charts_.charts[chart].Contains(cell.ix, cell.iy);
}

Index SolidSurface::SolidAt(const Vec2f& material) const {
  const CellIndex cell = field_.sheet().CellOf(material);
  const auto here = std::find_if(charts_.charts.begin(), charts_.charts.end(),
                                 [&](const SolidChart& chart) { return chart.Contains(cell.ix, cell.iy); });
  return here != charts_.charts.end() ? here->solid : kNoIndex;
}

float SolidSurface::dead_m2() const { return std::accumulate(dead_m2_.begin(), dead_m2_.end(), 0.0f); }

void SolidSurface::Clear() {
  field_.Clear();
  field_.RestoreQuarantined(0);
  source_.Import({});
  ledger_ = {};
  burns_.clear();
  warnings_.clear();
  warned_ = 0;
  frame_ = 0;
  power_W_ = set_power_W_ = voltage_V_ = highest_C_ = 0;
  shortened_ = 0;
  dead_m2_ = reported_m2_ = {};
}

std::uint64_t SolidSurface::TickHash() const {
  if (frame_ == 0) return 0;
  Hash64 hash;
  for (const Tile* tile : field_.awake()) {
    hash.AddValue(tile->index);
    hash.Add(std::span<const float>(tile->theta_sum));
  }
  hash.AddValue(ledger_.joule);
  hash.AddValue(ledger_.Out());
  hash.Add(std::span<const float>(dead_m2_));
  hash.AddValue(frame_);
  return hash.value();
}

}  // namespace fulcrum::thermal
