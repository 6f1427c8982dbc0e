#include "tests/numerics/thermal/published.h"

#include <algorithm>
#include <cmath>

namespace fulcrum::thermal {
namespace {

constexpr float kStep_s = 0.01f;
constexpr float kBody_C = 37;

scene::SceneData TissueOf(float cell_m) {
  scene::SceneData data = FlatScene(41, 41, 1e-3f);
  data.fixed.thermal.cell_m = cell_m;
  data.fixed.thermal.volume = 1;
  return data;
}

Drag Stroke(float speed_m_s, float power_W, CauteryMode mode) {
  Drag drag;
  drag.from = {0.01403f, 0.02017f};
  drag.to = drag.from + Vec2f(0.012f, 0);
  drag.speed_m_s = speed_m_s;
  drag.power_W = power_W;
  drag.mode = mode;
  return drag;
}

/// Calls visit(theta [K], distance from `at` [m]) for every cell of tissue.
template <class Visit>
void ForTissue(const HeatField& field, const Vec2f& at, const Visit& visit) {
  for (const Tile* tile : field.Existing()) {
    for (int k = 0; k < kTileCells; ++k) {
      if ((tile->state.flags[k] & kNoTissue) != 0) continue;
      const CellIndex cell{tile->index % field.sheet().tiles_x * kTile + k % kTile,
                           tile->index / field.sheet().tiles_x * kTile + k / kTile};
      visit(tile->theta[ThetaIndex(k % kTile, k / kTile)], (field.sheet().CentreOf(cell) - at).norm());
    }
  }
}

}  // namespace

double LateralDamage(float cell_m) {
  const scene::SceneData data = TissueOf(cell_m);
  ThermalSolver solver(data.View());
  const Drag drag = Stroke(0.004f, 35, CauteryMode::kCut);
  RunDrag(drag, kStep_s, &solver);
  constexpr int kCooling = 300;
  for (int frame = 0; frame < kCooling; ++frame) solver.Step(TipInput{}, kStep_s);
  return static_cast<double>(MeasureSlit(solver, data.View(), drag).dead_m);
}

double SpreadOf45Degrees(float cell_m) {
  const scene::SceneData data = TissueOf(cell_m);
  ThermalSolver solver(data.View());
  Drag drag = Stroke(0.001f, 60, CauteryMode::kCoag);
  TipInput tip = drag.At(0, kStep_s);
  tip.path.from = tip.path.to = Vec2f(0.02017f, 0.02017f);
  constexpr int kActive = 100, kAfter = 300;
  double farthest = 0;
  for (int frame = 0; frame < kActive + kAfter; ++frame) {
    solver.Step(frame < kActive ? tip : TipInput{}, kStep_s);
    ForTissue(solver.field(), tip.path.from, [&](float theta, float distance) {
      if (theta >= 45 - kBody_C) farthest = std::max(farthest, static_cast<double>(distance));
    });
  }
  return farthest - static_cast<double>(drag.radius_m);
}

double CoolingTo60Degrees(CauteryMode mode, float cell_m) {
  const scene::SceneData data = TissueOf(cell_m);
  ThermalSolver solver(data.View());
  RunDrag(Stroke(0.004f, 40, mode), kStep_s, &solver);
  constexpr int kMost = 2000;
  int frame = 0;
  while (frame < kMost && solver.field().MaxTheta() > 60 - kBody_C) {
    solver.Step(TipInput{}, kStep_s);
    ++frame;
  }
  return static_cast<double>(kStep_s) * frame;
}

Effect BladeOnLiver(float power_W, float cell_m) {
  scene::SceneData data = TissueOf(cell_m);
  ThermalParams& liver = data.fixed.thermal;
  liver.volume = 0;
  liver.thickness_m = 3e-3f;
  liver.density_kg_m3 = 1079;
  liver.heat_capacity_J_kgK = 3540;
  liver.conductivity_W_mK = 0.52f;
  liver.latent_heat_J_m3 = 1.7e9f;  // 70 % water.
  liver.sigma_S_m = liver.sigma_fat_S_m = 0.145f;
  liver.fat_depth_m = 0.02f;  // Liver beneath, too.
  ThermalSolver solver(data.View());
  Drag drag = Stroke(0.005f, power_W, CauteryMode::kCut);
  drag.radius_m = 2.5e-4f;
  drag.half = Vec2f(1e-3f, 0);
  RunDrag(drag, kStep_s, &solver);
  for (int frame = 0; frame < 100; ++frame) solver.Step(TipInput{}, kStep_s);
  Effect effect;
  const double cell_mm2 = 1e6 * static_cast<double>(cell_m) * static_cast<double>(cell_m);
  for (const Tile* tile : solver.field().Existing()) {
    for (int k = 0; k < kTileCells; ++k) {
      if ((tile->state.flags[k] & kOutside) != 0) continue;
      const bool removed = (tile->state.flags[k] & kRemoved) != 0;
      effect.removed_mm2 += removed ? cell_mm2 : 0;
      effect.coagulated_mm2 += !removed && tile->state.omega_collagen[k] >= 1 ? cell_mm2 : 0;
    }
  }
  return effect;
}

}  // namespace fulcrum::thermal
