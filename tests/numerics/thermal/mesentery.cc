#include "tests/numerics/thermal/mesentery.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace fulcrum::thermal {
namespace {

float ThetaAt(const HeatField& field, const Vec2f& at) {
  const CellIndex cell = field.sheet().CellOf(at);
  const Tile* tile = field.Find(cell.ix / kTile, cell.iy / kTile);
  return tile == nullptr ? 0.0f : tile->theta[ThetaIndex(cell.ix % kTile, cell.iy % kTile)];
}

}  // namespace

double RiseAtOneMillimetre(const MesenteryCase& c) {
  constexpr float kStep_s = 0.01f;
  scene::SceneData data = FlatScene(41, 41, 1e-3f);
  data.fixed.thermal.cell_m = c.cell_m;
  ThermalSolver solver(data.View());
  Drag drag;
  drag.from = {0.01403f, 0.02017f};
  drag.to = drag.from + Vec2f(0.012f, 0);
  drag.mode = c.mode;
  drag.power_W = 30;
  drag.tented = c.tented;
  const bool moves = c.speed_m_s > 0;
  if (moves) drag.speed_m_s = c.speed_m_s;
  const Vec2f middle = moves ? Vec2f(0.5f * (drag.from + drag.to)) : drag.from;
  const float away = drag.radius_m + 1e-3f;
  std::vector<Vec2f> probes;
  const int sides = moves ? 2 : 16;
  for (int n = 0; n < sides; ++n) {
    const float angle = std::numbers::pi_v<float> * (0.5f + 2.0f * static_cast<float>(n) / static_cast<float>(sides));
    probes.push_back(middle + away * Vec2f(std::cos(angle), std::sin(angle)));
  }
  const int active = moves ? drag.frames(kStep_s) : static_cast<int>(std::lround(c.dwell_s / kStep_s));
  constexpr int kCooling = 300;
  double highest = 0;
  for (int frame = 0; frame < active + kCooling; ++frame) {
    TipInput tip = drag.At(moves ? frame : 0, kStep_s);
    if (!moves) tip.path.to = tip.path.from = middle;
    solver.Step(frame < active ? tip : TipInput{}, kStep_s);
    double sum = 0;
    for (const Vec2f& probe : probes) sum += ThetaAt(solver.field(), probe);
    highest = std::max(highest, sum / sides);
  }
  return highest;
}

}  // namespace fulcrum::thermal
