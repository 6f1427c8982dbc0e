// The paper's mode at the paper's size: time and error of a step, against textbook code in the same run; the cost of an
// edit.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <string>
#include <utility>

#include "physics_node/simulation/script_player.h"
#include "services/scene/builder/build.h"
#include "tests/benchmark/physics/baselines/textbook_pbd.h"
#include "tests/benchmark/report.h"
#include "tests/support/whole_topology.h"

namespace fulcrum::physics {
namespace {

using benchmark::Quantile;
using benchmark::Report;
using benchmark::TimeMs;

/// The solver alone, without tools.
struct Bare {
  explicit Bare(const SceneView& view)
      : scene(view), particles(view), model(view, &particles), solver(view.physics, &model, &particles) {}
  void Step() {
    solver.Predict();
    for (std::uint32_t i = 0; i < scene.physics.iterations; ++i) {
      solver.Iterate();
    }
    solver.Finish();
  }
  SceneView scene;
  ParticleStore particles;
  TissueModel model;
  PbdSolver solver;
};

/// Calls visit(particle, lift) for the patch in the middle of the membrane; lift reaches 20 mm after 50 steps.
template <class Visit>
void Patch(const SceneView& scene, int step, const Visit& visit) {
  const float lift = 0.020f * std::min(1.0f, static_cast<float>(step + 1) / 50.0f);
  const Index rows = scene.membrane.rows, cols = scene.membrane.cols;
  for (Index r = rows / 2 - 4; r <= rows / 2 + 4; ++r) {
    for (Index c = cols / 2 - 3; c <= cols / 2 + 3; ++c) {
      visit(scene.membrane.first + r * cols + c, Vec3f(0, 0, lift));
    }
  }
}

/// A patch of the membrane lifted 20 mm in 0.5 s and held for 0.3 s.
void Hold(Bare* bare) {
  for (int i = 0; i < 80; ++i) {
    Patch(bare->scene, i, [&](Index particle, const Vec3f& lift) {
      const ParticleRef at = bare->particles.Ref(particle);
      bare->particles.SetInverseMass(at, 0.0f);
      bare->particles.Set(at, bare->scene.rest_position[particle] + lift);
    });
    bare->Step();
  }
}
void LetGo(Bare* bare) {
  Patch(bare->scene, 0, [&](Index particle, const Vec3f&) {
    bare->particles.SetInverseMass(bare->particles.Ref(particle), bare->scene.inverse_mass[particle]);
  });
}

std::vector<float> Positions(const ParticleStore& particles) {
  std::vector<float> xyz(3 * std::size_t{particles.particle_count()});
  particles.CopyPositions(xyz);
  return xyz;
}

/// RMS of a - b over RMS of a - from, in percent.
double DifferencePct(const std::vector<float>& a, const std::vector<float>& b, const std::vector<float>& from) {
  double difference = 0, size = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    difference += std::pow(static_cast<double>(a[i]) - b[i], 2);
    size += std::pow(static_cast<double>(a[i]) - from[i], 2);
  }
  return 100.0 * std::sqrt(difference / size);
}

/// Steps of tissue released from a pulled pose: everything awake and moving, no tools.
void Step(const SceneView& scene, Report* report) {
  const int steps = report->quick() ? 40 : 200;
  Bare bare(scene);
  Hold(&bare);
  LetGo(&bare);
  const auto constraint_count = [&] {
    const ConstraintCounts counts = bare.model.counts();
    return static_cast<double>(counts.stretch + counts.volume + counts.bending + counts.bindings);
  };
  // A few steps of textbook code from the same pose at intervals, so that both run under the same load of the machine.
  const auto textbook_here = [&](baselines::TextbookPbd::Order order) {
    baselines::TextbookPbd textbook(scene, order);
    for (Index p = 0; p < scene.rest_position.size(); ++p) {
      baselines::PbdParticle& particle = textbook.particles()[p];
      particle.x = bare.particles.At(bare.particles.Ref(p)).cast<double>();
      particle.previous = bare.particles.Previous(bare.particles.Ref(p)).cast<double>();
    }
    return textbook;
  };
  const auto positions_of = [](baselines::TextbookPbd& textbook) {
    std::vector<float> xyz;
    for (const baselines::PbdParticle& p : textbook.particles()) {
      for (int axis = 0; axis < 3; ++axis) {
        xyz.push_back(static_cast<float>(p.x[axis]));
      }
    }
    return xyz;
  };
  baselines::TextbookPbd textbook = textbook_here(baselines::TextbookPbd::Order::kScene);
  baselines::TextbookPbd same_order = textbook_here(baselines::TextbookPbd::Order::kKernels);
  std::vector<float> rest;
  for (const Vec3f& p : scene.rest_position) {
    rest.insert(rest.end(), {p.x(), p.y(), p.z()});
  }
  std::vector<double> ours, theirs;
  for (int i = 0; i < steps; ++i) {
    ours.push_back(TimeMs(0, 1, [&] { bare.Step(); }).front());
    for (int k = 0; k < 4 && i % 20 == 19; ++k) {
      theirs.push_back(TimeMs(0, 1, [&] { textbook.Step(); }).front());
    }
    if (i == 0) {
      same_order.Step();
      const std::vector<float> here = Positions(bare.particles);
      report->Add("physics.paper_mode.textbook_difference_pct", DifferencePct(positions_of(textbook), here, rest), "%");
      report->Add("physics.paper_mode.textbook_same_order_difference_pct",
                  DifferencePct(positions_of(same_order), here, rest), "%");
    }
  }
  const double step_ms = Quantile(ours, 0.5), textbook_ms = Quantile(theirs, 0.5);
  // Lower deciles: on a shared machine longer steps are interrupted more often.
  const double speedup = Quantile(theirs, 0.1) / Quantile(ours, 0.1);
  report->Add("physics.paper_mode.step_ms_p50", step_ms, "ms");
  report->Add("physics.paper_mode.step_ms_min", Quantile(ours, 0.0), "ms");
  report->Add("physics.paper_mode.step_ms_p99", Quantile(ours, 0.99), "ms");
  report->Add("physics.paper_mode.ns_per_constraint", 1e6 * step_ms / (scene.physics.iterations * constraint_count()),
              "ns");
  report->Add("physics.paper_mode.textbook_step_ms_p50", textbook_ms, "ms");
  report->Add("physics.paper_mode.speedup_vs_textbook", speedup, "1");
}

/// Step time over the whole script: approach, grasp, pull, hook along the membrane, release.
void ScriptedStep(const SceneView& scene, Report* report) {
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
  report->Add("physics.paper_mode.scripted_step_ms_p50", Quantile(awake, 0.5), "ms");
  report->Add("physics.paper_mode.scripted_step_ms_p99", Quantile(awake, 0.99), "ms");
}

/// Tables 3 and 4 of the paper, for the equations corrected and as printed: their counts, and the mean time of a step
/// of the whole script (a step of the paper is a frame: 9.48 ms are its 105.49 frames a second).
void Tables(SceneView scene, Report* report) {
  ParticleStore particles(scene);
  const ConstraintCounts counts = TissueModel(scene, &particles).counts();
  report->Add("physics.paper_tables.vertices", static_cast<double>(counts.vertices), "1");
  report->Add("physics.paper_tables.stretch", static_cast<double>(counts.stretch), "1");
  report->Add("physics.paper_tables.volume", static_cast<double>(counts.volume), "1");
  report->Add("physics.paper_tables.bending", static_cast<double>(counts.bending), "1");
  report->Add("physics.paper_tables.tetrahedra", static_cast<double>(scene.tets.size()), "1");
  for (const auto& [form, name] : {std::pair{PaperForm::kCorrected, "corrected"}, {PaperForm::kPrinted, "printed"}}) {
    scene.physics.as = form;
    TissueSimulation simulation(scene);
    std::vector<double> awake;
    std::uint64_t quarantined = 0;
    float farthest = 0;
    const int end = static_cast<int>(scene.script_duration_s * 100) / (report->quick() ? 2 : 1);
    for (int i = 0; i < end; ++i) {
      const auto tools = ScriptedTools(scene, 0.01 * i);
      StepReport step;
      const double ms = TimeMs(0, 1, [&] { step = simulation.Step(tools); }).front();
      quarantined += step.resets;
      if (!step.asleep) {
        awake.push_back(ms);
      }
      farthest = std::max(farthest, simulation.MaxDisplacement());
    }
    const double mean_ms = std::accumulate(awake.begin(), awake.end(), 0.0) / static_cast<double>(awake.size());
    const std::string stem = std::string("physics.paper_tables.") + name + ".";
    report->Add(stem + "step_ms_mean", mean_ms, "ms");
    report->Add(stem + "steps_per_s", 1000 / mean_ms, "1/s");
    report->Add(stem + "awake_pct", 100.0 * static_cast<double>(awake.size()) / end, "%");
    report->Add(stem + "farthest_mm", 1e3 * static_cast<double>(farthest), "mm");
    report->Add(stem + "resets", static_cast<double>(quarantined), "1");
  }
}

/// Error in the hold, against the converged shape of the same constraints.
void HoldError(SceneView scene, Report* report) {
  Bare few(scene);
  Hold(&few);
  scene.physics.iterations = report->quick() ? 60 : 300;
  Bare many(scene);
  Hold(&many);
  std::vector<float> rest;
  for (const Vec3f& p : scene.rest_position) {
    rest.insert(rest.end(), {p.x(), p.y(), p.z()});
  }
  report->Add("physics.paper_mode.own_hold_error_pct",
              DifferencePct(Positions(many.particles), Positions(few.particles), rest), "%");
}

void Edit(const SceneView& scene, Report* report) {
  ParticleStore particles(scene);
  TissueModel model(scene, &particles);
  TopologyState state = WholeTopology(scene);
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
  scene::SceneData data = scene::BuildProcedural(scene::BuiltIn());
  data.fixed.physics.mode = PhysicsMode::kPaper;
  const SceneView scene = data.View();
  std::fprintf(stderr, "physics: kernels %s, 1 thread\n", physics::pbd::KernelsFor().name);
  if (report.Wants("physics.paper_mode.")) {
    physics::Step(scene, &report);
    physics::ScriptedStep(scene, &report);
    physics::HoldError(scene, &report);
  }
  if (report.Wants("physics.paper_tables.")) {
    physics::Tables(scene, &report);
  }
  if (report.Wants("physics.edit.")) {
    physics::Edit(scene, &report);
  }
  return 0;
}
