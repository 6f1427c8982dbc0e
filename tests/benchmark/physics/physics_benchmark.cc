// Time and error of the paper mode at the paper's size, of doing nothing, and of an edit.
#include <cmath>
#include <cstdio>

#include "services/scene/build.h"
#include "tests/benchmark/report.h"
#include "tests/numerics/physics/script_player.h"

namespace fulcrum::physics {
namespace {

using benchmark::Quantile;
using benchmark::Report;
using benchmark::TimeMs;

/// Step time over the whole script: approach, grasp, pull, hook along the membrane, release.
void PaperMode(const SceneView& scene, Report* report) {
  TissueSimulation simulation(scene);
  const ConstraintCounts counts = simulation.model().counts();
  std::vector<double> awake;
  int index = 0;
  const int end = static_cast<int>(scene.script_duration_s * 100);
  for (int repeat = 0; repeat < end; ++repeat, ++index) {
    const auto tools = ScriptedTools(scene, 0.01 * index);
    StepReport step;
    const double ms = TimeMs(0, 1, [&] { step = simulation.Step(tools); }).front();
    for (std::uint32_t tool = 0; tool < kMaxTools; ++tool) {
      (void)simulation.Contacts(tool);
    }
    if (!step.asleep) {
      awake.push_back(ms);
    }
  }
  // A sweep over all constraints alone, without tools.
  ParticleStore particles(scene);
  TissueModel model(scene, &particles);
  PbdSolver solver(scene.physics, &model, &particles);
  const double iteration_ms = Quantile(TimeMs(20, report->quick() ? 200 : 1000, [&] { solver.Iterate(); }), 0.5);
  const auto constraints = static_cast<double>(counts.stretch + counts.volume + counts.bending + counts.bindings);
  report->Add("physics.paper_mode.step_ms_p50", Quantile(awake, 0.5), "ms");
  report->Add("physics.paper_mode.step_ms_p99", Quantile(awake, 0.99), "ms");
  report->Add("physics.paper_mode.ns_per_constraint", 1e6 * iteration_ms / constraints, "ns");
  report->Add("physics.paper_mode.vertices", static_cast<double>(counts.vertices), "1");
  report->Add("physics.paper_mode.stretch", static_cast<double>(counts.stretch), "1");
  report->Add("physics.paper_mode.volume", static_cast<double>(counts.volume), "1");
  report->Add("physics.paper_mode.bending", static_cast<double>(counts.bending), "1");
  report->Add("physics.paper_mode.bindings", static_cast<double>(counts.bindings), "1");
}

/// A patch of the membrane lifted 20 mm in 0.5 s and held for 0.3 s, with so many iterations a step.
std::vector<float> Hold(SceneView scene, std::uint32_t iterations) {
  scene.physics.iterations = iterations;
  TissueSimulation simulation(scene);
  ParticleStore& particles = simulation.particles();
  const Index rows = scene.membrane.rows, cols = scene.membrane.cols;
  for (int i = 0; i < 80; ++i) {
    const float up = 0.020f * std::min(1.0f, static_cast<float>(i + 1) / 50.0f);
    for (Index r = rows / 2 - 4; r <= rows / 2 + 4; ++r) {
      for (Index c = cols / 2 - 3; c <= cols / 2 + 3; ++c) {
        const Index particle = scene.membrane.first + r * cols + c;
        const ParticleRef at = particles.Ref(particle);
        particles.SetInverseMass(at, 0.0f);
        particles.Set(at, scene.rest_position[particle] + Vec3f(0, 0, up));
      }
    }
    simulation.Step({});
  }
  std::vector<float> xyz(3 * std::size_t{particles.particle_count()});
  particles.CopyPositions(xyz);
  return xyz;
}

/// RMS distance from the converged shape of the same constraints, over its RMS displacement from rest.
void HoldError(const SceneView& scene, Report* report) {
  const std::vector<float> few = Hold(scene, scene.physics.iterations);
  const std::vector<float> many = Hold(scene, report->quick() ? 60 : 300);
  double error = 0, displacement = 0;
  for (std::size_t i = 0; i < few.size(); ++i) {
    const double rest = scene.rest_position[i / 3][static_cast<Eigen::Index>(i % 3)];
    error += std::pow(static_cast<double>(few[i]) - many[i], 2);
    displacement += std::pow(many[i] - rest, 2);
  }
  report->Add("physics.paper_mode.hold_error_pct", 100.0 * std::sqrt(error / displacement), "%");
}

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

void Edit(const SceneView& scene, Report* report) {
  ParticleStore particles(scene);
  TissueModel model(scene, &particles);
  TopologyState state;
  const std::size_t nodes = scene.membrane.node_count();
  state.rows = scene.membrane.rows;
  state.cols = scene.membrane.cols;
  state.dead_nodes.assign((nodes + 7) / 8, 0);
  state.dead_edges.assign((3 * nodes + 7) / 8, 0);
  state.shrink.assign(3 * nodes, 0);
  const double compare_us = 1e3 * Quantile(TimeMs(5, 200, [&] { (void)model.Apply(state, &particles); }), 0.5);
  // A cut along the middle column, ten edges a message.
  std::vector<double> per_edge_us;
  const Index col = scene.membrane.cols / 2;
  for (Index row = 10; row + 12 < scene.membrane.rows; row += 10) {
    for (Index i = 0; i < 10; ++i) {
      SetBit(state.dead_edges, 3 * ((row + i) * scene.membrane.cols + col));
    }
    int edits = 0;
    const double ms = TimeMs(0, 1, [&] { edits = model.Apply(state, &particles); }).front();
    per_edge_us.push_back((1e3 * ms - compare_us) / edits);
  }
  report->Add("physics.edit.us_per_edge", Quantile(per_edge_us, 0.5), "us");
  report->Add("physics.edit.compare_us_p50", compare_us, "us");
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
  std::fprintf(stderr, "physics: kernels %s, 1 thread\n", physics::BestKernels().name);
  if (report.Wants("physics.paper_mode.")) {
    physics::PaperMode(scene, &report);
    physics::HoldError(scene, &report);
  }
  if (report.Wants("physics.idle.")) {
    physics::Idle(scene, &report);
  }
  if (report.Wants("physics.edit.")) {
    physics::Edit(scene, &report);
  }
  return 0;
}
