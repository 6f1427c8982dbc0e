// What doing nothing costs.
#include "services/scene/build.h"
#include "tests/benchmark/report.h"
#include "tests/numerics/physics/script_player.h"

namespace fulcrum::physics {
namespace {

using benchmark::Quantile;
using benchmark::Report;
using benchmark::TimeMs;

void Idle(const SceneView& scene, Report* report) {
  TissueSimulation simulation(scene);
  auto tools = ScriptedTools(scene, 0.0);
  for (int i = 0; i < 200; ++i) {
    simulation.Step(tools);
  }
  // Tools that hover keep moving.
  const auto ms = TimeMs(10, 2000, [&] {
    tools[0].pose.p_WT.z() += 1e-6f;
    simulation.Step(tools);
  });
  report->Add("physics.idle.step_us_p50", 1e3 * Quantile(ms, 0.5), "us");
}

}  // namespace
}  // namespace fulcrum::physics

int main(int argc, char** argv) {
  using namespace fulcrum;
  benchmark::Report report(argc, argv);
  if (!report.Wants("physics.")) {
    return 0;
  }
  const scene::SceneData data = scene::BuildProcedural(scene::BuiltIn());
  const SceneView scene = data.View();
  if (report.Wants("physics.idle.")) {
    physics::Idle(scene, &report);
  }
  return 0;
}
