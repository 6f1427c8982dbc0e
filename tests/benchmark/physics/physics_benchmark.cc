// Cost of steps in which nothing happens, and whether equal inputs give equal states.
#include <algorithm>
#include <cmath>
#include <vector>

#include "physics_node/simulation/script_player.h"
#include "services/scene/builder/build.h"
#include "tests/benchmark/report.h"

namespace fulcrum::physics {
namespace {

using benchmark::Quantile;
using benchmark::Report;
using benchmark::TimeMs;

void Hover(const SceneView& scene, Report* report) {
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
  report->Add("physics.hover.step_us_p50", 1e3 * Quantile(ms, 0.5), "us");
}

/// Tools as near to the tissue as in the script before they touch it, moving; then in contact.
void HoverNear(const SceneView& scene, Report* report) {
  const auto at = [&](int i) { return ScriptedTools(scene, 0.01 * i); };
  const auto asleep_until = [&](TissueSimulation* simulation, int end) {
    for (int i = 0; i < 200; ++i) {
      simulation->Step(at(0));
    }
    int i = 0;
    while (i < end && simulation->Step(at(i)).asleep) {
      ++i;
    }
    return i;
  };
  TissueSimulation first(scene), simulation(scene);
  const int touch = asleep_until(&first, static_cast<int>(100 * scene.script_duration_s));
  (void)asleep_until(&simulation, touch);
  auto tools = at(std::max(touch - 1, 0));
  double asleep = 0;
  bool up = true;
  constexpr int kSteps = 500;
  const auto near = TimeMs(0, kSteps, [&] {
    tools[0].pose.p_WT.z() += up ? 1e-6f : -1e-6f;
    up = !up;
    asleep += simulation.Step(tools).asleep ? 1 : 0;
  });
  report->Add("physics.hover.near_pairs", static_cast<double>(simulation.collision().pairs().size()), "pairs");
  report->Add("physics.hover.near_asleep_pct", 100 * asleep / kSteps, "%");
  report->Add("physics.hover.near_step_us_p50", 1e3 * Quantile(near, 0.5), "us");
  int step = touch;
  const auto touched = TimeMs(0, 50, [&] { simulation.Step(at(step++)); });
  report->Add("physics.hover.touched_step_us_p50", 1e3 * Quantile(touched, 0.5), "us");
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

struct IdleCosts {
  double awake = 0;         ///< Fraction of the particles that stays awake.
  double some_ms = 0;       ///< A whole step with that fraction awake.
  double all_awake_ms = 0;  ///< A whole step of the same run before regions fell asleep.
};

/// A grasper that holds tissue and moves so little that most of the tissue comes to rest.
IdleCosts Tremble(const SceneView& scene, float amplitude_m) {
  TissueSimulation simulation(scene);
  int i = 0;
  while (i < 1000 && !simulation.grasp(0).holding()) {
    simulation.Step(ScriptedTools(scene, 0.01 * i++));
  }
  auto tools = ScriptedTools(scene, 0.01 * i);
  const ToolPose grasper = tools[0].pose;
  std::vector<double> all, some, awake;
  for (int step = 0; step < 1300; ++step) {
    tools[0].pose.p_WT = grasper.p_WT + Vec3f(0, 0, amplitude_m * std::sin(0.1f * static_cast<float>(step)));
    const double ms = TimeMs(0, 1, [&] { simulation.Step(tools); }).front();
    const auto part = static_cast<double>(simulation.awake_part());
    if (part > 0.99) {
      all.push_back(ms);
    } else if (step >= 900) {
      some.push_back(ms);
      awake.push_back(part);
    }
  }
  return {Quantile(awake, 0.5), Quantile(some, 0.5), Quantile(all, 0.5)};
}

/// Regions fall asleep as a whole, so the two amplitudes give fractions below and above a tenth awake; reported is the
/// ratio at a tenth by linear interpolation.
void Idle(const SceneView& scene, Report* report) {
  constexpr double kAwake = 0.1;
  const IdleCosts less = Tremble(scene, 0.9e-5f), more = Tremble(scene, 1.2e-5f);
  const auto ratio = [](const IdleCosts& costs) { return costs.some_ms / costs.all_awake_ms; };
  for (const auto& [name, costs] : {std::pair{"less", less}, {"more", more}}) {
    const std::string stem = std::string("physics.idle.") + name + ".";
    report->Add(stem + "awake_pct", 100 * costs.awake, "%");
    report->Add(stem + "frame_ms_p50", costs.some_ms, "ms");
    report->Add(stem + "ratio", ratio(costs), "1");
  }
  report->Add("physics.idle.all_awake_frame_ms_p50", more.all_awake_ms, "ms");
  const double along = (kAwake - less.awake) / (more.awake - less.awake);
  report->Add("physics.idle.ratio", ratio(less) + along * (ratio(more) - ratio(less)), "1");
}

/// Grasp and pull of the script, three times, then on two and three threads.
void Determinism(const SceneView& scene, Report* report) {
  const int steps = report->quick() ? 300 : 600;
  std::vector<std::uint64_t> hashes;
  for (const int threads : {1, 1, 1, 2, 3}) {
    TissueSimulation simulation(scene, threads);
    for (int i = 0; i < steps; ++i) {
      simulation.Step(ScriptedTools(scene, 0.01 * i));
    }
    hashes.push_back(simulation.StateHash());
  }
  const bool equal = std::all_of(hashes.begin(), hashes.end(), [&](std::uint64_t h) { return h == hashes[0]; });
  report->Add("physics.determinism.hash_equal", equal ? 1 : 0, "1");
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
  if (report.Wants("physics.hover.")) {
    physics::Hover(scene, &report);
    physics::HoverNear(scene, &report);
  }
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
