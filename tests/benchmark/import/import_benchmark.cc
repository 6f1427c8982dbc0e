// How many organs of other people's files become a scene without a word on centre line or facing, how long it takes,
// and whether a grasper can take hold of the membrane of the scene made around it and lift it. Each is compiled by the
// program, as a user would, with a limit of time.
#include <signal.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <thread>

#include "physics_node/simulation/script_player.h"
#include "services/base/runtime/child_process.h"
#include "services/scene/format/scene_file.h"
#include "tests/benchmark/import/anatomy_benchmark.h"
#include "tests/benchmark/import/organ_shapes.h"
#include "tests/benchmark/report.h"
#include "tests/unit/scene/mesh_writers.h"

namespace fulcrum::benchmark {
namespace {

namespace fs = std::filesystem;
using scene::writers::Out;

constexpr double kPatience_s = 60;
constexpr double kRefusal_s = 20;  ///< A refusal that takes longer counts as none.

std::string Bytes(const Organ& organ) {
  const scene::TriangleMesh surface{organ.mesh.vertices, organ.mesh.triangles};
  const std::string& file = organ.file;
  if (file == "stl" || file == "text.stl") return scene::writers::Stl(surface, file == "text.stl");
  if (file == "obj") return scene::writers::Obj(surface);
  if (file == "off") return scene::writers::Off(surface);
  if (file == "ply") return scene::writers::Ply(surface, Out::kBinary);
  if (file == "vtp") return scene::writers::Vtp(surface);
  if (file == "vtk" && organ.mesh.tets.empty()) return scene::writers::VtkPoly(surface, false, Out::kText);
  if (file == "vtk") return scene::writers::VtkGrid(organ.mesh, false, Out::kText);
  if (file == "vtu") return scene::writers::Vtu(organ.mesh, {.inline_text = true});
  return scene::writers::Gmsh22(organ.mesh, Out::kText);
}

std::string LastLine(const fs::path& file) {
  std::ifstream stream(file);
  std::string line, last;
  while (std::getline(stream, line)) {
    if (!line.empty()) last = line;
  }
  return last;
}

struct Result {
  bool compiled = false, timed_out = false;
  double seconds = 0;
  std::string last;
};

Result Compile(const std::vector<std::string>& words, const fs::path& log) {
  const auto start = std::chrono::steady_clock::now();
  const auto seconds = [&] { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(); };
  runtime::ChildProcess compiler =
      runtime::ChildProcess::Start(fs::path(FULCRUM_BIN_DIR) / "scene_compiler", words, log);
  Result result;
  for (;;) {
    const auto end = compiler.Poll();
    result.seconds = seconds();
    if (end) {
      result.compiled = end->signal == 0 && end->exit_code == 0;
      break;
    }
    if (result.seconds > kPatience_s) {
      result.timed_out = true;
      compiler.Signal(SIGKILL);
      break;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  result.last = LastLine(log);
  return result;
}

/// Empty, or what went wrong in the first eight seconds of the scene made around the mesh: no grasp, or not stable.
std::string Operate(const fs::path& mesh, const fs::path& folder) {
  constexpr double kUntil_s = 8, kLifted_s = 6.5;
  constexpr float kFar_m = 0.06f;
  const fs::path yaml = folder / "new.yaml", compiled = folder / "new.fulcrum", log = folder / "new.log";
  fs::remove(yaml);
  fs::remove(folder / "new.png");
  for (const auto& words : {std::vector<std::string>{"--new", "new", "--from", mesh.string(), "--out", yaml.string()},
                            std::vector<std::string>{yaml.string(), "--out", compiled.string()}}) {
    if (const Result result = Compile(words, log); !result.compiled) return result.last;
  }
  const scene::SceneFile file(compiled);
  const SceneView& scene = file.view();
  physics::TissueSimulation simulation(scene);
  bool holds = false;
  for (int i = 0; i < static_cast<int>(kUntil_s / static_cast<double>(scene.physics.dt_s)); ++i) {
    const double time_s = i * static_cast<double>(scene.physics.dt_s);
    simulation.Step(physics::ScriptedTools(scene, time_s));
    holds = holds || (time_s > kLifted_s && simulation.grasp(0).holding());
  }
  if (simulation.quarantined() > 0) return std::to_string(simulation.quarantined()) + " particles quarantined";
  if (!(simulation.MaxDisplacement() < kFar_m)) return "tissue flies";
  return holds ? "" : "the grasper holds nothing";
}

void Run(Report* report, const fs::path& folder) {
  std::vector<double> compile_s;
  int sound = 0, compiled = 0, operated = 0, refused_late = 0, wrongly = 0;
  double slowest_refusal = 0;
  std::size_t done = 0;
  const std::vector<Organ> organs = Organs();
  for (const Organ& organ : organs) {
    if (report->quick() && done++ % 4 != 0) continue;
    const fs::path mesh = folder / ("organ." + organ.file), yaml = folder / "organ.yaml";
    std::ofstream(mesh, std::ios::binary) << Bytes(organ);
    std::ofstream(yaml) << "name: organ\norgan:\n  import:\n    organ: " << mesh.filename().string() << "\n"
                        << (organ.options.empty() ? "" : "    " + organ.options + "\n")
                        << "membrane: {rows: 101, cols: 64}\nphysics: {mode: accurate}\n";
    const Result result = Compile({yaml.string(), "--out", (folder / "organ.fulcrum").string()}, folder / "organ.log");
    std::string fault;
    if (result.compiled && organ.is_sound) {
      fault = Operate(mesh, folder);
      operated += fault.empty() ? 1 : 0;
    }
    sound += organ.is_sound ? 1 : 0;
    compiled += organ.is_sound && result.compiled ? 1 : 0;
    wrongly += !organ.is_sound && result.compiled ? 1 : 0;
    if (result.compiled) {
      compile_s.push_back(result.seconds);
    } else {
      slowest_refusal = std::max(slowest_refusal, result.seconds);
      refused_late += result.seconds > kRefusal_s ? 1 : 0;
    }
    std::fprintf(stderr, "%-34s %-9s %6.2f s  %s\n", organ.name.c_str(), organ.file.c_str(), result.seconds,
                 !fault.empty()     ? fault.c_str()
                 : result.compiled  ? "operated"
                 : result.timed_out ? "no end"
                                    : result.last.c_str());
    fs::remove(mesh);
  }
  report->Add("import.meshes", sound, "count");
  report->Add("import.meshes_ok_pct", 100.0 * compiled / std::max(sound, 1), "%");
  report->Add("import.meshes_operated_pct", 100.0 * operated / std::max(sound, 1), "%");
  report->Add("import.wrongly_compiled", wrongly, "count");
  report->Add("import.refused_late", refused_late, "count");
  report->Add("import.refusal_s_max", slowest_refusal, "s");
  report->Add("import.organ_compile_s_p50", Quantile(compile_s, 0.5), "s");
  report->Add("import.organ_compile_s_max", Quantile(compile_s, 1), "s");
}

}  // namespace
}  // namespace fulcrum::benchmark

int main(int argc, char** argv) {
  using namespace fulcrum::benchmark;  // NOLINT: a main uses names of other modules only
  Report report(argc, argv);
  if (!report.Wants("import.")) return 0;
  const fs::path folder = fs::temp_directory_path() / ("fulcrum_import_" + std::to_string(getpid()));
  fs::create_directories(folder);
  if (report.Wants("import.anatomy") || report.Wants("import.hausdorff") || report.Wants("import.orientation") ||
      report.Wants("import.compile_s")) {
    MeasureAnatomy(&report, folder);
  }
  if (report.Wants("import.meshes") || report.Wants("import.organ")) Run(&report, folder);
  fs::remove_all(folder);
  return 0;
}
