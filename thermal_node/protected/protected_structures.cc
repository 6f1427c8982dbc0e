#include "thermal_node/protected/protected_structures.h"

#include <cmath>

namespace fulcrum::thermal {
namespace {

/// Smallest depth [m]: a structure that the scene places at the sheet is still separated from it by its own wall.
constexpr float kMinDepth_m = 3e-4f;
/// Excess temperature that is treated as 0 [K]: far below kDamageStart, so the updates may end.
constexpr float kNegligibleTheta = 0.01f;

}  // namespace

ProtectedStructures::ProtectedStructures(const SheetScene& scene, const HeatField& field)
    : body_C_(field.material().body_C) {
  for (const ProtectedStructure& structure : scene.protected_structures) {
    const auto index = static_cast<Index>(structures_.size());
    structures_.push_back({structure.kind, std::max(structure.depth_m, kMinDepth_m)});
    for (Index k = 0; k + 1 < structure.point_count; ++k) {
      const Vec2f a = scene.protected_points[structure.first_point + k].material;
      const Vec2f b = scene.protected_points[structure.first_point + k + 1].material;
      if (!a.allFinite() || !b.allFinite()) continue;
      const int pieces = std::max(1, static_cast<int>(std::ceil((b - a).norm() / kSampleSpacing_m)));
      for (int n = 0; n < pieces; ++n) {
        const Vec2f p = a + (b - a) * (static_cast<float>(n) / static_cast<float>(pieces));
        if (field.sheet().OnSheet(p)) places_.push_back({p, index});
      }
    }
  }
  samples_.resize(places_.size());
  alarm_state_.assign(structures_.size(), 0);
}

float ProtectedStructures::MeanTheta(const HeatField& field, const Vec2f& at, float radius) const {
  const float cell = field.material().cell_m;
  const CellIndex centre = field.sheet().CellOf(at);
  const int reach = std::max(1, static_cast<int>(radius / cell));
  const int step = std::max(1, reach / 6);  // about 13 x 13 probes are enough for a mean
  float sum = 0;
  int count = 0;
  for (int dj = -reach; dj <= reach; dj += step) {
    for (int di = -reach; di <= reach; di += step) {
      if (di * di + dj * dj > reach * reach) continue;
      ++count;
      const int ix = centre.ix + di, iy = centre.iy + dj;
      if (ix < 0 || iy < 0) continue;
      const Tile* tile = field.Find(ix / kTile, iy / kTile);
      if (tile != nullptr && tile->state.awake != 0) sum += tile->theta[ThetaIndex(ix % kTile, iy % kTile)];
    }
  }
  return sum / static_cast<float>(count);
}

float ProtectedStructures::Lumped(const HeatField& field, const Vec2f& at, float depth_m, float before,
                                  float dt_s) const {
  const CellIndex cell = field.sheet().CellOf(at);
  const Tile* tile = field.Find(cell.ix / kTile, cell.iy / kTile);
  const bool above_warm = tile != nullptr && tile->state.awake != 0;
  if (!above_warm && before <= 0.0f) return 0;
  const float above = above_warm ? std::exp(-depth_m / kAttenuationDepth_m) * MeanTheta(field, at, depth_m) : 0.0f;
  const float tau = depth_m * depth_m / (2.0f * kFatDiffusivity_m2_s);
  const float theta = above + (before - above) * std::exp(-dt_s / tau);
  return theta < kNegligibleTheta && !above_warm ? 0.0f : theta;
}

void ProtectedStructures::Update(const HeatField& field, const VolumeField* volume, const DamageRate& cell_death,
                                 float dt_s, std::vector<ProtectedAlarm>* alarms) {
  warm_ = false;
  for (std::size_t n = 0; n < samples_.size(); ++n) {
    ProtectedSample& sample = samples_[n];
    const Place& place = places_[n];
    const Structure& structure = structures_[place.structure];
    const bool inside = volume != nullptr && structure.depth_m <= volume->material().depth_m();
    sample.theta = inside ? volume->ThetaAt(place.material, structure.depth_m)
                          : Lumped(field, place.material, structure.depth_m, sample.theta, dt_s);
    if (sample.theta <= 0.0f) continue;
    if (sample.theta > kNegligibleTheta) warm_ = true;
    if (sample.theta >= kDamageStart) sample.omega += dt_s * cell_death.At(sample.theta);
    std::uint8_t& state = alarm_state_[place.structure];
    const auto raise = [&](std::uint8_t bit, bool injury) {
      if ((state & bit) != 0) return;
      state = static_cast<std::uint8_t>(state | bit);
      alarms->push_back({structure.kind, injury, place.material, sample.theta, sample.omega});
    };
    if (body_C_ + sample.theta >= kWarning_C || sample.omega >= kWarningOmega) raise(1, false);
    if (sample.omega >= kInjuryOmega) raise(2, true);
  }
}

}  // namespace fulcrum::thermal
