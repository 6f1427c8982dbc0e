// Extended position-based dynamics with small steps (Macklin et al. 2016, 2019): a step is divided into substeps, each
// with one Gauss-Seidel sweep over the energies of ElasticModel in SI units. It uses the arrays of mode paper; previous
// positions are those of the last substep.
//
// Deviation from ElasticModel: the organ consists of linear tetrahedra instead of nodal patches, because a patch of
// fifteen vertices is too wide for a local projection. It therefore locks in bending (elastic_model.h).
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
  /// Largest speed of a particle [m/s]; corresponds to PbdSolver::kMaxStep.
  static constexpr float kMaxSpeed = 3.0f;

  /// Cuts and shrinking are read from `tissue` in each substep.
  XpbdSolver(const ElasticModel& model, const TissueModel* tissue, ParticleStore* particles,
             const Kernels& kernels = KernelsFor(), const tissue::Kernels& motion = tissue::KernelsFor());

  /// A substep of h seconds is Predict, Iterate, Finish; the caller places held particles and projects contacts between
  /// them. Predict: previous <- now; now <- now + damped velocity + gravity, for free particles. The last substep had
  /// the same h, else ScaleLastMove. Returns the number of damaged coordinates, which are restored from the last
  /// substep.
  std::uint32_t Predict(float h);
  /// previous <- now - ratio (now - previous): before a substep that is `ratio` times as long as the last one, so that
  /// velocities stay.
  void ScaleLastMove(float ratio);
  /// Organ, membrane, bending, bindings.
  void Iterate(float h);
  /// Particles that are not finite return to their previous position, movements are limited to kMaxSpeed * h.
  FinishResult Finish(float h);
  /// Sets all velocities to zero.
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
