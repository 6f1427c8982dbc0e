// The whole tissue: solver, tool collision, grasps, cutting, rest. Numbers in, numbers out; no clock, no bus.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "physics_node/collision/tissue_collision.h"
#include "physics_node/collision/tool_collision.h"
#include "physics_node/contact_model/cautery_probe.h"
#include "physics_node/contact_model/contact_probe.h"
#include "physics_node/grasp/grasp.h"
#include "physics_node/implicit/implicit_solver.h"
#include "physics_node/pbd/pbd_solver.h"
#include "physics_node/tear/tear_watch.h"
#include "physics_node/xpbd/xpbd_solver.h"

namespace fulcrum::physics {

struct ToolInput {
  bool present = false;
  ToolPose pose;
};

struct StepReport {
  bool asleep = false;       ///< Nothing moved and nothing was computed.
  float max_step_m = 0;      ///< Largest movement of a particle in this step.
  std::uint32_t resets = 0;  ///< Particles put back in this step.
};

/// What a restarted node needs to go on; positions apart.
struct SimulationMemory {
  std::uint64_t steps = 0;  ///< Made so far.
  std::array<ToolPose, kMaxTools> pose;
  std::array<bool, kMaxTools> known{};
  std::array<Grasp::State, kMaxTools> grasp_state{};
  std::array<std::vector<HeldParticle>, kMaxTools> held;
  std::vector<std::uint8_t> torn_edges;  ///< Bits as in TearState; empty: none.
};

class TissueSimulation {
 public:
  /// Tools follow their input at most this fast: after a gap in the input they come after it instead of jumping
  /// through the tissue [m/s], [rad/s].
  static constexpr float kMaxToolSpeed = 1.0f;
  static constexpr float kMaxToolTurn = 6.0f;

  /// `threads` share a step of mode accurate; the state does not depend on it.
  explicit TissueSimulation(const SceneView& scene, int threads = 1, InstructionSet set = BestInstructionSet());

  TissueSimulation(const TissueSimulation&) = delete;
  TissueSimulation& operator=(const TissueSimulation&) = delete;

  /// Advances by PhysicsParams.dt_s. A tool that is not present leaves the tissue where it is and lets go.
  StepReport Step(const std::array<ToolInput, kMaxTools>& tools);
  /// Which cells around the hook are gone. Cells of another scene are refused: false.
  bool SetOpenCells(const OpenCells& cells);
  /// Cut and shrunk edges; see TissueModel::Apply. Wakes the tissue when something changed.
  int ApplyTopology(const TopologyState& topology);

  /// Whether the threads beside the caller's help in the next steps.
  void LetThreadsHelp(bool help);

  /// Goes on with the preset that many below the scene's (mode accurate; at most down to fast); returns how many it is.
  std::uint32_t SetCheaper(std::uint32_t presets);

  /// After a Step: what a tool feels, and where a hook touches. What is asked of each step is smooth over the steps.
  [[nodiscard]] DeviceContacts Contacts(std::uint32_t tool);
  [[nodiscard]] CauteryContact Cautery(std::uint32_t tool);

  [[nodiscard]] ParticleStore& particles() { return particles_; }
  [[nodiscard]] const ParticleStore& particles() const { return particles_; }
  [[nodiscard]] const TissueModel& model() const { return model_; }
  [[nodiscard]] const ToolCollision& collision() const { return collision_; }
  /// Contacts of the last substep, forces in them; none in mode paper. Asleep: those of tools near by, without forces.
  [[nodiscard]] std::span<const ContactRow> rows() const { return rows_; }
  [[nodiscard]] const Grasp& grasp(std::uint32_t tool) const { return grasps_[tool]; }
  /// Of the tissue on a tool, as Contacts has told it [N].
  [[nodiscard]] Vec3f force(std::uint32_t tool) const { return contacts_.force(tool); }
  /// In mode accurate, of the last step alone [N].
  [[nodiscard]] Vec3f solver_force(std::uint32_t tool) const { return tool_force_[tool]; }
  /// What traction has torn. Torn edges hold until ApplyTopology says that they are severed.
  [[nodiscard]] const TearWatch& tears() const { return tears_; }
  [[nodiscard]] bool asleep() const { return asleep_; }
  /// Part of the tissue that is awake.
  [[nodiscard]] float awake_part() const;
  [[nodiscard]] std::uint64_t quarantined() const { return quarantined_; }
  /// Steps made times their length [s]: what breathes follows it.
  [[nodiscard]] double simulated_time_s() const {
    return static_cast<double>(steps_) * static_cast<double>(scene_.physics.dt_s);
  }
  /// Changes whenever positions may have changed.
  [[nodiscard]] std::uint64_t state_version() const { return state_version_; }

