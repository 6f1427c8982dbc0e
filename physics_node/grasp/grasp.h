// Grasp of a grasper or a clip applier: particles fixed in the tool's frame, with slip above the grip force.
//
//   G       = grip_force max(0, 1 - jaw / open)                              grip force [N]
//   creep   = v_c h min(|T| / G - 1, kMaxExcess) T^ / hold_i  per step while |T| > G, in the tool's frame [m]
//   hold_i  = 1 - (1 - l) (d_i / R - f) / (1 - f), within [l, 1]
//
//   T    traction, low-passed [N]; T^ its direction       R        grasp_radius [m]
//   jaw  opening angle, open: grasp_open_rad [rad]        d_i      distance of particle i from the middle line [m]
//   v_c  kCreepSpeed [m/s], h: step [s]                   l, f     kLeastHold, kFirmShare
#pragma once

#include <span>
#include <vector>

#include "physics_node/collision/tool_shape.h"
#include "physics_node/tissue/particle_store.h"
#include "physics_node/tissue/tissue_model.h"

namespace fulcrum::physics {

struct HeldParticle {
  Index particle = 0;
  Vec3f p_T = Vec3f::Zero();  ///< In the tool's frame [m].
};

class Grasp {
 public:
  enum class State : std::uint32_t { kOpen, kHolding, kClosedEmpty };

  explicit Grasp(const TissueScene& scene) : scene_(scene) {}

  /// Begins a grasp when the jaws close below grasp_close_rad and ends it when they open beyond grasp_open_rad. Held
  /// are all particles within a jaw's thickness of the surface that the jaws span, in both layers and all sheets of a
  /// fold, and of a grasper the membrane within grasp_radius of their middle line; if there are none, the organ within
  /// grasp_radius.
  void Update(const ToolDescription& tool, const ToolPose& pose, const TissueModel& model, ParticleStore* particles);
  /// Living tissue nearer than `reach` to the surface that the jaws span [m], also where a tool holds it.
  [[nodiscard]] static std::vector<Index> InJaws(const ToolDescription& tool, const ToolPose& pose, float reach,
                                                 const TissueModel& model, const ParticleStore& particles);
  /// Ends of the living edges of bodies' surfaces that pass through the surface between the jaws, or nearer than
  /// `reach` to it [m]: what lies between the jaws of a body whose vertices are farther apart than the jaws are thick.
  [[nodiscard]] static std::vector<Index> AcrossJaws(const ToolDescription& tool, const ToolPose& pose, float reach,
                                                     std::span<const Triangle> surface, const TissueModel& model,
                                                     const ParticleStore& particles);
  /// Moves the held particles with the tool.
  void Move(const ToolPose& pose, ParticleStore* particles) const;
  /// Largest traction without slip at an opening angle [N]: grip_force_N when closed, falling linearly to 0 at
  /// grasp_open_rad.
  [[nodiscard]] static float GripForce(const PhysicsParams& params, float jaw_rad);
  /// Share of the grip that acts on a held particle: 1 between the jaws, less towards grasp_radius.
  [[nodiscard]] float HoldOf(const HeldParticle& held, const ToolDescription& tool) const;
  /// Once a step, of length step_s: above GripForce the tissue creeps out of the jaws along the traction, the force of
  /// the tissue on the tool [N, frame W]. The solver reports it as the sum of the forces on the held particles;
  /// otherwise it is estimated from the edges. Particles that leave the jaws are released.
  void Slip(const Vec3f& traction_W, float step_s, const ToolDescription& tool, const ToolPose& pose,
            const TissueModel& model, ParticleStore* particles);
  /// Releases particles that have been cut off.
  void DropDead(const TissueModel& model, ParticleStore* particles);
  void Release(const TissueModel& model, ParticleStore* particles);

  [[nodiscard]] State state() const { return state_; }
  [[nodiscard]] bool holding() const { return state_ == State::kHolding; }
  [[nodiscard]] const std::vector<HeldParticle>& held() const { return held_; }
  /// From a checkpoint.
  void Restore(State state, std::vector<HeldParticle> held, ParticleStore* particles);

 private:
  void TakeHold(const ToolDescription& tool, const ToolPose& pose, ParticleStore* particles);
  template <class Predicate>
  void DropIf(const TissueModel& model, ParticleStore* particles, const Predicate& released);

  TissueScene scene_;
  State state_ = State::kOpen;
  std::vector<HeldParticle> held_;
  Vec3f traction_ = Vec3f::Zero();  ///< Low-passed, frame W [N].
};

}  // namespace fulcrum::physics
