// The physics node on ports: inputs in, one step of the tissue, outputs out. The same class runs live, in a test and
// in a replay.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>

#include "physics_node/node/contact_rest.h"
#include "physics_node/node/input_history.h"
#include "physics_node/simulation/tissue_simulation.h"
#include "services/base/core/messages.h"
#include "services/base/core/pace.h"
#include "services/base/core/scene_view.h"
#include "services/base/core/tick.h"
#include "services/base/runtime/checkpoint.h"
#include "services/transport/bus/input_account.h"
#include "services/transport/bus/port.h"

namespace fulcrum::physics {

class PhysicsNode {
 public:
  struct Ports {
    bus::Input<ToolState>& tools;
    bus::Input<HandleState>& handles;
    bus::Input<TopologyState>& topology;
    bus::Input<OpenCells>& open_cells;
    bus::LoanOutput<TissueFrame>& frames;
    bus::Output<ContactModel>& contacts;
    bus::Output<CauteryContact>& cautery;
    bus::Output<TearState>& tears;
    bus::Output<TickManifest>& manifests;
    bus::Output<ClipState>& clips;
  };

  /// Scene, ports and checkpoint must outlive the node. Continues from the checkpoint if it has a state.
  /// @param checkpoint null: no state is kept.
  /// @param epoch_ns CLOCK_MONOTONIC at the start of the process [ns].
  /// @param threads for a step; the state does not depend on their number.
  /// @param follows begins with Follow(), and reads the checkpoint only in TakeOver().
  PhysicsNode(const SceneView& scene, const Ports& ports, runtime::CheckpointFile* checkpoint, std::int64_t epoch_ns,
              int threads = 1, bool follows = false);

  /// One period. @pre called by one thread.
  void Step(const Tick& tick);

  /// Enables the threads beside the caller's for the next steps; they are enabled at the start.
  void LetThreadsHelp(bool help) { simulation_.LetThreadsHelp(help); }

  /// Inputs that are written on a change only: the ports do not deliver them again to a node that replaces this one.
  struct Kept {
    TopologyState topology;
    OpenCells open_cells;
  };
  [[nodiscard]] Kept KeptInputs() const { return {topology_state_, open_cells_}; }
  /// Before the first tick: those of the node that this one replaces, applied in the first Step().
  void TakeKept(const Kept& kept);

  /// In place of Step() while another process leads: stores the newest inputs and publishes nothing.
  void Follow(const Tick& tick);
  /// From this tick on this process leads and continues from the newer one of the other's checkpoint, which can be
  /// empty, and its own. False: there is none. Before the Step() of the tick, whose time is the epoch of its samples.
  bool TakeOver(std::span<const std::byte> other, const Tick& tick);

  /// Metrics and last error. Any thread.
  void FillHealth(Health* health) const;

  /// Content of a TissueFrame after the last Step: header without stamp, and positions.
  void FillFrame(const Tick& tick, TissueFrame::View view) const;

  [[nodiscard]] const TissueSimulation& simulation() const { return simulation_; }
  /// The node continues from a checkpoint.
  [[nodiscard]] bool restored() const { return restart_.restored; }

 private:
  bool Restore(std::span<const std::byte> checkpoint);
  void TakeInputs(const Tick& tick);
  void TakeTools(std::int64_t now_ns);
  void TakeHandles(std::int64_t now_ns);
  void CatchUp(const std::array<ToolInput, kMaxTools>& last);
  void AdaptPreset(const Tick& tick);
  void MeasurePace();
  void PublishFrame(const Tick& tick);
  void PublishContacts(const Tick& tick, bool asleep);
  void NoteForce(std::size_t tool, double force_N);
  void PublishCautery(const Tick& tick);
  void PublishManifest(const Tick& tick);
  void PublishTears(const Tick& tick);
  void PublishClips(const Tick& tick);
  void SaveCheckpoint();
  void Measure();

  SceneView scene_;
  Ports ports_;
  runtime::CheckpointFile* checkpoint_;
  TissueSimulation simulation_;
  std::uint32_t hook_ = kMaxTools;  ///< The tool that cuts; kMaxTools: none.