  /// Largest distance of a particle of live, connected tissue from rest [m].
  [[nodiscard]] float MaxDisplacement() const;
  /// Of positions and held particles: equal for equal runs.
  [[nodiscard]] std::uint64_t StateHash() const;

  [[nodiscard]] SimulationMemory Save() const;
  /// Continues from a checkpoint: positions in scene order, x y z interleaved. False, and nothing changed, when it does
  /// not fit the scene or is not finite.
  bool Restore(std::span<const float> xyz, std::span<const float> previous_xyz, const SimulationMemory& memory);

 private:
  template <class Body>
  void InParts(const Body& body) const;

  /// The accurate solver's answers to ContactProbe's questions: one a tool every kAskEvery steps, so that asking costs
  /// a tenth of a step at most.
  class Answers final : public ComplianceSolver {
   public:
    static constexpr std::uint64_t kAskEvery = 8;
    explicit Answers(TissueSimulation* simulation) : simulation_(simulation) {}
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
  [[nodiscard]] bool ToolsStir();
  [[nodiscard]] bool MayRest();
  [[nodiscard]] bool BreathStirs();
  void MayFallAsleep(const StepReport& report, bool holds);
  [[nodiscard]] StepReport StepPaper();
  [[nodiscard]] StepReport StepXpbd();
  [[nodiscard]] int SubstepsForTools() const;
  [[nodiscard]] StepReport StepAccurate();
  void PlaceHeld(float u);
  void FindAllContacts(float h);
  void UpdateGrasps();
  void WatchTears(float max_step_m);
  [[nodiscard]] double step_begin_s() const { return simulated_time_s() - static_cast<double>(scene_.physics.dt_s); }
  void FindTissueContacts();
  void FindContacts(bool tissue_moved, float tissue_step = 0);

  SceneView scene_;
  ParticleStore particles_;
  TissueModel model_;
  PbdSolver solver_;
  std::optional<implicit::ImplicitSolver> implicit_;  ///< In mode accurate.
  std::optional<xpbd::XpbdSolver> xpbd_;              ///< In mode xpbd.
  implicit::Effort effort_;
  int most_substeps_ = 1;  ///< While a tool that presses moves.
  std::vector<implicit::HeldPlace> held_places_;
  std::vector<ContactRow> rows_;
  std::vector<float> moved_;  ///< Of each block of particles in the last step [m].
  std::array<Vec3f, kMaxTools> tool_force_{Vec3f::Zero(), Vec3f::Zero()};  ///< Of the tissue on a tool, mean over the
                                                                           ///< last step; mode accurate [N].
  float largest_speed_ = 0;  ///< Of the tissue after the last step, paper's mode apart [m/s].
  ToolCollision collision_;
  TissueCollision tissue_collision_;
  std::array<Grasp, kMaxTools> grasps_;
  ContactProbe contacts_;
  Answers answers_{this};
  CauteryProbe cautery_;
  TearWatch tears_;
  std::array<ToolTrack, kMaxTools> tracks_;
  bool asleep_ = false;
  int still_steps_ = 0;
  std::uint64_t steps_ = 0;
  std::array<std::uint64_t, kMaxTools> contacts_step_{};  ///< In which a tool's contacts were last asked for.
  std::uint64_t quarantined_ = 0, state_version_ = 1;
};

}  // namespace fulcrum::physics
