// Contact of sheets with each other and, unlike in a session, with themselves: what it costs in the script of the
// built-in scene and where a band is pressed onto a sheet, as a ratio of run times in one process, and how deep the
// sheets then are in each other.
#include <algorithm>
#include <chrono>
#include <vector>

#include "physics_node/implicit/elements.h"
#include "physics_node/simulation/script_player.h"
#include "physics_node/simulation/tissue_simulation.h"
#include "services/scene/builder/build.h"
#include "tests/benchmark/report.h"
#include "tests/support/flat_sheets.h"

namespace fulcrum::physics {
namespace {

double NowMs() {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// What a run does in step `i` before the simulation's own step, and the tools of that step.
using Drive = std::array<ToolInput, kMaxTools> (*)(const SceneView& scene, int i, TissueSimulation* simulation);

std::array<ToolInput, kMaxTools> Script(const SceneView& scene, int i, TissueSimulation*) {
  return ScriptedTools(scene, 0.01 * i);
}
/// Lowers the ends of the band by 0.2 mm a step for 40 steps.
std::array<ToolInput, kMaxTools> Press(const SceneView& scene, int i, TissueSimulation* simulation) {
  const SheetPart& band = scene.sheets[1];
  if (i == 0) {  // The scene begins asleep, and nothing else moves the ends.
    std::vector<float> xyz(3 * scene.rest_position.size());
    simulation->particles().CopyPositions(xyz);
    (void)simulation->Restore(xyz, xyz, {});
  }
  for (const std::uint32_t row : {0u, band.rows - 1}) {
    for (std::uint32_t col = 0; col < band.cols && i < 40; ++col) {
      const ParticleRef at = simulation->particles().Ref(SheetParticle(scene, band, row, col));
      simulation->particles().Set(at, simulation->particles().At(at) - Vec3f(0, 0, 0.0002f));
    }
  }
  return {};
}

struct Run {
  std::vector<double> with, without;  ///< By step: least time of some passes [ms].
  double deepest_m = 0, mean_depth_m = 0;
  std::size_t most_pairs = 0, most_rows = 0;
};

/// Both simulations step in turns, so that a slow second of the machine slows both.
Run Compare(const SceneView& scene, int steps, int passes, Drive drive) {
  Run run;
  run.with.assign(static_cast<std::size_t>(steps), 1e9);
  run.without = run.with;
  for (int pass = 0; pass < passes; ++pass) {
    TissueSimulation with(scene), without(scene);
    with.TakeSheetPairs(SheetPairs::kAll);
    without.TakeSheetPairs(SheetPairs::kNone);
    for (int i = 0; i < steps; ++i) {
      for (TissueSimulation* each : {&with, &without}) {
        const auto tools = drive(scene, i, each);
        const double begin = NowMs();
        each->Step(tools);
        double& least = (each == &with ? run.with : run.without)[static_cast<std::size_t>(i)];
        least = std::min(least, NowMs() - begin);
      }
      run.most_pairs = std::max(run.most_pairs, with.sheet_collision().pair_count());
      std::size_t rows = 0, closed = 0;
      double sum = 0;
      for (const ContactRow& row : with.rows()) {
        if (!implicit::Elements::IsOfSheets(row)) continue;
        ++rows;
        const auto depth = static_cast<double>(row.offset - row.normal.dot(row.At(with.particles().raw().data())));
        if (depth > 0) {
          sum += depth;
          ++closed;
        }
        run.deepest_m = std::max(run.deepest_m, depth);
      }
      run.most_rows = std::max(run.most_rows, rows);
      run.mean_depth_m = closed > 0 ? sum / static_cast<double>(closed) : 0;
    }
  }
  return run;
}

double Sum(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return sum;
}

void Add(const std::string& name, const Run& run, benchmark::Report* report) {
  report->Add(name + ".step_time_ratio", Sum(run.with) / Sum(run.without), "1");
  report->Add(name + ".pairs_max", static_cast<double>(run.most_pairs), "1");
  report->Add(name + ".rows_max", static_cast<double>(run.most_rows), "1");
  report->Add(name + ".penetration_max_um", 1e6 * run.deepest_m, "um");
  report->Add(name + ".penetration_end_um", 1e6 * run.mean_depth_m, "um");
}

}  // namespace
}  // namespace fulcrum::physics

int main(int argc, char** argv) {
  using namespace fulcrum;
  benchmark::Report report(argc, argv);
  const int passes = report.quick() ? 1 : 3;
  if (report.Wants("physics.sheets.script.")) {
    const scene::SceneData data = scene::BuildProcedural(scene::BuiltIn());
    const int steps = static_cast<int>(data.View().script_duration_s * 100);
    physics::Add("physics.sheets.script", physics::Compare(data.View(), steps, passes, physics::Script), &report);
  }
  if (report.Wants("physics.sheets.press.")) {
    const scene::SceneData data = SheetAndBand(0.002);
    physics::Add("physics.sheets.press", physics::Compare(data.View(), 200, 3 * passes, physics::Press), &report);
  }
  return 0;
}