  struct Stampers {
    explicit Stampers(std::int64_t epoch_ns)
        : frame(epoch_ns), contact(epoch_ns), cautery(epoch_ns), tear(epoch_ns), manifest(epoch_ns), clip(epoch_ns) {}
    bus::Stamper frame, contact, cautery, tear, manifest, clip;
  };
  Stampers stampers_;

  InputHistory<ToolState> tool_states_;
  InputHistory<HandleState> handle_states_;
  /// Samples that the last step used.
  struct UsedSamples {
    Stamp tool_before, tool_after, handle;
    std::int64_t pose_ns = 0;  ///< Time of the tools' poses.
  };
  UsedSamples used_;
  ContactRest contact_rest_;
  /// Of the last step.
  struct StepTime {
    double k = 0;
    double step_s = 0;     ///< Session time k dt.
    double contact_s = 0;  ///< Session time of the tools' poses; less than step_s during catch-up.
  };
  StepTime time_;
  TopologyState topology_state_;
  OpenCells open_cells_;
  std::array<ToolInput, kMaxTools> inputs_;
  std::array<int, kMaxTools> absent_ticks_{};
  bool topology_waits_ = false;   ///< A topology arrived while another process led, or was taken over.
  bool open_cells_wait_ = false;  ///< Likewise.
  struct Ticks {
    std::uint64_t count = 0;
    std::int64_t start_ns = 0;  ///< Of the first step.
    std::uint64_t last_index = 0;
    std::uint64_t periods = 1;      ///< Since the last step.
    std::uint64_t first_index = 0;  ///< Manifests count from the tick in which this process took over.
    int in_time = 0;                ///< Since the last skipped period.
  };
  Ticks ticks_;
  /// TissueSimulation::state_version() at the last frame, hash, checkpoint and measurement.
  struct Versions {
    std::uint64_t frame = 0, hash = 0, saved = 0, measured = 0;
  };
  Versions versions_;
  /// Of frames at rest.
  struct FrameTime {
    double silence_s = 0;         ///< Announced in the last one.
    std::uint64_t due_index = 0;  ///< Tick of the next one.
  };
  FrameTime frame_;
  std::uint64_t state_hash_ = 0;
  struct Restart {
    bool restored = false;
    bool waits = false;      ///< Until ToolState and HandleState arrive: the tools do not move.
    int catch_up_steps = 0;  ///< Until the tools reach the poses of their samples.
  };
  Restart restart_;
  float max_displacement_m_ = 0;
  TickManifest manifest_;
  TearState tear_state_;
  /// Number of torn edges in the last TearState and checkpoint.
  struct TearCounts {
    std::uint32_t published = 0, saved = 0;
  };
  TearCounts tear_counts_;
  /// Clips::revision() in the last ClipState and checkpoint; 0: none.
  struct ClipRevisions {
    std::uint64_t published = 0, saved = 0;
  };
  ClipRevisions clip_revisions_;
  std::array<std::uint64_t, kMaxTools> limited_until_{};  ///< Tick until which Health warns of a limited force.

  /// For the health thread. Relaxed order: the figures are independent of each other.
  struct Figures {
    std::atomic<std::uint32_t> cheaper{0};  ///< Presets below the scene's.
    std::atomic<float> displacement_mm{0}, max_displacement_mm{0};
    std::atomic<double> force_N[kMaxTools]{}, peak_force_N{0};  ///< Of the tissue on the tools.
    std::atomic<std::uint32_t> grasped{0};
    std::atomic<std::uint64_t> quarantined{0}, asleep_ticks{0}, topology_refused{0}, topology_edits{0};
    std::atomic<std::uint32_t> torn_edges{0};
    std::atomic<std::uint32_t> clips{0}, clips_lost{0}, clips_refused{0};
    std::atomic<std::uint32_t> limited{0};  ///< Bit per tool: the force on it was limited.
    std::atomic<TearWatch::Nearest> nearest_to_tearing{};
    static_assert(decltype(nearest_to_tearing)::is_always_lock_free);
    std::atomic<float> largest_stretch{0};
    std::atomic<float> pace{1};                  ///< Simulated over passed time.
    std::atomic<std::uint64_t> lost_periods{0};  ///< That passed and were not simulated.
  };
  Figures figures_;
  Pace pace_;
};

}  // namespace fulcrum::physics
