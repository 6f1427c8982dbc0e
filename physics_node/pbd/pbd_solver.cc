#include "physics_node/pbd/pbd_solver.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace fulcrum::physics {
namespace {

/// Stiffness of a binding under pressure over that under tension: the fat that it stands for yields when the membrane
/// is lifted and carries the membrane when it is pressed down. Assumed.
constexpr float kCompressionOverTension = 10.0f;
/// Share of its rest height that a binding keeps under any pressure, so that the organ does not penetrate the membrane.
/// Assumed.
constexpr float kLeastHeight = 0.3f;
/// A coordinate that differs from its previous value by more than this multiple of the largest movement was damaged
/// between two steps: no step leaves such a difference.
constexpr float kDamagedOverMaxStep = 2.0f;

}  // namespace

PbdSolver::PbdSolver(const PhysicsParams& params, TissueModel* model, ParticleStore* particles,
                     const pbd::Kernels& kernels, const tissue::Kernels& motion)
    : params_(params),
      model_(model),
      particles_(particles),
      kernels_(kernels),
      motion_(motion),
      hinge_particles_(4 * model->hinge_particles().size()) {}

GridArrays PbdSolver::Grid() const {
  const GridLayout& layout = particles_->layout();
  return {particles_->plane(0),
          particles_->plane(1),
          particles_->plane(2),
          particles_->plane(3),
          {model_->rest(0), model_->rest(1), model_->rest(2)},
          static_cast<int>(layout.rows),
          static_cast<int>(layout.slots)};
}

void PbdSolver::Bend() {
  const std::vector<ParticleRef>& refs = model_->hinge_particles();
  CopyHingeParticles(refs, particles_->pool(), hinge_particles_.data());
  kernels_.bending(hinge_particles_.data(), model_->bending().data(), model_->bending().size(), params_.k_bending);
  PutHingeParticles(refs, hinge_particles_.data(), particles_->pool());
}

std::uint32_t PbdSolver::Predict() {
  IntegrateSettings settings{
      std::max(0.0f, 1.0f - params_.damping_per_s * params_.dt_s), {}, kDamagedOverMaxStep * kMaxStep};
  for (int axis = 0; axis < 3; ++axis) {
    settings.gravity[axis] = params_.gravity[axis] * params_.dt_s * params_.dt_s;
  }
  const std::uint32_t resets =
      motion_.integrate_xyzw(particles_->tube(), particles_->tube_previous(), particles_->tube_floats(), settings);
  float* const now[3] = {particles_->plane(0), particles_->plane(1), particles_->plane(2)};
  float* const previous[3] = {particles_->previous_plane(0), particles_->previous_plane(1),
                              particles_->previous_plane(2)};
  return resets + motion_.integrate(now, previous, particles_->plane(3), particles_->layout().plane(), settings);
}

void PbdSolver::Iterate() {
  kernels_.springs(particles_->tube(), model_->springs().data(), model_->springs().size(), params_.k_stretch_tube);
  kernels_.volumes(particles_->tube(), model_->tets().data(), model_->tets().size(), params_.k_volume);
  kernels_.grid_stretch(Grid(), params_.k_stretch_membrane);
  if (!model_->bending().empty()) {
    Bend();
  }
  const pbd::BindingStiffness binding{params_.k_binding, std::min(1.0f, kCompressionOverTension * params_.k_binding),
                                      kLeastHeight};
  kernels_.bindings(particles_->pool(), model_->bindings().data(), model_->bindings().size(), binding);
}

FinishResult PbdSolver::Finish() {
  constexpr float kLimitSq = kMaxStep * kMaxStep;
  float* const now[3] = {particles_->plane(0), particles_->plane(1), particles_->plane(2)};
  const float* const previous[3] = {particles_->previous_plane(0), particles_->previous_plane(1),
                                    particles_->previous_plane(2)};
  const FinishResult grid = motion_.finish(now, previous, particles_->plane(3), particles_->layout().plane(), kLimitSq);
  const FinishResult tube =
      motion_.finish_xyzw(particles_->tube(), particles_->tube_previous(), particles_->tube_floats(), kLimitSq);
  return {std::max(grid.max_step_sq, tube.max_step_sq), grid.resets + tube.resets};
}

void PbdSolver::Stop() { particles_->StopAll(); }

}  // namespace fulcrum::physics
