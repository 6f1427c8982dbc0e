// Electrocautery of one membrane, frame by frame: half the source, conduction, half the source, damage, topology. With
// the scene's `thermal.model: paper`: the paper's source, conduction and node rule instead.
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
/// Protected structures are looked at as often: their time constants are seconds.
inline constexpr int kProtectedFrames = 5;
/// Which of these frames looks at them: the frame that commits has enough to do.
inline constexpr int kProtectedFrame = 2;

/// The cut length grows no faster than this: where the hook slips through tissue that it was pulling, or two holes
/// meet, the slit itself grows by millimetres between two commits. A fifth above the fastest stroke [m/s].
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
  float power_W = 0;                               ///< Of the generator, mean over the time of the last samples.
  float set_power_W = 0;                           ///< Asked of it.
  float hook_C = 0;                                ///< Temperature of the metal.
  float debris_m2 = 0;                             ///< Crumbs that were taken out.
  float cut_width_p50_m = 0, cut_width_p95_m = 0;  ///< See CutMeter.
  float cut_off_way_m = 0;                         ///< Of the slit's centre line from the contact's way; see CutMeter.
  float voltage_V = 0;
  float burn_depth_m = 0;  ///< Deepest dead tissue below the sheet since the start; 0 without a volume.
  std::uint32_t warnings = 0, injuries = 0;
  std::uint32_t shortened = 0;  ///< Frames whose metal was longer than the potential's window holds; see kMetalReach.
  int substeps = 0, solves = 0, iterations = 0;
};

class ThermalSolver {
 public:
  /// Throws InputError when the scene has no usable membrane or parameters.
  explicit ThermalSolver(const SheetScene& scene);
  ThermalSolver(const ThermalSolver&) = delete;  // parts refer to each other
  ThermalSolver& operator=(const ThermalSolver&) = delete;

  /// Advances one frame with what the electrode did, sample by sample. Does nothing, in some ns, when there is no
  /// current, all is cold and nothing is staged.
  void Step(std::span<const TipInput> tips, float dt_s);
  void Step(const TipInput& tip, float dt_s) { Step(std::span(&tip, 1), dt_s); }

  /// Edges (3 * node + direction) that traction has torn since the start of the session, bit by bit: those that still
  /// live are severed in the next Step, and their cells with them. Bits that are no edge's are ignored.
  void Tear(std::span<const std::uint8_t> torn_edges);

  /// Events of the last Step.
  [[nodiscard]] std::span<const SolverEvent> events() const { return events_; }
  /// True when the last Step made a new topology revision.
  [[nodiscard]] bool committed() const { return committed_; }
  [[nodiscard]] bool stepped() const { return stepped_; }

  [[nodiscard]] const HeatField& field() const { return field_; }
  [[nodiscard]] HeatField* mutable_field() { return &field_; }
  /// The tissue beneath; nullptr when the scene leaves it out.
  [[nodiscard]] const VolumeField* volume() const { return volume_.get(); }
  [[nodiscard]] const MeshTopology& topology() const { return topology_; }
  [[nodiscard]] const Ledger& ledger() const { return ledger_; }
  [[nodiscard]] const SolverFigures& figures() const { return figures_; }
  [[nodiscard]] const ProtectedStructures& protected_structures() const { return protected_; }
  [[nodiscard]] const SourceStats& source_stats() const { return source_.stats(); }
  /// Of the slit's centre line; after a leap it grows by kLengthRate_m_s until it is the meter's.
  [[nodiscard]] float cut_length_m() const { return cut_length_m_; }
  /// Study knob of the benchmarks.
  [[nodiscard]] SourceWindow* source() { return &source_; }

  /// Hash of the warm state by its sums: cheap enough for each tick. Equal states give equal hashes; a difference in
  /// any cell changes a sum.
  [[nodiscard]] std::uint64_t TickHash() const;
  /// Hash of every stored value.
  [[nodiscard]] std::uint64_t FullHash() const;

  // Checkpoints (coupling/checkpoint_state.cc). They hold the committed topology only: nothing may be staged, which is
  // so after every Step that ended on a commit frame, and between commits while nothing was cut.
  [[nodiscard]] bool at_commit_frame() const { return frame_ % kCommitFrames == 0; }
  [[nodiscard]] static std::size_t CheckpointCapacity(const SheetScene& scene);
  /// Returns the bytes used; 0 when `out` is too small or changes of the topology are staged.
  [[nodiscard]] std::size_t Save(std::span<std::byte> out) const;
  /// False, and an untouched fresh state, when the bytes are not a checkpoint of this layout or hold values that the
  /// solver could not have written.
  [[nodiscard]] bool Restore(std::span<const std::byte> bytes);

 private:
  struct Header;
  void AccurateFrame(std::span<const TipInput> tips, float dt_s);
  void PaperFrame(std::span<const TipInput> tips, float dt_s);
  /// Current and touch from part `from` to part `to` of the samples' whole time.
  void ApplySource(std::span<const TipInput> tips, float dt_s, float from, float to);
  void AddLeakHeat(float duration_s);
  void UpdateVolume(float dt_s);
  void UpdateDamage(float dt_s);
  void QuarantineBadDamage(Tile* tile);
  void StageTears();
  void UpdateTopology();
  void StageShrink();
  void AddWay(const TipPath& path, CauteryMode mode);
  void UpdateCutMeter(const RemovedBox& removed);
  void FollowLength(float dt_s);
  void UpdateProtected(float dt_s);
  void ReportEvents(const TipInput& tip);
  void Report(ThermalEventKind kind, const Vec2f& at, float theta, float value, float quiet_s);
  [[nodiscard]] bool Idle(std::span<const TipInput> tips) const;

  /// What an event needs to be said once, or not too often.
  struct EventMemory {
    std::array<float, 10> quiet_until_s{};  ///< Per kind, on the solver's clock.
    float reported_cut_m = 0;
    std::uint64_t quarantined = 0;
    double vapour = 0;
    std::uint8_t energised = 0, blanched = 0, charred = 0, opened = 0;
  };

  ThermalParams params_;
  Material material_;
  HeatField field_;
  MeshTopology topology_;
  DamageModel damage_;
  ProtectedStructures protected_;
  SourceWindow source_;
  std::unique_ptr<VolumeField> volume_;  ///< Null: the tissue beneath is a boundary condition.
  std::unique_ptr<SheetContact> contact_;
  std::unique_ptr<PaperModel> paper_;  ///< Null in the accurate model.
  Crumbs crumbs_;
  RemovedBox removed_;                          ///< By heat, since the last commit.
  RemovedBox torn_;                             ///< By traction, likewise: no part of the cut's length.
  std::vector<Index> tears_;                    ///< Edges to be severed in the next Step.
  std::vector<std::pair<Index, Index>> crack_;  ///< Torn edges of one triangle: joined by then.
  CutMeter cut_meter_;
  Ledger ledger_;
  SolverFigures figures_;
  EventMemory memory_;
  TipInput last_tip_;  ///< The newest sample; events name its place.
  std::vector<SolverEvent> events_;
  std::vector<ProtectedAlarm> alarms_;
  std::uint64_t frame_ = 0;
  float clock_s_ = 0;
  float cut_length_m_ = 0;  ///< Published.
  float protected_dt_s_ = 0;
  bool committed_ = false, stepped_ = false;
};

}  // namespace fulcrum::thermal
