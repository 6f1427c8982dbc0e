// Simulation of the whole tissue: solver, contacts, grasps, cuts, tears, sleep. No clock and no bus: equal inputs give
// equal bits.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "physics_node/clips/clips.h"
#include "physics_node/collision/sheet_collision.h"
#include "physics_node/collision/tissue_collision.h"
#include "physics_node/collision/tool_collision.h"
#include "physics_node/contact_model/cautery_probe.h"
#include "physics_node/contact_model/contact_probe.h"
#include "physics_node/contact_model/solid_probe.h"
#include "physics_node/grasp/grasp.h"
#include "physics_node/implicit/implicit_solver.h"
#include "physics_node/pbd/pbd_solver.h"
#include "physics_node/pbd/printed_solver.h"
#include "physics_node/tear/tear_watch.h"
#include "physics_node/xpbd/xpbd_solver.h"

namespace fulcrum::physics {

struct ToolInput {
  bool present = false;
  ToolPose pose;
};

/// Where the time of a step of mode accurate went [ns]; 0 in the other modes.
struct StageTimes {
  std::int64_t contacts_ns = 0;  ///< Search and rows.
  std::int64_t prediction_ns = 0, linearisation_ns = 0, solve_ns = 0, update_ns = 0;
};

struct StepReport {
  bool asleep = false;       ///< The tissue slept: nothing moved, nothing was solved.
  float max_step_m = 0;      ///< Largest movement of a particle in this step.
  std::uint32_t resets = 0;  ///< Particles or coordinates restored in this step.
  StageTimes stages;
};

/// State for a restarted node, without positions.
struct SimulationMemory {
  std::uint64_t periods = 0;       ///< Simulated since the start.
  std::uint32_t last_periods = 1;  ///< Of the last step.
  std::array<ToolPose, kMaxTools> pose;
  std::array<bool, kMaxTools> known{};
  std::array<Grasp::State, kMaxTools> grasp_state{};
  std::array<std::vector<HeldParticle>, kMaxTools> held;
  std::vector<std::uint8_t> torn_edges;  ///< Bits as in TearState; empty: none.
  ClipMemory clips;
};

class TissueSimulation {
 public:
  /// Largest speed of a tool behind its input [m/s], [rad/s]: after a gap in the input it must not jump through tissue.
  static constexpr float kMaxToolSpeed = 1.0f;
  static constexpr float kMaxToolTurn = 6.0f;
  /// Longest step: after more skipped periods simulated time falls behind session time.
  static constexpr std::uint32_t kMostStepPeriods = 3;

  /// `threads` for a step of mode accurate; the state does not depend on their number.
  explicit TissueSimulation(const TissueScene& scene, int threads = 1, InstructionSet set = BestInstructionSet());

  TissueSimulation(const TissueSimulation&) = delete;
  TissueSimulation& operator=(const TissueSimulation&) = delete;

  /// Advances by `periods` of PhysicsParams.dt_s in one step, at most by kMostStepPeriods; in mode paper always by one.
  /// A tool that is not present exerts no force and releases its grasp.
  StepReport Step(const std::array<ToolInput, kMaxTools>& tools, std::uint64_t periods = 1);
  /// Removed cells around the hook. False: they belong to another scene and are refused.
  bool SetOpenCells(const OpenCells& cells);
  /// Cut and shrunk edges; see TissueModel::Apply. A change wakes the tissue.
  int ApplyTopology(const TopologyState& topology);

  /// Enables the threads beside the caller's for the next steps.
  void LetThreadsHelp(bool help);

  /// Sets the preset `presets` below that of the scene (mode accurate), at most down to fast; returns the difference.
  std::uint32_t SetCheaper(std::uint32_t presets);

  /// After a Step: contacts of a tool, and contact of a hook's metal. Their filters require a call after each step.
  [[nodiscard]] DeviceContacts Contacts(std::uint32_t tool);
  [[nodiscard]] CauteryContact Cautery(std::uint32_t tool);

  [[nodiscard]] ParticleStore& particles() { return particles_; }
  [[nodiscard]] const ParticleStore& particles() const { return particles_; }
  [[nodiscard]] const TissueModel& model() const { return model_; }
  [[nodiscard]] const ToolCollision& collision() const { return collision_; }
  [[nodiscard]] const SheetCollision& sheet_collision() const { return sheet_collision_; }
  /// Other contacts of sheets than those of a session, for comparisons; mode accurate.
  void TakeSheetPairs(SheetPairs pairs) { sheet_collision_.Take(pairs); }
  /// Contacts of the last substep with their forces; none in mode paper. Asleep: those of tools near the tissue,
  /// without forces.
  [[nodiscard]] std::span<const ContactRow> rows() const { return rows_; }
  [[nodiscard]] const Grasp& grasp(std::uint32_t tool) const { return grasps_[tool]; }
  /// That clip appliers have left on the tissue.
  [[nodiscard]] const Clips& clips() const { return clips_; }
  /// Of all tools.
  [[nodiscard]] std::uint32_t held_particles() const {
    std::size_t count = 0;
    for (const Grasp& grasp : grasps_) count += grasp.held().size();
    return static_cast<std::uint32_t>(count);
  }
  /// Force of the tissue on a tool as in the last Contacts [N].
  [[nodiscard]] Vec3f force(std::uint32_t tool) const { return contacts_.force(tool); }
  /// In mode accurate: force of the tissue on a tool in the last step, not filtered over steps [N].
  [[nodiscard]] Vec3f solver_force(std::uint32_t tool) const { return tool_force_[tool].force; }
  /// Tears by traction. Torn edges transmit forces until ApplyTopology severs them.
  [[nodiscard]] const TearWatch& tears() const { return tears_; }
  [[nodiscard]] bool asleep() const { return sleep_.asleep; }
  /// Share of the tissue that is awake.
  [[nodiscard]] float awake_part() const;
  [[nodiscard]] std::uint64_t quarantined() const { return counters_.quarantined; }
  /// Sum of the lengths of all steps [s]: the time of breathing.
  [[nodiscard]] double simulated_time_s() const {
    return static_cast<double>(counters_.periods) * static_cast<double>(scene_.physics.dt_s);
  }
  /// Periods in the last step.
  [[nodiscard]] std::uint32_t step_periods() const { return step_periods_; }
  /// Length of the last step [s].
  [[nodiscard]] float step_s() const { return static_cast<float>(step_periods_) * scene_.physics.dt_s; }
  /// Counter that changes whenever positions may have changed.
  [[nodiscard]] std::uint64_t state_version() const { return counters_.state_version; }

