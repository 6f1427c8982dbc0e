// Clips: what sixteen of them cost in the script of the built-in scene, and what a scene costs in which a clip applier
// lies ready, as ratios of run times in one process; how far two clipped strips part under a traction.
#include <algorithm>
#include <chrono>
#include <vector>

#include "physics_node/simulation/script_player.h"
#include "physics_node/simulation/tissue_simulation.h"
#include "services/scene/builder/build.h"
#include "tests/benchmark/report.h"
#include "tests/support/clipped_strips.h"

namespace fulcrum::physics {
namespace {

double NowMs() {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// The built-in scene, perhaps with a third tool that no script moves.
scene::SceneData Scene(bool has_applier) {
  scene::SceneSettings settings = scene::BuiltIn();
  if (has_applier) settings.tools[2] = scene::DefaultTool(ToolKind::kClipApplier, Vec3f(0, -0.09f, 0.1f));
  return scene::BuildProcedural(settings);
}

/// Clips on blocks of 8 x 6 nodes, spread over the membrane.
ClipMemory SixteenClips(const SceneView& scene) {
  const ParticleStore particles(scene);
  Clips clips(scene);
  for (std::uint32_t i = 0; i < kMaxClips; ++i) {
    const std::uint32_t row = scene.membrane.rows * (i / 2 + 1) / (kMaxClips / 2 + 2);
    const std::uint32_t col = scene.membrane.cols * (i % 2 + 1) / 3;
    std::vector<Index> held;
    for (std::uint32_t r = 0; r < 8; ++r) {
      for (std::uint32_t c = 0; c < 6; ++c)
        held.push_back(scene.membrane.first + (row + r) * scene.membrane.cols + col + c);
    }
    const ToolPose pose{particles.At(particles.Ref(held[20])), Quatf::Identity(), 0};
    (void)clips.Apply(2, scene.tools[2], pose, held, particles);
  }
  return clips.Save();
}

struct Times {
  std::vector<double> none, ready, sixteen;  ///< By step: least time of some passes [ms].
  std::size_t clips = 0;
};

/// The simulations step in turns, so that a slow second of the machine slows all.
Times Measure(int steps, int passes) {
  const scene::SceneData plain = Scene(false), with = Scene(true);
  const SceneView plain_scene = plain.View(), scene = with.View();
  std::vector<float> xyz(3 * scene.rest_position.size());
  ParticleStore(scene).CopyPositions(xyz);
  SimulationMemory memory;
  memory.clips = SixteenClips(scene);
  Times times;
  times.clips = memory.clips.clips.size();
  times.none.assign(static_cast<std::size_t>(steps), 1e9);
  times.ready = times.sixteen = times.none;
  for (int pass = 0; pass < passes; ++pass) {
    TissueSimulation none(plain_scene), ready(scene), sixteen(scene);
    (void)none.Restore(xyz, xyz, {});
    (void)ready.Restore(xyz, xyz, {});
    (void)sixteen.Restore(xyz, xyz, memory);
    for (int i = 0; i < steps; ++i) {
      const auto step = [&](TissueSimulation* simulation, const SceneView& of, std::vector<double>* least) {
        const auto tools = ScriptedTools(of, 0.01 * i);
        const double begin = NowMs();
        simulation->Step(tools);
        double& time = (*least)[static_cast<std::size_t>(i)];
        time = std::min(time, NowMs() - begin);
      };
      step(&none, plain_scene, &times.none);
      step(&ready, scene, &times.ready);
      step(&sixteen, scene, &times.sixteen);
    }
  }
  return times;
}

double Sum(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return sum;
}

/// Strips pulled along by `pull` [m]: traction at the end, and the error of the clip's force against it.
void Pull(float pull, const std::string& name, benchmark::Report* report) {
  const scene::SceneData data = ClippedStrips(PhysicsMode::kAccurate, Vec3f(0, pull, 0));
  const SceneView scene = data.View();
  TissueSimulation simulation(scene);
  const Index first_of_strip = SheetParticle(scene, scene.sheets[1], 0, 0);
  constexpr int kMeanSteps = 50;
  const int steps = static_cast<int>(100 * (kPulled_s + 1)) + kMeanSteps;
  Vec3f force = Vec3f::Zero(), traction = Vec3f::Zero();
  double strip = 0, wall = 0, least = 1e9, most = 0;
  for (int i = 0; i < steps; ++i) {
    simulation.Step(ScriptedTools(scene, 0.01 * i));
    if (i < steps - kMeanSteps) continue;
    FloatArray field(simulation.particles().raw().size());
    simulation.clips().AddForce(field.data());
    Vec3f now = Vec3f::Zero();
    strip = wall = 0;
    const ClipMemory memory = simulation.clips().Save();
    for (const AppliedClip& clip : memory.clips) {
      for (const ClippedParticle& clipped : clip.tissue) {
        const bool is_strip = clipped.particle >= first_of_strip;
        (is_strip ? strip : wall) += 1;
        if (is_strip) now += FieldAt(field.data(), simulation.particles().Ref(clipped.particle));
      }
    }
    force += now / kMeanSteps;
    traction += simulation.solver_force(1) / kMeanSteps;
    least = std::min(least, static_cast<double>(now.norm()));
    most = std::max(most, static_cast<double>(now.norm()));
  }
  const auto newton = static_cast<double>(force.norm());
  report->Add(name + ".traction_N", static_cast<double>(traction.norm()), "N");
  report->Add(name + ".force_error", static_cast<double>((force - traction).norm() / traction.norm()), "1");
  report->Add(name + ".force_range_N", most - least, "N");
  report->Add(name + ".parting_um",
              1e6 * newton / static_cast<double>(Clips::kStiffness_N_per_m) * (1 / strip + 1 / wall), "um");
}

}  // namespace
}  // namespace fulcrum::physics

int main(int argc, char** argv) {
  using namespace fulcrum;
  benchmark::Report report(argc, argv);
  if (report.Wants("physics.clips.cost.")) {
    const physics::Times times = physics::Measure(report.quick() ? 200 : 600, report.quick() ? 1 : 3);
    const double none = physics::Sum(times.none);
    report.Add("physics.clips.cost.clips", static_cast<double>(times.clips), "1");
    report.Add("physics.clips.cost.ready_ratio", physics::Sum(times.ready) / none, "1");
    report.Add("physics.clips.cost.sixteen_ratio", physics::Sum(times.sixteen) / none, "1");
  }
  if (report.Wants("physics.clips.pull.")) {
    physics::Pull(0.02f, "physics.clips.pull.20mm", &report);
    physics::Pull(0.05f, "physics.clips.pull.50mm", &report);
  }
  return 0;
}
