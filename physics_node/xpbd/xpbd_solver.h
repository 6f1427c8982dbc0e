// Extended position-based dynamics with small steps (Macklin et al. 2016, 2019): a step is cut into substeps, each with
// one Gauss-Seidel sweep over ElasticModel's energies in SI. On the arrays of the paper's mode: previous positions are
// those a substep ago.
//
// Beside ElasticModel: the organ is made of its linear tetrahedra, not of nodal patches (a patch of fifteen vertices is
// too wide for a local projection), so it is as stiff in bending as such tets are.
#pragma once

#include <vector>

#include "physics_node/energy/elastic_model.h"
#include "physics_node/tissue/kernels.h"
#include "physics_node/tissue/particle_store.h"
#include "physics_node/tissue/tissue_model.h"
#include "physics_node/xpbd/kernels.h"

namespace fulcrum::physics::xpbd {

class XpbdSolver {
 public:
  /// No particle moves faster [m/s]; as PbdSolver's kMaxStep.
  static constexpr float kMaxSpeed = 3.0f;

  /// Cuts and shrinking are read from `tissue` as they stand.
  XpbdSolver(const ElasticModel& model, const TissueModel* tissue, ParticleStore* particles,
             const Kernels& kernels = KernelsFor(), const tissue::Kernels& motion = tissue::KernelsFor());

  /// A substep of h seconds is Predict, Iterate, Finish; contacts and held particles are put right by the caller
  /// between them. Predict: previous <- now; now <- now + damped velocity + gravity, for free particles. The
  /// substep before had the same h. Returns how many coordinates had been damaged from outside and come from the
  /// substep before.
  std::uint32_t Predict(float h);
  /// Organ, membrane, bending, bindings.
  void Iterate(float h);
  /// What is not finite goes back to where it was; nothing goes further than kMaxSpeed * h.
  FinishResult Finish(float h);
  /// Takes all velocities away.
  void Stop();

 private:
  void Bend(float h_sq);

  const TissueModel* tissue_;
  ParticleStore* particles_;
  const Kernels& kernels_;
  const tissue::Kernels& motion_;
  float damping_per_s_;
  Vec3f gravity_;
  std::array<FloatArray, 3> stiffness_;
  std::array<std::array<FloatArray, 3>, 3> rest_tension_;
  Membrane membrane_{};
  std::vector<NeoHookeanBatch> tets_;
  std::vector<HingeBatch> hinges_;
  std::vector<FatBatch> bindings_;
  FloatArray hinge_particles_;  ///< xyzw copies of TissueModel::hinge_particles.
};

}  // namespace fulcrum::physics::xpbd
