// Time and error of the thermal solver. With FULCRUM_PICTURES=DIR in the environment it also leaves pictures there.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>

#include "services/runtime/realtime.h"
#include "services/scene/build.h"
#include "tests/benchmark/report.h"
#include "tests/benchmark/thermal/paper_cases.h"
#include "tests/benchmark/thermal/picture.h"
#include "tests/benchmark/thermal/work_precision.h"
#include "tests/numerics/thermal/flat_scene.h"
#include "tests/numerics/thermal/heat_cases.h"
#include "tests/numerics/thermal/moving_gaussian.h"
#include "tests/numerics/thermal/potential_rings.h"
#include "thermal_node/coupling/patch.h"

namespace {

using namespace fulcrum;           // NOLINT
using namespace fulcrum::thermal;  // NOLINT
using benchmark::Quantile;
using benchmark::Report;
using benchmark::TimeMs;

constexpr float kDt = 0.01f;

void Picture(const ThermalSolver& solver, const SceneView& scene, const Vec2f& centre, const std::string& name) {
  const char* folder = std::getenv("FULCRUM_PICTURES");
  if (folder != nullptr) WritePicture(solver, scene, centre, 0.012f, std::filesystem::path(folder) / (name + ".png"));
}

/// 30 mm along the built-in membrane, where the scene's own script cuts.
Drag BuiltInDrag(const SceneView& scene, float speed_m_s) {
  const MembraneGrid& grid = scene.membrane;
  Drag drag;
  drag.from = scene.membrane_material[(grid.rows * 42 / 100) * grid.cols + grid.cols * 62 / 100] + Vec2f(3e-4f, 2e-4f);
  drag.to = drag.from + Vec2f(0, 0.030f);
  drag.speed_m_s = speed_m_s;
  drag.radius_m = scene.tools[1].tip_radius_m;
  return drag;
}

/// A frame while cutting, all stages.
void Frame(Report* report) {
  if (!report->Wants("thermal.step_ms") && !report->Wants("thermal.energy_closure_rel") &&
      !report->Wants("thermal.checkpoint_ms") && !report->Wants("thermal.patch_ms")) {
    return;
  }
  const scene::SceneData data = scene::BuildProcedural(scene::BuiltIn());
  const SceneView scene = data.View();
  std::vector<double> times;
  double closure = 0;
  auto solver = std::make_unique<ThermalSolver>(scene);
  for (int repeat = 0; repeat < (report->quick() ? 1 : 3); ++repeat) {
    solver = std::make_unique<ThermalSolver>(scene);
    const Drag drag = BuiltInDrag(scene, 0.005f);
    for (int frame = 0; frame < drag.frames(kDt); ++frame) {
      times.push_back(TimeMs(0, 1, [&] { solver->Step(drag.At(frame, kDt), kDt); }).front());
      closure = std::max(closure, solver->ledger().ClosureError(solver->field().Stored()));
    }
  }
  report->Add("thermal.step_ms_p50", Quantile(times, 0.5), "ms");
  report->Add("thermal.step_ms_p99", Quantile(times, 0.99), "ms");
  report->Add("thermal.energy_closure_rel", closure, "1");
  std::vector<std::byte> slot(ThermalSolver::CheckpointCapacity(scene));
  std::size_t bytes = 0;
  report->Add("thermal.checkpoint_ms", Quantile(TimeMs(2, 15, [&] { bytes = solver->Save(slot); }), 0.5), "ms");
  report->Add("thermal.checkpoint_kib", static_cast<double>(bytes) / 1024, "KiB");
  std::vector<std::uint8_t> texels(4 * kPatchTexels * kPatchTexels);
  const auto draw = [&] { DrawPatch(solver->field(), scene.membrane.texel_m, {0, 256, 768}, texels); };
  report->Add("thermal.patch_ms", Quantile(TimeMs(2, 15, draw), 0.5), "ms");
}

/// What a cut looks like, by speed and mode; and what a shorter coupling step would change.
void Cuts(Report* report) {
  if (!report->Wants("thermal.cut")) return;
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
      RunDrag(drag, kDt, &solver);
      Picture(solver, scene, drag.to, std::string(name) + "_" + std::to_string(speed) + "_mm_s");
      for (int n = 0; n < kCommitFrames; ++n) solver.Step({}, kDt);
      const SlitFigures slit = MeasureSlit(solver, scene, drag);
      const std::string stem = std::string("thermal.cut.") + name + "_" + std::to_string(speed) + "_mm_s.";
      report->Add(stem + "width_mm", 1e3 * slit.width_mean_m, "mm");
      report->Add(stem + "brown_mm", 1e3 * slit.brown_m, "mm");
      report->Add(stem + "dead_mm", 1e3 * slit.dead_m, "mm");
      report->Add(stem + "warm_mm", 1e3 * slit.warm_m, "mm");
      report->Add(stem + "length_mm", 1e3 * solver.cut_length_m(), "mm");
      report->Add(stem + "surviving_edges", slit.surviving_crossings, "1");
    }
  }
  double joule[2];
  for (int n = 0; n < 2; ++n) {
    ThermalSolver solver(scene);
    if (n == 1) solver.source()->min_step_s = 1e-4f;
    if (n == 1) solver.source()->tolerance = 1e-4f;
    Drag drag;
    drag.from = {0.01503f, 0.02017f};
    drag.to = {0.03003f, 0.02017f};
    RunDrag(drag, kDt, &solver);
    joule[n] = solver.ledger().joule;
  }
  report->Add("thermal.cut.coupling_error_pct", 100 * std::abs(joule[0] / joule[1] - 1), "%");
}

