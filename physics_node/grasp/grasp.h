// A grasper's hold on tissue: particles fixed in the tool's frame, with slip.
#pragma once

#include <vector>

#include "physics_node/collision/tool_shape.h"
#include "physics_node/pbd/particle_store.h"
#include "physics_node/pbd/tissue_model.h"

namespace fulcrum::physics {

struct HeldParticle {
  Index particle = 0;
  Vec3f p_T = Vec3f::Zero();  ///< In the tool's frame [m].
};

class Grasp {
 public:
  enum class State : std::uint32_t { kOpen, kHolding, kClosedEmpty };

  explicit Grasp(const SceneView& scene) : scene_(scene) {}

  /// Follows the jaw: takes hold when it closes past grasp_close_rad, lets go past grasp_open_rad. What lies between
  /// the jaws is the membrane where there is some, else the organ.
  void Update(const ToolDescription& tool, const ToolPose& pose, const TissueModel& model, ParticleStore* particles);
  /// Puts what is held where the tool has taken it.
  void Move(const ToolPose& pose, ParticleStore* particles) const;
  /// Above grip_force_N the tissue creeps out of the jaws along the traction [N, frame W]; what leaves the jaws is
  /// lost.
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
};

}  // namespace fulcrum::physics