  /// Largest distance of a particle of live, connected tissue from rest [m].
  [[nodiscard]] float MaxDisplacement() const;
  /// Hash of particles, topology revision, tears and clips: equal for equal runs.
  [[nodiscard]] std::uint64_t StateHash() const;

  [[nodiscard]] SimulationMemory Save() const;
  /// Continues from a checkpoint: positions in scene order, x y z interleaved. False, with the state unchanged, if it
  /// does not fit the scene or is out of bounds.
  bool Restore(std::span<const float> xyz, std::span<const float> previous_xyz, const SimulationMemory& memory);
  /// After Restore: in mode accurate, bodies that were at rest are not computed until something moves them.
  void LetStillBodiesSleep() {
    if (implicit_) implicit_->SleepStill();
  }

 private:
  template <class Body>
  void InParts(const Body& body) const;

  /// Compliance from the implicit solver for ContactProbe: one query per tool every kQueryEvery steps, which bounds the
  /// cost to a tenth of a step.
  class ImplicitCompliance final : public ComplianceSolver {
   public:
    static constexpr std::uint64_t kQueryEvery = 8;
    explicit ImplicitCompliance(TissueSimulation* simulation) : simulation_(simulation) {}
    bool Stiffness(const Probe& probe, float horizon_s, float* newton_per_m) override;

   private:
    TissueSimulation* simulation_;
    std::vector<ParticleRef> at_;
  };

  struct ToolTrack {
    bool present = false;
    ToolPose last, now;
    [[nodiscard]] bool moved() const;
  };

  void FollowTools(const std::array<ToolInput, kMaxTools>& tools);
  [[nodiscard]] bool ToolsMove() const;
  [[nodiscard]] bool ToolsTouchTissue();
  [[nodiscard]] bool StaysAsleep();
  [[nodiscard]] bool BreathingReachesTissue();
  void UpdateSleep(const StepReport& report, bool holds);
  [[nodiscard]] StepReport StepPaper();
  /// `last_periods`: length of the step before.
  [[nodiscard]] StepReport StepXpbd(std::uint32_t last_periods);
  [[nodiscard]] int SubstepsForTools() const;
  [[nodiscard]] StepReport StepAccurate();
  void PlaceHeld(float u);
  void FindAllContacts(float h);
  void UpdateGrasps();
  void ApplyClip(std::size_t tool);
  void WatchTears(float max_step_m);
  [[nodiscard]] double step_begin_s() const { return simulated_time_s() - static_cast<double>(step_s()); }
  void FindTissueContacts();
  void FindContacts(bool tissue_moved, float tissue_step = 0);

  TissueScene scene_;
  ParticleStore particles_;
  TissueModel model_;
  PbdSolver solver_;
  std::optional<PrintedSolver> printed_;              ///< In mode paper as printed.
  std::optional<implicit::ImplicitSolver> implicit_;  ///< In mode accurate.
  std::optional<xpbd::XpbdSolver> xpbd_;              ///< In mode xpbd.
  implicit::Effort effort_;
  std::vector<implicit::HeldPlace> held_places_;
  std::vector<ContactRow> rows_;
  std::vector<float> moved_;                     ///< By block of particles: movement in the last step [m].
  std::array<ToolForce, kMaxTools> tool_force_;  ///< Means over the last period of a step, in mode accurate.
  float largest_speed_ = 0;                      ///< Of the tissue in the last step; not in mode paper [m/s].
  ToolCollision collision_;
  TissueCollision tissue_collision_;
  SheetCollision sheet_collision_;
  std::array<Grasp, kMaxTools> grasps_;
  Clips clips_;
  ContactProbe contacts_;
  ImplicitCompliance implicit_compliance_{this};
  CauteryProbe cautery_;
  std::optional<SolidProbe> solid_probe_;  ///< Of scenes whose solids are burnt.
  TearWatch tears_;
  std::array<ToolTrack, kMaxTools> tracks_;
  struct Sleep {
    bool asleep = false;
    int still_steps = 0;  ///< In a row.
  };
  Sleep sleep_;
  std::array<std::uint64_t, kMaxTools> contacts_step_{};  ///< Step of the last Contacts of a tool.
  struct Counters {
    std::uint64_t steps = 0, periods = 0, quarantined = 0, state_version = 1;
  };
  Counters counters_;
  std::uint32_t step_periods_ = 1;  ///< Length of the last step.
};

}  // namespace fulcrum::physics
