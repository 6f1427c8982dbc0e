// A grasper's hold on tissue: particles fixed in the tool's frame, with slip.
#pragma once

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

  explicit Grasp(const SceneView& scene) : scene_(scene) {}

  /// Follows the jaw: takes hold when it closes past grasp_close_rad, lets go past grasp_open_rad. Held is what lies
  /// between the jaws: whatever is within a jaw's thickness of the surface that they span, all sheets of a fold and
  /// both layers, and the membrane within grasp_radius of their middle line; with nothing there, organ within
  /// grasp_radius.
  void Update(const ToolDescription& tool, const ToolPose& pose, const TissueModel& model, ParticleStore* particles);
  /// Puts what is held where the tool has taken it.
  void Move(const ToolPose& pose, ParticleStore* particles) const;
  /// Largest traction that jaws so far open hold [N]: grip_force_N when closed, none from grasp_open_rad on, linear.
  [[nodiscard]] static float GripForce(const PhysicsParams& params, float jaw_rad);
  /// Part of the grip that a held particle has: 1 between the jaws, less towards grasp_radius.
  [[nodiscard]] float HoldOf(const HeldParticle& held, const ToolDescription& tool) const;
  /// Above GripForce the tissue creeps out of the jaws along the traction [N, frame W], which is what the tissue pulls
  /// at the tool with: measured by the solver as the sum of forces on what is held, or estimated from edges. The less
  /// hold the faster; what leaves the jaws is lost. Once a step.
  void Slip(const Vec3f& traction_W, const ToolDescription& tool, const ToolPose& pose, const TissueModel& model,
            ParticleStore* particles);
  /// Drops what has been cut away meanwhile.
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
  void DropIf(const TissueModel& model, ParticleStore* particles, const Predicate& gone);

  SceneView scene_;
  State state_ = State::kOpen;
  std::vector<HeldParticle> held_;
  Vec3f traction_ = Vec3f::Zero();  ///< Low-passed, frame W [N].
};

}  // namespace fulcrum::physics
