// What doing nothing costs, and whether the same inputs give the same state.
#include <algorithm>
#include <cmath>
#include <vector>

#include "services/scene/build.h"
#include "tests/benchmark/report.h"
#include "tests/numerics/physics/script_player.h"

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

/// A step of a scene in which nothing moves, not even a tool.
void Rest(const SceneView& scene, Report* report) {
  TissueSimulation simulation(scene);
  const auto tools = ScriptedTools(scene, 0.0);
  for (int i = 0; i < 200; ++i) {
    simulation.Step(tools);
  }
  report->Add("physics.rest.frame_us", 1e3 * Quantile(TimeMs(10, 2000, [&] { simulation.Step(tools); }), 0.5), "us");
}

/// A few nodes of the membrane go up and down so gently that nine tenths of the tissue stay at rest; the same with all
/// awake, for the ratio.
void Idle(const SceneView& scene, Report* report) {
  struct Run {
    double ms = 0, awake = 0;
  };
  const auto play = [&](bool all_awake) {
    ParticleStore particles(scene);
    TissueModel tissue(scene, &particles);
    accurate::AccurateSolver solver(scene, BuildElasticModel(scene), tissue, &particles);
    std::vector<accurate::HeldPlace> held;
    std::vector<Vec3f> rest;
    const Index row = scene.membrane.rows / 2, col = scene.membrane.cols / 2;
    for (Index r = row - 1; r <= row + 1; ++r) {
      for (Index c = col - 1; c <= col + 1; ++c) {
        const Index p = scene.membrane.first + r * scene.membrane.cols + c;
        held.push_back({particles.Ref(p), scene.rest_position[p]});
        rest.push_back(scene.rest_position[p]);
        particles.SetInverseMass(held.back().at, 0);
      }
    }
    const accurate::Effort effort = accurate::EffortOf(scene.physics.preset);
    const float h = scene.physics.dt_s / static_cast<float>(effort.substeps);
    const auto step = [&](int i) {
      if (all_awake) {
        for (Index p = 0; p < particles.particle_count(); ++p) {
          const ParticleRef at = particles.Ref(p);
          solver.SetVelocity(at, solver.Velocity(at));
        }
      }
      for (std::size_t k = 0; k < held.size(); ++k) {
        held[k].place = rest[k] + Vec3f(0, 0, 1.2e-5f * std::sin(0.1f * static_cast<float>(i)));
      }
      return TimeMs(0, 1,
                    [&] {
                      solver.BeginStep();
                      for (int s = 0; s < effort.substeps; ++s) {
                        solver.Substep(h, effort.iterations, held, {});
                      }
                    })
          .front();
    };
    std::vector<double> ms, awake;
    for (int i = 0; i < 600; ++i) {
      const double time = step(i);
      if (i >= 200) {
        ms.push_back(time);
        awake.push_back(static_cast<double>(solver.regions().awake_part()));
      }
    }
    return Run{Quantile(ms, 0.5), Quantile(awake, 0.5)};
  };
  const Run all = play(true), some = play(false);
  report->Add("physics.idle.awake_pct", 100 * some.awake, "%");
  report->Add("physics.idle.frame_ms_p50", some.ms, "ms");
  report->Add("physics.idle.all_awake_frame_ms_p50", all.ms, "ms");
  report->Add("physics.idle.ratio", some.ms / all.ms, "1");
}

/// Grasp and pull of the script, three times over, then on two and three threads.
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
