// The thermal node on ports: contact, pedals and the generator's setting in, topology, temperature patches and events
// out. The same class runs live, in a test and in a replay.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

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
#include "thermal_node/coupling/solid_surface.h"
#include "thermal_node/coupling/thermal_solver.h"
#include "thermal_node/coupling/tip_tracker.h"

namespace fulcrum::thermal {

/// A patch is due every this many ticks: 25 Hz at 100 Hz, faster than the eye resolves changes of colour.
inline constexpr std::uint64_t kTicksPerPatch = 4;
inline constexpr std::uint64_t kTicksPerClosure = 10;  ///< Ticks between computations of the energy closure for Health.
/// While nothing changes, one old patch is published every this many ticks, for late joiners.
inline constexpr std::uint64_t kTicksPerHistoryPatch = 100;
/// A checkpoint is written at each new revision, and every this many frames of the solver while tissue is warm.
inline constexpr std::uint64_t kFramesPerCheckpoint = 10;
/// Version of the checkpoint's layout; must change with it.
inline constexpr std::uint32_t kCheckpointLayout = 10;

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

  /// Scene, ports and checkpoint must outlive the node. Continues from the checkpoint if it holds a valid state.
  /// @param checkpoint null: no checkpoints are written or read.
  /// @param epoch_ns CLOCK_MONOTONIC at the start of the process [ns].
  ThermalNode(const SceneView& scene, const Ports& ports, runtime::CheckpointFile* checkpoint, std::int64_t epoch_ns);

  [[nodiscard]] static std::size_t CheckpointCapacity(const SceneView& scene);

  /// One period. Always called by the same thread.
  void Step(const Tick& tick);

  /// Fills metrics and last error. May be called from any thread.
  void FillHealth(Health* health) const;

  [[nodiscard]] const ThermalSolver& solver() const { return solver_; }
  /// nullptr: the scene's solids are not burnt (SolidsBurn).
  [[nodiscard]] const SolidSurface* solids() const { return solids_.get(); }
  /// Returns true once after each change of the set power in Health. Call from the thread of Step.
  [[nodiscard]] bool TakeSettingChanged() { return std::exchange(setting_changed_, false); }
  /// True if the node continued from a checkpoint.
  [[nodiscard]] bool restored() const { return restored_; }

 private:
  void TakeGeneratorInputs(const Tick& tick);
  /// Reads the contact samples since the last tick and converts them to motions of the tip, on the membrane and on the
  /// solids.
  void TakeContacts(const Tick& tick);
  [[nodiscard]] bool Accepts(const CauteryContact& sample) const;
  [[nodiscard]] TipInput AdvanceOnSolids(const CauteryContact& sample, const GeneratorDemand& demand, double dt_s);
  void StepSolids(double dt_s);
  /// Lets the film of steam collapse for the duration of samples that heat nothing.
  void CollapseFilm(double dt_s);
  [[nodiscard]] std::uint64_t StateHash() const;
  [[nodiscard]] std::optional<ThermalEventKind> InjuryOf(Index solid) const;
  /// The warning before that injury.
  [[nodiscard]] std::optional<ThermalEventKind> WarningOf(Index solid) const;
  /// Reads the torn edges, if a new message arrived.
  void TakeTears();
  void SaveCheckpoint();
  [[nodiscard]] bool Restore(std::span<const std::byte> checkpoint);
  void PublishTopology(const Tick& tick);
  /// Publishes the removed cells around the hook while it touches tissue, if they have changed.
  void PublishOpenCells(const Tick& tick);
  void PublishEvents(const Tick& tick);
  void PublishEvent(const Tick& tick, const SolverEvent& event, std::uint8_t solid = kNoSolid);
  void PublishPatch(const Tick& tick);
  struct NextPatch {
    BurntSurface surface;
    PatchPlace place;
  };
  /// Places of the membrane and of the solids that are due take turns.
  [[nodiscard]] std::optional<NextPatch> ChoosePatch(bool new_reader);
  void PublishManifest(const Tick& tick);
  /// True if a figure of Health has changed, or may have, since NoteHealth.
  [[nodiscard]] bool HealthIsOld() const;
  void NoteHealth();

  struct Figures {
    SolverFigures solver;
    double delivered_J, closure;
    std::uint64_t revision, quarantined, refused;
    std::uint32_t dead_edges, dead_nodes, awake_tiles, checkpoint_full, no_setting, no_place;
    float cut_length_m;
    float solids_dead_m2;
  };

  SceneView scene_;
  Ports ports_;
  runtime::CheckpointFile* checkpoint_;
  ThermalSolver solver_;
  std::unique_ptr<SolidSurface> solids_;  ///< Null: see solids().
  GeneratorInputs generator_;
  TipTracker tracker_;
  PatchPlanner planner_;
  std::optional<TipTracker> solid_tracker_;
  std::optional<PatchPlanner> solid_planner_;
  bus::Stamper topology_stamper_, open_stamper_, patch_stamper_, event_stamper_, manifest_stamper_;

  std::vector<CauteryContact> contacts_;
  std::vector<TipInput> tips_, solid_tips_;
  Index solid_chart_ = kNoIndex;  ///< Of the last contact with a solid.
  TopologyState topology_;
  OpenCells open_cells_, open_now_;  ///< Last published, and current.
  TearState tears_;
  HandleState handles_;
  GeneratorSetting setting_;
  TickManifest manifest_;
  std::uint64_t ticks_ = 0, refused_ = 0, frames_since_checkpoint_ = 0;
  std::int64_t wait_until_ns_ = 0;  ///< End of a restarted process's wait for the first HandleState.
  float set_power_W_ = 0;           ///< Last value stored for Health.
  bool waits_ = false, setting_changed_ = false, no_setting_ = false;
  bool restored_ = false, topology_due_ = true, patch_readers_ = false, patch_due_ = false, history_due_ = false,
       patch_note_due_ = false, solids_stepped_ = false, solids_turn_ = false;
  bool noted_step_ = false, noted_no_setting_ = false;  ///< As of NoteHealth, like the next two.
  std::uint64_t noted_refused_ = 0;
  float noted_hook_C_ = 0;
  double closure_ = 0;
  bool checkpoint_full_ = false;
  runtime::SeqLock<Figures> figures_;
};

}  // namespace fulcrum::thermal
