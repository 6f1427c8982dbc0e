// Run time and error of every tissue solver on one case, in one table; the work-precision plot.
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>

#include "services/scene/builder/build.h"
#include "tests/benchmark/physics/baselines/mass_spring.h"
#include "tests/benchmark/physics/baselines/projective_dynamics.h"
#include "tests/benchmark/report.h"
#include "tests/benchmark/work_precision_plot.h"
#include "tests/numerics/physics/accurate_under_test.h"
#include "tests/numerics/physics/paper_solver.h"
#include "tests/numerics/physics/standard_case.h"
#include "tests/numerics/physics/xpbd_under_test.h"

namespace fulcrum::physics {
namespace {

struct Entry {
  std::string key;  ///< physics.KEY.*; empty: in the plot only.
  std::string label;
  std::string family;
  SolverFactory make;
  PhysicsParams params;  ///< The solver's own settings within the case.
};

std::vector<Entry> Entries(const SceneView& scene) {
  std::vector<Entry> entries;
  const auto add = [&](const char* key, const char* label, const char* family, auto change, SolverFactory make) {
    PhysicsParams params = scene.physics;
    change(&params);
    entries.push_back({key, label, family, std::move(make), params});
  };
  const auto accurate = [&](const char* key, const char* label, PhysicsPreset preset) {
    add(
        key, label, "TLI", [preset](PhysicsParams* p) { p->preset = preset; },
        [](const SceneView& s) { return std::make_unique<AccurateUnderTest>(s); });
  };
  accurate("fast", "TLI fast 1x3", PhysicsPreset::kFast);
  accurate("default", "TLI default 2x2", PhysicsPreset::kDefault);
  accurate("accurate", "TLI accurate 4x2", PhysicsPreset::kAccurate);
  accurate("reference_preset", "TLI reference 8x2", PhysicsPreset::kReference);
  const auto paper = [&](const char* key, const char* label, std::uint32_t iterations) {
    add(
        key, label, "PBD", [iterations](PhysicsParams* p) { p->iterations = iterations; },
        [](const SceneView& s) { return std::make_unique<PaperSolver>(s); });
  };
  paper("paper_mode", "PBD 3 (paper)", 3);
  paper("", "PBD 20", 20);
  const auto xpbd = [&](const char* key, const char* label, std::uint32_t substeps) {
    add(
        key, label, "XPBD", [substeps](PhysicsParams* p) { p->substeps = substeps; },
        [](const SceneView& s) { return std::make_unique<XpbdUnderTest>(s); });
  };
  xpbd("xpbd20", "XPBD 20x1", 20);
  xpbd("", "XPBD 80x1", 80);
  // The paper's Tables 3 and 4 on one machine: its method by number of iterations, and the two earlier methods.
  for (const std::uint32_t iterations : {1u, 2u, 5u, 10u}) {
    const std::string n = std::to_string(iterations);
    paper(("table3.pbd" + n).c_str(), ("PBD " + n).c_str(), iterations);
  }
  paper("table4.pbd", "PBD 3", 3);
  add(
      "table4.mass_spring", "mass-spring", "mass-spring", [](PhysicsParams*) {},
      [](const SceneView& s) { return std::make_unique<baselines::MassSpring>(s); });
  add(
      "table4.projective_dynamics", "projective dynamics", "projective dynamics", [](PhysicsParams*) {},
      [](const SceneView& s) { return std::make_unique<baselines::ProjectiveDynamics>(s); });
  return entries;
}

/// The accurate preset on two threads: the same errors in less time.
void MeasureTwoThreads(const StandardCase& standard, const StandardCase::Reference& truth, benchmark::Report* report) {
  SceneView scene = standard.scene();
  scene.physics.preset = PhysicsPreset::kAccurate;
  std::vector<double> frame_ms;
  for (int repeat = 0; repeat < (report->quick() ? 1 : 3); ++repeat) {
    const StandardRun run = RunStandardCase(
        standard, truth, [](const SceneView& s) { return std::make_unique<AccurateUnderTest>(s, 2); }, scene, false);
    frame_ms.insert(frame_ms.end(), run.frame_ms.begin(), run.frame_ms.end());
  }
  report->Add("physics.accurate.frame_ms_p50_2threads", benchmark::Quantile(frame_ms, 0.5), "ms");
}

StandardErrors Median(const std::vector<StandardErrors>& all) {
  StandardErrors median;
  for (double StandardErrors::*part : {&StandardErrors::pull, &StandardErrors::release, &StandardErrors::hold,
                                       &StandardErrors::hold_max_m, &StandardErrors::force, &StandardErrors::volume,
                                       &StandardErrors::tet_volume, &StandardErrors::strain, &StandardErrors::cut}) {
    std::vector<double> values;
    for (const StandardErrors& errors : all) {
      values.push_back(errors.*part);
    }
    median.*part = benchmark::Quantile(values, 0.5);
  }
  return median;
}

/// Measures one solver, prints its keys, returns its point in the plot. The folds of the sheet, and the errors on them,
/// depend on the last bit; reported is the median of runs whose stiffness differs by some millionths.
benchmark::WorkPrecisionPoint Measure(const StandardCase& standard, const StandardCase::Reference& truth,
                                      const Entry& entry, benchmark::Report* report) {
  constexpr int kRuns = 5;
  constexpr float kOther = 1e-6f;
  const std::string stem = "physics." + entry.key + ".";
  const bool with_cut = entry.key == "accurate";
  SceneView scene = standard.scene();
  scene.physics = entry.params;
  scene.physics.membrane_model = standard.scene().physics.membrane_model;
  std::vector<double> frame_ms, p99, cut_max;
  std::vector<StandardErrors> errors;
  const int runs = report->quick() || entry.key.empty() || entry.key.starts_with("table") ? 1 : kRuns;
  for (int i = 0; i < runs; ++i) {
    scene.physics.membrane_Et_N_per_m = entry.params.membrane_Et_N_per_m * (1 + kOther * static_cast<float>(i));
    const StandardRun run = RunStandardCase(standard, truth, entry.make, scene, with_cut);
    frame_ms.insert(frame_ms.end(), run.frame_ms.begin(), run.frame_ms.end());
    p99.push_back(benchmark::Quantile(run.frame_ms, 0.99));
    cut_max.push_back(run.cut_frame_ms.empty() ? 0 : run.cut_frame_ms.front());
    errors.push_back(run.errors);
  }
  const StandardErrors e = Median(errors);
  const double p50 = benchmark::Quantile(frame_ms, 0.5);
  if (!entry.key.empty()) {
    report->Add(stem + "frame_ms_p50", p50, "ms");
    report->Add(stem + "frame_ms_p99", benchmark::Quantile(p99, 0.5), "ms");
    report->Add(stem + "hold_error_pct", 100 * e.hold, "%");
    report->Add(stem + "hold_error_max_mm", 1e3 * e.hold_max_m, "mm");
    report->Add(stem + "force_error_pct", 100 * e.force, "%");
    report->Add(stem + "pull_error_pct", 100 * e.pull, "%");
    report->Add(stem + "release_error_pct", 100 * e.release, "%");
    report->Add(stem + "volume_error_pct", 100 * e.volume, "%");
    report->Add(stem + "tet_volume_error_pct", 100 * e.tet_volume, "%");
    report->Add(stem + "strain_error", e.strain, "1");
  }
  if (with_cut) {
    report->Add(stem + "cut_error_pct", 100 * e.cut, "%");
    report->Add(stem + "cut_frame_ms_max", benchmark::Quantile(cut_max, 0.5), "ms");
  }
  std::fprintf(stderr, "%-20s %8.2f ms  hold %8.3g %%  force %8.3g %%  pull %8.3g %%  release %8.3g %%\n",
               entry.label.c_str(), p50, 100 * e.hold, 100 * e.force, 100 * e.pull, 100 * e.release);
  return {entry.label, entry.family, p50, {100 * e.hold, 100 * e.pull}};
}

/// The case with one model of the membrane. Its truth takes minutes where no file has it.
struct Truth {
  explicit Truth(MembraneModel model) : standard(scene::BuildProcedural(scene::BuiltIn()), Settings(model)) {}
  const StandardCase::Reference& reference() {
    if (!loaded) {
      loaded = standard.LoadReference(std::filesystem::path(FULCRUM_BIN_DIR).parent_path() / "out");
    }
    return *loaded;
  }
  static StandardCaseSettings Settings(MembraneModel model) {
    StandardCaseSettings settings = kBuiltInCase;
    settings.membrane = model;
    return settings;
  }
  StandardCase standard;
  std::optional<StandardCase::Reference> loaded;
};

void RunAll(benchmark::Report* report) {
  // Each solver against the truth of the membrane that it has: mode accurate triangles, the others springs.
  Truth continuum(MembraneModel::kContinuum), springs(MembraneModel::kSprings);
  std::vector<benchmark::WorkPrecisionPoint> points;
  bool all = true;
  for (const Entry& entry : Entries(continuum.standard.scene())) {
    if (report->Wants("physics." + (entry.key.empty() ? "plot" : entry.key) + ".")) {
      Truth& truth = entry.family == "TLI" ? continuum : springs;
      points.push_back(Measure(truth.standard, truth.reference(), entry, report));
    } else {
      all = false;
    }
  }
  if (report->Wants("physics.accurate.")) {
    MeasureTwoThreads(continuum.standard, continuum.reference(), report);
  }
  if (!all) {
    return;  // A plot of some solvers could be mistaken for the complete one.
  }
  const char* folder = std::getenv("FULCRUM_BENCH_OUT");
  const std::filesystem::path file =
      std::filesystem::path(folder != nullptr ? folder : FULCRUM_SOURCE_DIR "/out") / "physics_work_precision.svg";
  std::filesystem::create_directories(file.parent_path());
  std::ofstream(file) << benchmark::WorkPrecisionSvg(
      "Error against run time, built-in scene, one core",
      {"static: 30 mm hold, RMS over RMS displacement", "dynamic: the pull, RMS over RMS displacement"}, points);
  std::fprintf(stderr, "wrote %s\n", file.c_str());
}

}  // namespace
}  // namespace fulcrum::physics

int main(int argc, char** argv) {
  fulcrum::benchmark::Report report(argc, argv);
  fulcrum::physics::RunAll(&report);
}
