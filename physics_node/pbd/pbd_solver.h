// One step of position-based dynamics in the paper's way: predict, a few Gauss-Seidel iterations over all layers,
// velocities from positions (Verlet). Contacts and grasps are projected by the caller between the iterations.
#pragma once

#include <cstdint>

#include "physics_node/pbd/kernels.h"
#include "physics_node/tissue/kernels.h"
#include "physics_node/tissue/particle_store.h"
#include "physics_node/tissue/tissue_model.h"
#include "services/base/core/scene_view.h"

namespace fulcrum::physics {

class PbdSolver {
 public:
  /// No particle moves further in one step [m]: 3 m/s at 100 Hz, ten times a quick hand. What would is not tissue but
  /// an explosion, and is cut short.
  static constexpr float kMaxStep = 0.03f;

  PbdSolver(const PhysicsParams& params, TissueModel* model, ParticleStore* particles,
            const pbd::Kernels& kernels = pbd::KernelsFor(), const tissue::Kernels& motion = tissue::KernelsFor());

  /// previous <- now; now <- now + damped velocity + gravity, for free particles.
  /// A coordinate damaged since the last step (not finite, far off) comes from the last step; returns how many.
  std::uint32_t Predict();
  /// One Gauss-Seidel iteration: tube springs, volumes, membrane stretch, bending, bindings.
  void Iterate();
  /// The bending of Iterate, on a compact copy of the particles that hinges use.
  void Bend();
  /// Quarantine: what is not finite goes back to where it was; nothing goes further than kMaxStep.
  FinishResult Finish();
  /// Takes all velocities away.
  void Stop();

 private:
  [[nodiscard]] GridArrays Grid() const;

  PhysicsParams params_;
  TissueModel* model_;
  ParticleStore* particles_;
  const pbd::Kernels& kernels_;
  const tissue::Kernels& motion_;
  FloatArray hinge_particles_;  ///< xyzw copies of TissueModel::hinge_particles.
};

}  // namespace fulcrum::physics
