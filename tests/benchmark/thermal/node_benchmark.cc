#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <numeric>
#include <vector>

#include "services/scene/builder/build.h"
#include "tests/benchmark/thermal/thermal_cases.h"
#include "tests/unit/thermal/node_bus.h"
#include "thermal_node/coupling/patch.h"
#include "thermal_node/node/thermal_node.h"

namespace fulcrum::thermal {
namespace {

using benchmark::Quantile;
using benchmark::Report;
using benchmark::TimeMs;

/// A node on in-process ports with a reader on every topic and a checkpoint on disk, as in a session.
class Session {
 public:
  explicit Session(const SceneView& scene) : scene_(scene) {
    const std::string name = "fulcrum_bench_thermal_" + std::to_string(::getpid());
    folder_ = std::filesystem::temp_directory_path() / name;
    std::filesystem::create_directories(folder_);
    checkpoint_ = std::make_unique<runtime::CheckpointFile>(folder_ / "checkpoint", scene.hash, kCheckpointLayout,
                                                            ThermalNode::CheckpointCapacity(scene));
    node_ = std::make_unique<ThermalNode>(scene_, bus_.ports(), checkpoint_.get(), 1);
  }
  ~Session() { std::filesystem::remove_all(folder_); }
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  /// Sets the tip to the input; the next Step reads it.
  void Touch(const TipInput& tip) {
    bus_.Demand(tip.mode, tip.power_W, tick_.stamp_ns);
    CauteryContact contact = TouchAt(tip.path.to, tip.path.radius_m);
    contact.stamp = {++sequence_, 1, tick_.stamp_ns};
    contact.session_time_s = tick_.session_time_s;
    bus_.contact_out->Write(contact);
  }
  void Step() {
    Advance(&tick_);
    node_->Step(tick_);
  }
  [[nodiscard]] const ThermalSolver& solver() const { return node_->solver(); }

