// The physics node on ports: inputs in, one step of the tissue, outputs out. The same class runs live, in a test and
// in a replay.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>

#include "physics_node/node/input_history.h"
#include "physics_node/simulation/tissue_simulation.h"
#include "services/base/core/messages.h"
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
  [[nodiscard]] bool restored() const { return restored_; }

 private:
  bool Restore(std::span<const std::byte> checkpoint);
  void TakeInputs(const Tick& tick);
  void TakeTools(std::int64_t now_ns);
  void TakeHandles(std::int64_t now_ns);
  void CatchUp(const std::array<ToolInput, kMaxTools>& last);
  void AdaptPreset(const Tick& tick);
  void PublishFrame(const Tick& tick);
  void PublishContacts(const Tick& tick);
  void PublishCautery(const Tick& tick);
  void PublishManifest(const Tick& tick);
  void PublishTears(const Tick& tick);
  void SaveCheckpoint();
  void Measure();

  SceneView scene_;
  Ports ports_;
  runtime::CheckpointFile* checkpoint_;
  TissueSimulation simulation_;
  bus::Stamper frame_stamper_, contact_stamper_, cautery_stamper_, tear_stamper_, manifest_stamper_;
  std::uint32_t hook_ = kMaxTools;  ///< The tool that cuts; kMaxTools: none.

  InputHistory<ToolState> tool_states_;
  InputHistory<HandleState> handle_states_;
  Stamp tool_before_, tool_after_, handle_stamp_;  ///< Samples that the last step used.
  std::int64_t pose_ns_ = 0;                       ///< Time of the tools' poses in the last step.
  double step_time_s_ = 0;                         ///< Session time k dt of the last step.
  double step_ = 0;                                ///< Its k.
  TopologyState topology_state_;
  OpenCells open_cells_;
  std::array<ToolInput, kMaxTools> inputs_;
  std::array<int, kMaxTools> absent_ticks_{};
  bool topology_waits_ = false;  ///< A topology arrived while another process led.
  std::uint64_t ticks_ = 0;
  std::int64_t start_ns_ = 0;  ///< Of the first step.
  std::uint64_t last_index_ = 0;
  std::uint64_t periods_ = 1;      ///< Since the last step.
  std::uint64_t first_index_ = 0;  ///< Manifests count from the tick in which this process took over.
  int ticks_in_time_ = 0;          ///< Since the last skipped period.
  std::uint64_t frame_version_ = 0, hash_version_ = 0, saved_version_ = 0, measured_version_ = 0;
  std::uint64_t state_hash_ = 0;
  bool restored_ = false;
  bool waits_ = false;         ///< After a restart, until ToolState and HandleState arrive: the tools do not move.
  int catch_up_steps_ = 0;     ///< After a restart: steps until the tools reach the poses of their samples.
  double contact_time_s_ = 0;  ///< Session time of the tools' poses; less than step_time_s_ during catch-up.
  float max_displacement_m_ = 0;
  TickManifest manifest_;
  TearState tear_state_;
  std::uint32_t published_tears_ = 0, saved_tears_ = 0;   ///< Number of torn edges then.
  std::array<std::uint64_t, kMaxTools> limited_until_{};  ///< Tick until which Health warns of a limited force.

  // For the health thread. Relaxed order: the figures are independent of each other.
  std::atomic<std::uint32_t> cheaper_{0};  ///< Presets below the scene's.
  std::atomic<float> displacement_mm_{0}, max_displacement_mm_{0}, force_N_[kMaxTools]{};
  std::atomic<std::uint32_t> grasped_{0};
  std::atomic<std::uint64_t> quarantined_{0}, asleep_ticks_{0}, topology_refused_{0}, topology_edits_{0};
  std::atomic<std::uint32_t> torn_edges_{0};
  std::atomic<std::uint32_t> limited_{0};  ///< Bit per tool: the force on it was limited.
  std::atomic<float> stretch_{0}, largest_stretch_{0};
};

}  // namespace fulcrum::physics
