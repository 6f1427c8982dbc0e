// Solver of mode paper, position-based dynamics: prediction, a few Gauss-Seidel iterations over all layers, velocities
// from positions (Verlet). The caller projects contacts and grasps between the iterations.
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
  /// Largest movement of a particle in a step [m]: 3 m/s at 100 Hz, ten times a fast hand. A larger one is an
  /// instability and is limited to this.
  static constexpr float kMaxStep = 0.03f;

  PbdSolver(const PhysicsParams& params, TissueModel* model, ParticleStore* particles,
            const pbd::Kernels& kernels = pbd::KernelsFor(), const tissue::Kernels& motion = tissue::KernelsFor());

  /// previous <- now; now <- now + damped velocity + gravity, for free particles. A coordinate damaged since the last
  /// step (not finite, or far from the previous one) is restored from the last step; returns their number.
  std::uint32_t Predict();
  /// One Gauss-Seidel iteration: tube springs, volumes, membrane stretch, bending, bindings.
  void Iterate();
  /// Bending of Iterate, on a compact copy of the particles that hinges use.
  void Bend();
  /// Quarantine: particles that are not finite return to their previous position, movements are limited to kMaxStep.
  FinishResult Finish();
  /// Sets all velocities to zero.
  void Stop();
  [[nodiscard]] std::uint32_t iterations() const { return params_.iterations; }

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