void HeatOneSpot(Report* report) {
  if (!report->Wants("thermal.heat_one_spot")) return;
  const MovingGaussianResult result = RunMovingGaussian(1e-4f);
  report->Add("thermal.heat_one_spot.step_ms", result.step_ms, "ms");
  report->Add("thermal.heat_one_spot.max_error_pct", 100 * result.max_error, "%");
}

void HeatFastTip(Report* report) {
  if (!report->Wants("thermal.heat_fast_tip")) return;
  const MovingGaussianResult result = RunMovingGaussian(1e-4f, 0.05);
  report->Add("thermal.heat_fast_tip.step_ms", result.step_ms, "ms");
  report->Add("thermal.heat_fast_tip.max_error_pct", 100 * result.max_error, "%");
}

/// Cells half as large with steps a quarter as long, and steps halved on one grid.
void Orders(Report* report) {
  if (!report->Wants("thermal.order")) return;
  const double mode = std::log2(ModeError(2e-4f, 4e-2f) / ModeError(1e-4f, 1e-2f));
  const double variable = std::log2(VariableError(2e-4f, 4e-2f) / VariableError(1e-4f, 1e-2f));
  report->Add("thermal.order.eigenfunction", mode, "1");
  report->Add("thermal.order.variable", variable, "1");
  report->Add("thermal.order.space", std::min(mode, variable), "1");
  report->Add("thermal.order.time", TimeOrder(), "1");
}

void PotentialWindow(Report* report) {
  if (!report->Wants("thermal.potential_window")) return;
  const RingsResult result = SolveRings(6.3, 29.2, 1e-2f);
  report->Add("thermal.potential_window.ms", result.solve_ms_warm, "ms");
  report->Add("thermal.potential_window.cold_ms", result.solve_ms_cold, "ms");
  report->Add("thermal.potential_window.q_error_pct", 100 * result.heat_error, "%");
  report->Add("thermal.potential_window.current_error_pct", 100 * result.current_error, "%");
}

void Idle(Report* report) {
  if (!report->Wants("thermal.idle_frame_ns")) return;
  const scene::SceneData data = FlatScene(41, 61, 1e-3f);
  ThermalSolver solver(data.View());
  constexpr int kFrames = 100000;
  const auto body = [&] {
    for (int n = 0; n < kFrames; ++n) solver.Step({}, kDt);
  };
  report->Add("thermal.idle_frame_ns", Quantile(TimeMs(1, 5, body), 0.5) * 1e6 / kFrames, "ns");
}

}  // namespace

int main(int argc, char** argv) {
  Report report(argc, argv);
  runtime::FlushDenormals();
  Frame(&report);
  Cuts(&report);
  HeatOneSpot(&report);
  HeatFastTip(&report);
  Orders(&report);
  PotentialWindow(&report);
  Idle(&report);
  WorkPrecision(&report);
  PaperCases(&report);
  return 0;
}
