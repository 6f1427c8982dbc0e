// Linearised implicit small steps with a preconditioner of several levels (TLI). Each substep is one backward Euler
// step of ElasticModel, linearised once and solved by a few iterations of conjugate gradients:
//
//   ImplicitModel     what is built once from the scene                        implicit_model.h
//   SolverState       what lives from step to step                             implicit_state.h
//   SolverScratch     memory that a substep reuses                             implicit_state.h
//   stages            prediction, linearisation, update                        substep.h
//                     linear solve, limits of the correction                   conjugate_gradients.h
//   preconditioner    blocks of the diagonal, hats, coarse nodes               coarse_space.h
//
// See DESIGN.md.
#pragma once

#include <cstdint>
#include <span>

#include "physics_node/implicit/implicit_model.h"
#include "physics_node/implicit/implicit_state.h"
#include "physics_node/implicit/substep.h"
#include "physics_node/tissue/tissue_model.h"

namespace fulcrum::physics::implicit {

/// A query for the stiffness with which the tissue resists a small common displacement of some particles.
struct StiffnessQuery {
  std::span<const ParticleRef> at;
  Vec3f direction = Vec3f::UnitZ();  ///< Unit.
  float horizon_s = 0;               ///< After so long; 0: when all is at rest again.
  /// Below kQueryCount: the last answer with this number is the first guess of this one.
  std::size_t number = 0;
};

/// Substeps and iterations of a preset; errors and costs: deploy/docs/measurements/physics.
struct Effort {
  int substeps = 2;
  int iterations = 2;
};
[[nodiscard]] Effort EffortOf(PhysicsPreset preset);

class ImplicitSolver {
 public:
  /// `threads` with the caller's; results do not depend on it.
  ImplicitSolver(const TissueScene& scene, const ElasticModel& model, const TissueModel& tissue,
                 ParticleStore* particles, int threads = 1, const Kernels& kernels = KernelsFor());

  /// After each TissueModel::Apply that changed something: follows cuts and shrinking, and wakes the tissue there. The
  /// cost grows with the edits; nothing is factored again.
  void UpdateTopology(const TissueModel& tissue);

  /// Clips act from now on; they must outlive this.
  void UseClips(Clips* clips) { state_.elements.UseClips(clips); }

  /// Once a step, before its substeps: stores the positions. A position damaged since the last step (not finite, far
  /// off) comes from the last step; returns how many coordinates.
  std::uint32_t BeginStep();
  SubstepReport Substep(float h, int iterations, std::span<const HeldPlace> held, std::span<ContactRow> contacts);
  /// At least how far any particle of each block of the ParticleStore has moved in the step that the last BeginStep
  /// ended [m]; 0 where all slept.
  [[nodiscard]] std::span<const float> moved() const { return state_.movement.of_step; }

  /// Force of the tissue on a particle that the last substep held [N]; undefined for others.
  [[nodiscard]] Vec3f ForceOn(ParticleRef at) const;
  [[nodiscard]] Vec3f Velocity(ParticleRef at) const;
  /// Bodies that nothing moves fall asleep, as they were when a checkpoint was written.
  void SleepStill();
  void Stop();
  /// Velocities from two states a step apart, for a restart. Wakes.
  void SetVelocity(ParticleRef at, const Vec3f& v);
  /// After positions were set: where solids slide on each other is not known any more.
  void RestartSlides();

  /// Force over displacement [N/m], from the last substep's linearisation, without contacts. Costs two iterations and a
  /// product, so the first answer to a new query at rest is too large; it improves when the query is repeated. False:
  /// all is asleep, or the answer is not positive and finite. The state stays as it is.
  bool Stiffness(const StiffnessQuery& query, float* newton_per_m);

  /// Its threads, between substeps. No result depends on them.
  [[nodiscard]] Workers& workers() const { return workers_; }
  /// What is computed at present, and what is awake.
  [[nodiscard]] const Regions& regions() const { return state_.regions; }

 private:
  const ImplicitModel model_;
  mutable Workers workers_;
  const SolverContext context_;
  SolverState state_;
  SolverScratch scratch_;
};

}  // namespace fulcrum::physics::implicit