 private:
  SceneView scene_;
  std::filesystem::path folder_;
  NodeBus bus_;
  std::unique_ptr<bus::Input<TemperaturePatch>> patch_in_ = bus_.patches.MakeInput(1);
  std::unique_ptr<runtime::CheckpointFile> checkpoint_;
  std::unique_ptr<ThermalNode> node_;
  Tick tick_;
  std::uint64_t sequence_ = 0;
};

/// Every stage of a frame while the built-in scene is cut: contact in, solver, checkpoint, topology, events, patch and
/// manifest out.
void NodeCutting(Report* report) {
  if (!report->Wants("thermal.node_cutting_5mm_s")) return;
  const scene::SceneData data = scene::BuildProcedural(scene::BuiltIn());
  const SceneView scene = data.View();
  const Drag drag = BuiltInDrag(scene, 0.005f);
  // The repeats are bitwise equal, so the median over them excludes the time of other work on the machine.
  std::vector<std::vector<double>> repeats(drag.frames(kFrame_s));
  SourceStats steps;
  for (int repeat = 0; repeat < (report->quick() ? 3 : 7); ++repeat) {
    Session session(scene);
    session.Step();  // the first one publishes the whole topology
    steps = {};
    for (int frame = 0; frame < drag.frames(kFrame_s); ++frame) {
      session.Touch(drag.At(frame, kFrame_s));
      repeats[frame].push_back(TimeMs(0, 1, [&] { session.Step(); }).front());
      const SourceStats& stats = session.solver().source_stats();
      steps.solves += stats.solves;
      steps.by_change += stats.by_change;
      steps.by_travel += stats.by_travel;
      steps.by_floor += stats.by_floor;
    }
    if (repeat == 0) Picture(session.solver(), scene, drag.to - Vec2f(0, 0.004f), "scene");
  }
  std::vector<double> times;
  times.reserve(repeats.size());
  for (const std::vector<double>& frame : repeats) times.push_back(Quantile(frame, 0.5));
  const double mean = std::accumulate(times.begin(), times.end(), 0.0) / static_cast<double>(times.size());
  report->Add("thermal.node_cutting_5mm_s.frame_ms_mean", mean, "ms");
  report->Add("thermal.node_cutting_5mm_s.frame_ms_p50", Quantile(times, 0.5), "ms");
  report->Add("thermal.node_cutting_5mm_s.frame_ms_p99", Quantile(times, 0.99), "ms");
  // Causes that ended the coupling steps; the remaining ones ended with their half of the frame.
  const auto percent = [&](int count) { return 100.0 * count / steps.solves; };
  const double frames = static_cast<double>(times.size());
  report->Add("thermal.node_cutting_5mm_s.coupling_steps_per_frame", steps.solves / frames, "1");
  report->Add("thermal.node_cutting_5mm_s.coupling_steps_by_change_pct", percent(steps.by_change), "%");
  report->Add("thermal.node_cutting_5mm_s.coupling_steps_by_way_pct", percent(steps.by_travel), "%");
  report->Add("thermal.node_cutting_5mm_s.coupling_steps_by_floor_pct", percent(steps.by_floor), "%");
}

/// Largest closure error of the energy during a cut of ten seconds.
void EnergyClosure(Report* report) {
  if (!report->Wants("thermal.energy_closure_rel")) return;
  const scene::SceneData data = scene::BuildProcedural(scene::BuiltIn());
  const SceneView scene = data.View();
  ThermalSolver solver(scene);
  const Drag drag = BuiltInDrag(scene, 0.003f);
  double worst = 0;
  for (int frame = 0; frame < drag.frames(kFrame_s); ++frame) {
    solver.Step(drag.At(frame, kFrame_s), kFrame_s);
    worst = std::max(worst, solver.ledger().ClosureError(solver.field().Stored()));
  }
  report->Add("thermal.energy_closure_rel", worst, "1");
}

/// Work of the node at 20 and 25 Hz beside the solver.
void CheckpointAndPatch(Report* report) {
  if (!report->Wants("thermal.checkpoint_") && !report->Wants("thermal.patch_ms")) return;
  const scene::SceneData data = scene::BuildProcedural(scene::BuiltIn());
  const SceneView scene = data.View();
  ThermalSolver solver(scene);
  RunDrag(BuiltInDrag(scene, 0.005f), kFrame_s, &solver);
  while (!solver.at_commit_frame()) solver.Step(TipInput{}, kFrame_s);
  std::vector<std::byte> slot(ThermalSolver::CheckpointCapacity(scene));
  std::size_t bytes = 0;
  report->Add("thermal.checkpoint_ms", Quantile(TimeMs(2, 15, [&] { bytes = solver.Save(slot); }), 0.5), "ms");
  report->Add("thermal.checkpoint_kib", static_cast<double>(bytes) / 1024, "KiB");
  std::vector<std::uint8_t> texels(4 * kPatchTexels * kPatchTexels);
  const auto draw = [&] { DrawPatch(solver.field(), scene.membrane.texel_m, {0, 256, 768}, texels); };
  report->Add("thermal.patch_ms", Quantile(TimeMs(2, 15, draw), 0.5), "ms");
}

void Idle(Report* report) {
  if (!report->Wants("thermal.idle_frame_ns")) return;
  const scene::SceneData data = FlatScene(41, 61, 1e-3f);
  ThermalSolver solver(data.View());
  constexpr int kFrames = 100000;
  const auto body = [&] {
    for (int n = 0; n < kFrames; ++n) solver.Step(TipInput{}, kFrame_s);
  };
  report->Add("thermal.idle_frame_ns", Quantile(TimeMs(1, 5, body), 0.5) * 1e6 / kFrames, "ns");
}

}  // namespace

Drag BuiltInDrag(const SceneView& scene, float speed_m_s) {
  const MembraneGrid& grid = scene.membrane;
  Drag drag;
  drag.from = scene.membrane_material[(grid.rows * 42 / 100) * grid.cols + grid.cols * 62 / 100] + Vec2f(3e-4f, 2e-4f);
  drag.to = drag.from + Vec2f(0, 0.030f);
  drag.speed_m_s = speed_m_s;
  drag.radius_m = scene.tools[1].tip_radius_m;
  return drag;
}

void NodeCases(Report* report) {
  NodeCutting(report);
  EnergyClosure(report);
  CheckpointAndPatch(report);
  Idle(report);
}

}  // namespace fulcrum::thermal
