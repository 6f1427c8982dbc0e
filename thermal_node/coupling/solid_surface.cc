#include "thermal_node/coupling/solid_surface.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "services/base/core/hash.h"
#include "thermal_node/coupling/tip_parts.h"
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
      chart_of_(std::move(charts.of_triangle)) {}

bool SolidSurface::Step(std::span<const TipInput> tips, float dt_s, Interface* hook) {
  burn_.reset();
  const bool acts =
      std::any_of(tips.begin(), tips.end(), [&](const TipInput& tip) { return Acts(tip, hook->hook_theta); });
  if (!acts && field_.idle()) {
    power_W_ = 0;
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
  const float time_s = Duration(tips, dt_s);
  power_W_ = time_s > 0 ? static_cast<float>(ledger_.generator - before_J) / time_s : 0.0f;
  highest_C_ = std::max(highest_C_, material_.body_C + field_.MaxTheta());
  if (frame_ % kMeasureFrames == 0) MeasureBurn(tips);
  return true;
}

void SolidSurface::ApplySource(std::span<const TipInput> tips, float dt_s, float from, float to) {
  ForPartsOf(tips, dt_s, from, to, [&](const TipInput& tip, const TipPath& part, float length_s) {
    if (!Acts(tip, source_.interface().hook_theta)) return;
    const Drive drive = tip.active ? MakeDrive(params_, tip.mode, tip.power_W) : Drive{};
    source_.Run(&field_, part, drive, length_s, &ledger_);
  });
}

void SolidSurface::MeasureBurn(std::span<const TipInput> tips) {
  double cells = 0;
  const Tile* hottest = nullptr;
  for (const auto& tile : field_.tiles()) {
    if (!tile) continue;
    for (int k = 0; k < kTileCells; ++k) {
      const bool tissue = (tile->state.flags[k] & (kOutside | kQuarantined)) == 0;
      const bool dead = tile->state.omega_cell[k] >= 1.0f || (tile->state.flags[k] & kRemoved) != 0;
      if (tissue && dead) cells += static_cast<double>(tile->geometry.area[k]);
    }
    if (tile->state.awake != 0 && (hottest == nullptr || tile->theta_max > hottest->theta_max)) hottest = tile.get();
  }
  dead_m2_ = static_cast<float>(cells) * kSolidCell_m * kSolidCell_m;
  if (dead_m2_ < reported_m2_ + kReported_m2 || hottest == nullptr) return;
  reported_m2_ = dead_m2_;
  const CellIndex middle{hottest->tx * kTile + kTile / 2, hottest->ty * kTile + kTile / 2};
  const bool touches = !tips.empty() && tips.back().touching;
  burn_ = SolidBurn{touches ? tips.back().path.to : field_.sheet().CentreOf(middle),
                    material_.body_C + hottest->theta_max, dead_m2_};
}

void SolidSurface::Clear() {
  field_.Clear();
  field_.RestoreQuarantined(0);
  source_.Import({});
  ledger_ = {};
  burn_.reset();
  frame_ = 0;
  power_W_ = highest_C_ = dead_m2_ = reported_m2_ = 0;
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
  hash.AddValue(dead_m2_);
  hash.AddValue(frame_);
  return hash.value();
}

}  // namespace fulcrum::thermal
