#include "tests/benchmark/thermal/volume_case.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "services/scene/builder/build.h"
#include "tests/numerics/thermal/flat_scene.h"
#include "tests/numerics/thermal/volume_cases.h"

namespace fulcrum::thermal {
namespace {

constexpr float kFrame_s = 0.01f;

void Block(benchmark::Report* report) {
  const VolumeTimes times = TimeVolume();
  report->Add("thermal.volume_64x64x32.step_ms", times.step_ms, "ms");
  report->Add("thermal.volume_64x64x32.all_hot_ms", times.all_hot_ms, "ms");
  report->Add("thermal.volume_64x64x32.with_sheet_ms", times.contact_ms, "ms");
  const double fine = HalfSpaceError(1.5e-4f);
  report->Add("thermal.volume_64x64x32.max_error_pct", 100 * fine, "%");
  report->Add("thermal.volume_64x64x32.order", std::log2(HalfSpaceError(3e-4f) / fine), "1");
}

/// The built-in scene's cut with the tissue beneath: time of a frame, and both ledgers.
void BuiltInCut(benchmark::Report* report) {
  scene::SceneData data = scene::BuildProcedural(scene::BuiltIn());
  data.fixed.thermal.volume = 1;
  const SceneView scene = data.View();
  const MembraneGrid& grid = scene.membrane;
  Drag drag;
  drag.from = scene.membrane_material[(grid.rows * 42 / 100) * grid.cols + grid.cols * 62 / 100] + Vec2f(3e-4f, 2e-4f);
  drag.to = drag.from + Vec2f(0, 0.030f);
  drag.radius_m = scene.tools[1].tip_radius_m;
  ThermalSolver solver(scene);
  std::vector<double> times;
  for (int frame = 0; frame < drag.frames(kFrame_s); ++frame) {
    times.push_back(benchmark::TimeMs(0, 1, [&] { solver.Step(drag.At(frame, kFrame_s), kFrame_s); }).front());
  }
  const VolumeField& volume = *solver.volume();
  report->Add("thermal.volume_cut.frame_ms_p50", benchmark::Quantile(times, 0.5), "ms");
  report->Add("thermal.volume_cut.frame_ms_p99", benchmark::Quantile(times, 0.99), "ms");
  report->Add("thermal.volume_cut.bricks", static_cast<double>(volume.awake().size()), "1");
  report->Add(
      "thermal.volume_cut.energy_closure_rel",
      std::max(volume.ledger().ClosureError(volume.Stored()), solver.ledger().ClosureError(solver.field().Stored())),
      "1");
  report->Add("thermal.volume_cut.burn_depth_mm", 1e3 * solver.figures().burn_depth_m, "mm");
}

/// Depth of burn under a tip that does not move.
void Dwells(benchmark::Report* report) {
  scene::SceneData data = FlatScene(21, 21, 1e-3f);
  data.fixed.thermal.volume = 1;
  TipInput tip;
  tip.active = true;
  tip.path.from = tip.path.to = {0.0103f, 0.0101f};
  tip.path.radius_m = 5e-4f;
  tip.mode = CauteryMode::kCoag;
  for (const int power : {5, 10, 30}) {
    tip.power_W = static_cast<float>(power);
    ThermalSolver solver(data.View());
    for (int second = 1; second <= 4; ++second) {
      for (int frame = 0; frame < 100; ++frame) solver.Step(tip, kFrame_s);
      if (second == 3) continue;
      const std::string stem =
          "thermal.volume_dwell.coag_" + std::to_string(power) + "W_" + std::to_string(second) + "s.";
      report->Add(stem + "burn_depth_mm", 1e3 * solver.figures().burn_depth_m, "mm");
    }
  }
}

}  // namespace

void BenchmarkVolume(benchmark::Report* report) {
  if (report->Wants("thermal.volume_64x64x32")) Block(report);
  if (report->Wants("thermal.volume_cut")) BuiltInCut(report);
  if (report->Wants("thermal.volume_dwell")) Dwells(report);
}

}  // namespace fulcrum::thermal
