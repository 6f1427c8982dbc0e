// What doing nothing costs, and whether the same inputs give the same state.
#include <vector>

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

/// A step of a scene in which nothing moves, not even a tool.
void Rest(const SceneView& scene, Report* report) {
  TissueSimulation simulation(scene);
  const auto tools = ScriptedTools(scene, 0.0);
  for (int i = 0; i < 200; ++i) {
    simulation.Step(tools);
  }
  report->Add("physics.rest.frame_us", 1e3 * Quantile(TimeMs(10, 2000, [&] { simulation.Step(tools); }), 0.5), "us");
}

/// Grasp and pull of the script, three times over.
void Determinism(const SceneView& scene, Report* report) {
  const int steps = report->quick() ? 300 : 600;
  std::vector<std::uint64_t> hashes;
  for (int run = 0; run < 3; ++run) {
    TissueSimulation simulation(scene);
    for (int i = 0; i < steps; ++i) {
      simulation.Step(ScriptedTools(scene, 0.01 * i));
    }
    hashes.push_back(simulation.StateHash());
  }
  report->Add("physics.determinism.hash_equal", hashes[0] == hashes[1] && hashes[1] == hashes[2] ? 1 : 0, "1");
}

/// The accurate mode over the whole script: tools, grasp, contact and what is published from it, without cuts.
void Script(const SceneView& scene, Report* report) {
  TissueSimulation simulation(scene);
  std::vector<double> awake;
  const int end = static_cast<int>(scene.script_duration_s * 100);
  for (int i = 0; i < end; ++i) {
    const auto tools = ScriptedTools(scene, 0.01 * i);
    StepReport step;
    const double ms = TimeMs(0, 1, [&] { step = simulation.Step(tools); }).front();
    for (std::uint32_t tool = 0; tool < kMaxTools; ++tool) {
      (void)simulation.Contacts(tool);
    }
    if (!step.asleep) {
      awake.push_back(ms);
    }
  }
  report->Add("physics.script.step_ms_p50", Quantile(awake, 0.5), "ms");
  report->Add("physics.script.step_ms_p99", Quantile(awake, 0.99), "ms");
  report->Add("physics.script.left_mm", 1e3 * simulation.MaxDisplacement(), "mm");
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
  if (report.Wants("physics.rest.")) {
    physics::Rest(scene, &report);
  }
  if (report.Wants("physics.determinism.")) {
    physics::Determinism(scene, &report);
  }
  if (report.Wants("physics.script.")) {
    physics::Script(scene, &report);
  }
  return 0;
}
