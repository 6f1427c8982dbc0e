// The thermal node on ports: contact, pedals and the generator's setting in, topology, temperature patches and events
// out. The same class runs live, in a test and in a replay.
#pragma once

#include <cstdint>
#include <utility>

#include "services/base/core/generator_inputs.h"
#include "services/base/core/messages.h"
#include "services/base/core/scene_view.h"
#include "services/base/core/tick.h"
#include "services/base/runtime/checkpoint.h"
#include "services/base/runtime/seqlock.h"
#include "services/transport/bus/input_account.h"
#include "services/transport/bus/port.h"
#include "thermal_node/coupling/open_window.h"
#include "thermal_node/coupling/patch.h"
#include "thermal_node/coupling/thermal_solver.h"
#include "thermal_node/coupling/tip_tracker.h"

namespace fulcrum::thermal {

/// A patch is due every this many ticks: 25 Hz at 100 Hz, above what a monitor's eye follows in colour.
inline constexpr std::uint64_t kTicksPerPatch = 4;
inline constexpr std::uint64_t kTicksPerClosure = 10;  ///< Of the energy for Health.
/// When nothing changes, one old patch goes out this often, for readers that came late.
inline constexpr std::uint64_t kTicksPerHistoryPatch = 100;
/// A checkpoint at each new revision, and this often while the tissue is warm [frames of the solver].
inline constexpr std::uint64_t kFramesPerCheckpoint = 10;
/// Changes with the layout of the checkpoint.
inline constexpr std::uint32_t kCheckpointLayout = 7;

class ThermalNode {
 public:
  struct Ports {
    bus::Input<CauteryContact>& contact;
    bus::Input<TearState>& tears;
    bus::Input<HandleState>& handles;
    bus::Input<GeneratorSetting>& generator;
    bus::Output<TopologyState>& topology;
    bus::Output<OpenCells>& open_cells;
    bus::LoanOutput<TemperaturePatch>& patch;
    bus::Output<ThermalEvent>& event;
    bus::Output<TickManifest>& manifest;
  };

  /// Scene, ports and checkpoint must outlive the node. Goes on from the checkpoint when it holds something.
  /// @param checkpoint null: nothing is kept.
  /// @param epoch_ns CLOCK_MONOTONIC at the start of the process [ns].
  ThermalNode(const SceneView& scene, const Ports& ports, runtime::CheckpointFile* checkpoint, std::int64_t epoch_ns);

  [[nodiscard]] static std::size_t CheckpointCapacity(const SceneView& scene);

  /// One period. Always called by the same thread.
  void Step(const Tick& tick);

  /// Metrics and last error. Any thread.
  void FillHealth(Health* health) const;

  [[nodiscard]] const ThermalSolver& solver() const { return solver_; }
  /// The set power that Health tells has changed since this was last asked. The thread of Step.
  [[nodiscard]] bool TakeSettingChanged() { return std::exchange(setting_changed_, false); }
  /// It went on from a checkpoint.
  [[nodiscard]] bool restored() const { return restored_; }

 private:
  void TakeGeneratorInputs(const Tick& tick);
  /// What the electrode did since the last tick.
  [[nodiscard]] std::span<const TipInput> TakeContacts(const Tick& tick);
  /// What has torn; only what is new.
  void TakeTears();
  void SaveCheckpoint();
  [[nodiscard]] bool Restore(std::span<const std::byte> checkpoint);
  void PublishTopology(const Tick& tick);
  /// While the hook touches: what has changed around it.
  void PublishOpenCells(const Tick& tick);
  void PublishEvents(const Tick& tick);
  void PublishPatch(const Tick& tick);
  void PublishManifest(const Tick& tick);
  void NoteHealth();

  struct Figures {
    SolverFigures solver;
    double delivered_J, closure;
    std::uint64_t revision, quarantined, refused;
    std::uint32_t dead_edges, dead_nodes, awake_tiles, checkpoint_full, no_setting;
    float cut_length_m;
  };

  SceneView scene_;
  Ports ports_;
  runtime::CheckpointFile* checkpoint_;
  ThermalSolver solver_;
  GeneratorInputs generator_;
  TipTracker tracker_;
  PatchPlanner planner_;
  bus::Stamper topology_stamper_, open_stamper_, patch_stamper_, event_stamper_, manifest_stamper_;

  std::vector<CauteryContact> contacts_;
  std::vector<TipInput> tips_;
  TopologyState topology_;
  OpenCells open_cells_, open_now_;  ///< As published, and as they are.
  TearState tears_;
  HandleState handles_;
  GeneratorSetting setting_;
  TickManifest manifest_;
  std::uint64_t ticks_ = 0, refused_ = 0, frames_since_checkpoint_ = 0;
  std::int64_t wait_until_ns_ = 0;  ///< For the first HandleState, of a process that was started again.
  float set_power_W_ = 0;           ///< As Health tells it.
  bool waits_ = false, setting_changed_ = false, no_setting_ = false;
  bool restored_ = false, topology_due_ = true, patch_readers_ = false, patch_due_ = false, history_due_ = false,
       patch_note_due_ = false;
  double closure_ = 0;
  bool checkpoint_full_ = false;
  runtime::SeqLock<Figures> figures_;
};

}  // namespace fulcrum::thermal
