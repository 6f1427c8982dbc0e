// Electrocautery of one membrane, frame by frame, by Strang splitting: half the source, conduction, half the source,
// then damage and topology. With the scene's `thermal.model: paper` the paper's source, conduction and node rule are
// used instead.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "services/base/core/scene_view.h"
#include "thermal_node/coupling/cut_meter.h"
#include "thermal_node/coupling/source_window.h"
#include "thermal_node/coupling/tip_tracker.h"
#include "thermal_node/damage/arrhenius.h"
#include "thermal_node/heat/heat_field.h"
#include "thermal_node/paper/paper_model.h"
#include "thermal_node/protected/protected_structures.h"
#include "thermal_node/topology/crumbs.h"
#include "thermal_node/topology/mesh_topology.h"
#include "thermal_node/volume/sheet_contact.h"

namespace fulcrum::thermal {

/// Topology is committed every this many frames: 20 Hz at 100 Hz.
inline constexpr int kCommitFrames = 5;
/// Protected structures are updated every this many frames: their time constants are seconds.
inline constexpr int kProtectedFrames = 5;
/// Index, modulo kProtectedFrames, of the frame that updates them: not the frame that commits, which has the most work.
inline constexpr int kProtectedFrame = 2;

/// Limit of the growth rate of the published cut length [m/s], a fifth above the fastest stroke. Without it the length
/// would jump: where the hook slips through tissue that it was pulling, or two holes meet, the slit grows by
/// millimetres between two commits.
inline constexpr float kLengthRate_m_s = 0.0098f;

struct SolverEvent {
  ThermalEventKind kind;
  Vec2f material;
  float temperature_C;
  float value;
};

/// Figures of the last frame and since the start.
struct SolverFigures {
  float highest_C = 0;  ///< Since the start.
  float present_C = 0;
  float power_W = 0;      ///< Power that the generator delivers, mean over the time of the last samples; 0 without any.
  float set_power_W = 0;  ///< Power that is set at the generator; 0 while it is not active.
  float hook_C = 0;       ///< Temperature of the metal.
  float debris_m2 = 0;    ///< Area of the crumbs that were removed.
  float cut_width_p50_m = 0, cut_width_p95_m = 0;  ///< See CutMeter.
  float cut_off_way_m = 0;  ///< Distance of the slit's centre line from the contact's path; see CutMeter.
  float voltage_V = 0;
  float burn_depth_m = 0;  ///< Deepest dead tissue below the sheet since the start; 0 without a volume.
  std::uint32_t warnings = 0, injuries = 0;
  std::uint32_t shortened = 0;  ///< Frames in which the metal did not fit into the potential's window; see kMetalReach.
  int substeps = 0, solves = 0, iterations = 0;
};

class ThermalSolver {
 public:
  /// A scene without a membrane is always at rest. Throws InputError when its membrane or parameters are not usable.
  explicit ThermalSolver(const SheetScene& scene);
  ThermalSolver(const ThermalSolver&) = delete;  // members hold references to each other
  ThermalSolver& operator=(const ThermalSolver&) = delete;

  /// Advances one frame; each sample of the electrode is applied for its own duration. Returns after a few comparisons
  /// if there is no current, all tissue is cold and no change is staged.
  void Step(std::span<const TipInput> tips, float dt_s);
  void Step(const TipInput& tip, float dt_s) { Step(std::span(&tip, 1), dt_s); }

  /// Takes the edges that traction has torn since the start of the session, one bit per edge (3 * node + direction).
  /// Those that are still alive are severed in the next Step by removing cells. Bits without an edge are ignored.
  void Tear(std::span<const std::uint8_t> torn_edges);

  /// Events of the last Step.
  [[nodiscard]] std::span<const SolverEvent> events() const { return events_; }
  /// True when the last Step made a new topology revision.
  [[nodiscard]] bool committed() const { return committed_; }
  [[nodiscard]] bool stepped() const { return stepped_; }

  [[nodiscard]] const HeatField& field() const { return field_; }
  [[nodiscard]] HeatField* mutable_field() { return &field_; }
  /// Tissue beneath the sheet; nullptr unless the scene requests it.
  [[nodiscard]] const VolumeField* volume() const { return volume_.get(); }
  [[nodiscard]] const MeshTopology& topology() const { return topology_; }
  [[nodiscard]] const Ledger& ledger() const { return ledger_; }
  [[nodiscard]] const SolverFigures& figures() const { return figures_; }
  [[nodiscard]] const ProtectedStructures& protected_structures() const { return protected_; }
  [[nodiscard]] const SourceStats& source_stats() const { return source_.stats(); }
  /// Film of steam at the metal, and the metal's temperature.
  [[nodiscard]] const Interface& metal() const { return source_.interface(); }
  /// Length of the slit's centre line [m]; it follows the meter's value at most at kLengthRate_m_s.
  [[nodiscard]] float cut_length_m() const { return cut_length_m_; }
  /// Source window, writable: benchmarks vary its parameters.
  [[nodiscard]] SourceWindow* source() { return &source_; }

