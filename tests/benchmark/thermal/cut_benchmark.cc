#include <algorithm>
#include <cmath>
#include <string>
#include <tuple>

#include "tests/benchmark/thermal/thermal_cases.h"

namespace fulcrum::thermal {
namespace {

using benchmark::Report;

/// Appearance of a cut, by speed and mode.
void Looks(Report* report) {
  if (!report->Wants("thermal.cut.")) return;
  const scene::SceneData data = FlatScene(41, 61, 1e-3f);
  const SceneView scene = data.View();
  for (const int speed : {2, 4, 8}) {
    for (const auto& [mode, name, power] : {std::tuple{CauteryMode::kCut, "cut", 35.0f},
                                            {CauteryMode::kBlend, "blend", 35.0f},
                                            {CauteryMode::kCoag, "coag", 30.0f}}) {
      ThermalSolver solver(scene);
      Drag drag;
      drag.from = {0.01503f, 0.02017f};
      drag.to = {0.04503f, 0.02017f};
      drag.speed_m_s = 1e-3f * static_cast<float>(speed);
      drag.mode = mode;
      drag.power_W = power;
      RunDrag(drag, kFrame_s, &solver);
      while (!solver.at_commit_frame()) solver.Step(TipInput{}, kFrame_s);
      const std::string stem = std::string("cut.") + name + "_" + std::to_string(speed) + "_mm_s";
      if (speed == 4) Picture(solver, scene, drag.to - Vec2f(0.003f, 0), name);
      const SlitFigures slit = MeasureSlit(solver, scene, drag);
      report->Add("thermal." + stem + ".width_mm", 1e3 * slit.width_mean_m, "mm");
      report->Add("thermal." + stem + ".brown_mm", 1e3 * slit.brown_m, "mm");
      report->Add("thermal." + stem + ".dead_mm", 1e3 * slit.dead_m, "mm");
      report->Add("thermal." + stem + ".warm_mm", 1e3 * slit.warm_m, "mm");
      report->Add("thermal." + stem + ".length_mm", 1e3 * solver.cut_length_m(), "mm");
      report->Add("thermal." + stem + ".surviving_edges", slit.surviving_crossings, "1");
    }
  }
}

/// Length of the slit along a straight drag [m]: the part of the path, up to 2 mm beyond its ends, on which the cell is
/// removed, sampled at a quarter of a cell.
double SlitLength(const ThermalSolver& solver, const Drag& drag) {
  const HeatField& field = solver.field();
  const float step = 0.25f * field.material().cell_m;
  const Vec2f along = (drag.to - drag.from).normalized();
  int gone = 0;
  for (float u = -0.002f; u < (drag.to - drag.from).norm() + 0.002f; u += step) {
    const CellIndex cell = field.sheet().CellOf(drag.from + u * along);
    const Tile* tile = field.Find(cell.ix / kTile, cell.iy / kTile);
    if (tile == nullptr) continue;
    gone += (tile->state.flags[(cell.iy % kTile) * kTile + cell.ix % kTile] & kRemoved) != 0 ? 1 : 0;
  }
  return gone * static_cast<double>(step);
}

/// Energy and slit length against a run with all coupling steps ten times shorter: those limited by the change of the
/// tissue and, through a shorter frame, those limited by the frame.
void CouplingStep(Report* report) {
  if (!report->Wants("thermal.coupling")) return;
  const scene::SceneData data = FlatScene(41, 61, 1e-3f);
  const SceneView scene = data.View();
  double worst = 0;
  for (const int speed : {2, 4, 6, 8, 10}) {
    Drag drag;
    drag.from = {0.01503f, 0.02017f};
    drag.to = drag.from + (report->quick() ? 0.006f : 0.015f) * Vec2f(std::cos(0.3f), std::sin(0.3f));
    drag.speed_m_s = 1e-3f * static_cast<float>(speed);
    ThermalSolver solver(scene);
    RunDrag(drag, kFrame_s, &solver);
    ThermalSolver fine(scene);
    fine.source()->max_change *= 0.1f;
    fine.source()->min_step_s *= 0.1f;
    fine.source()->tolerance = 1e-4f;
    RunDrag(drag, 0.1f * kFrame_s, &fine);
    const double energy = std::abs(solver.ledger().joule / fine.ledger().joule - 1);
    const double length = std::abs(SlitLength(solver, drag) / SlitLength(fine, drag) - 1);
    const std::string stem = "thermal.coupling." + std::to_string(speed) + "_mm_s";
    report->Add(stem + ".energy_error_pct", 100 * energy, "%");
    report->Add(stem + ".slit_error_pct", 100 * length, "%");
    worst = std::max({worst, energy, length});
  }
  report->Add("thermal.coupling_error_pct", 100 * worst, "%");
}

}  // namespace

void CutCases(Report* report) {
  Looks(report);
  CouplingStep(report);
}

}  // namespace fulcrum::thermal