  /// Hash of sums over the warm state, cheap enough for each tick. Equal states give equal hashes; a difference in any
  /// cell changes a sum.
  [[nodiscard]] std::uint64_t TickHash() const;
  /// Hash of every stored value.
  [[nodiscard]] std::uint64_t FullHash() const;

  // Checkpoints (coupling/checkpoint_state.cc). They hold the committed topology only, so no change may be staged: the
  // case after a Step that ended on a commit frame, and between commits while nothing was cut.
  [[nodiscard]] bool at_commit_frame() const { return frame_ % kCommitFrames == 0; }
  [[nodiscard]] static std::size_t CheckpointCapacity(const SheetScene& scene);
  /// Returns the bytes used; 0 when `out` is too small or changes of the topology are staged.
  [[nodiscard]] std::size_t Save(std::span<std::byte> out) const;
  /// Returns false, and leaves a fresh state, if the bytes are not a checkpoint of this layout or hold values that the
  /// solver cannot have written.
  [[nodiscard]] bool Restore(std::span<const std::byte> bytes);

 private:
  struct Header;
  void AccurateFrame(std::span<const TipInput> tips, float dt_s);
  void PaperFrame(std::span<const TipInput> tips, float dt_s);
  /// Applies current and heat exchange with the metal from fraction `from` to fraction `to` of the samples' total
  /// duration.
  void ApplySource(std::span<const TipInput> tips, float dt_s, float from, float to);
  void AddLeakHeat(float duration_s);
  void UpdateVolume(float dt_s);
  void UpdateDamage(float dt_s);
  void StageTears();
  void UpdateTopology();
  void StageShrink();
  void AddPath(const TipPath& path, CauteryMode mode);
  void UpdateCutMeter(const RemovedBox& removed);
  void FollowLength(float dt_s);
  void UpdateProtected(float dt_s);
  void ReportEvents(const TipInput& tip);
  void Report(ThermalEventKind kind, const Vec2f& at, float theta, float value, float quiet_s);
  [[nodiscard]] bool Idle(std::span<const TipInput> tips) const;

  /// State that limits how often an event is reported.
  struct EventMemory {
    std::array<float, kThermalEventKinds>
        quiet_until_s{};  ///< Per kind: no report before this time of the solver's clock.
    float reported_cut_m = 0;
    std::uint64_t quarantined = 0;
    double vapour = 0;
    std::uint8_t energised = 0, blanched = 0, charred = 0, opened = 0;
  };

  ThermalParams params_;
  HeatField field_;
  MeshTopology topology_;
  DamageModel damage_;
  ProtectedStructures protected_;
  SourceWindow source_;
  std::unique_ptr<VolumeField> volume_;  ///< Null: the tissue beneath acts as a boundary condition only.
  std::unique_ptr<SheetContact> contact_;
  std::unique_ptr<PaperModel> paper_;  ///< Null in the accurate model.
  Crumbs crumbs_;
  RemovedBox removed_;        ///< Cells removed by heat since the last commit.
  RemovedBox torn_;           ///< Cells removed by traction since the last commit; they do not count in the cut length.
  std::vector<Index> tears_;  ///< Edges to be severed in the next Step.
  /// Pairs of torn edges of one triangle; a line of removed cells will join them.
  std::vector<std::pair<Index, Index>> crack_;
  CutMeter cut_meter_;
  Ledger ledger_;
  SolverFigures figures_;
  EventMemory memory_;
  TipInput last_tip_;  ///< Newest sample, at the place of the last contact: that of events.
  std::vector<SolverEvent> events_;
  std::vector<ProtectedAlarm> alarms_;
  std::uint64_t frame_ = 0;
  float clock_s_ = 0;
  float cut_length_m_ = 0;  ///< Published length [m].
  float protected_dt_s_ = 0;
  float silent_s_ = 0;  ///< Time since the last sample [s].
  bool committed_ = false, stepped_ = false;
};

}  // namespace fulcrum::thermal
