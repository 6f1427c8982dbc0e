#include "physics_node/xpbd/xpbd_solver.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace fulcrum::physics::xpbd {
namespace {

/// Largest ratio of edge to height of a tetrahedron in the rest shape. The inverse edge matrix of a flatter one has too
/// few correct digits in float, and the element is omitted.
constexpr double kMaxAspect = 1e4;
/// A coordinate that differs from its previous value by more than this multiple of the largest movement was damaged
/// between two substeps: none leaves such a difference.
constexpr float kDamagedOverMaxMove = 2.0f;

}  // namespace

XpbdSolver::XpbdSolver(const ElasticModel& model, const TissueModel* tissue, ParticleStore* particles,
                       const Kernels& kernels, const tissue::Kernels& motion)
    : tissue_(tissue),
      particles_(particles),
      kernels_(kernels),
      motion_(motion),
      damping_per_s_(static_cast<float>(model.damping_per_s)),
      gravity_(model.gravity.cast<float>()),
      tets_(tissue->tets().size(), NeoHookeanBatch{}),
      hinges_(tissue->bending().size(), HingeBatch{}),
      bindings_(tissue->bindings().size(), FatBatch{}),
      hinge_particles_(4 * tissue->hinge_particles().size()) {
  const GridLayout& layout = particles->layout();
  for (FloatArray& plane : stiffness_) {
    plane = FloatArray(layout.plane());
  }
  const bool prestrained =
      std::any_of(model.load.begin(), model.load.end(), [](const Vec3d& f) { return !f.isZero(0.0); });
  for (std::size_t d = 0; d < 3 && prestrained; ++d) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      rest_tension_[d][axis] = FloatArray(layout.plane());
      membrane_.rest_tension[d][axis] = rest_tension_[d][axis].data();
    }
  }
  membrane_.rest_scale = 1.0f;
  membrane_.stiffening = static_cast<float>(model.stiffening);
  for (std::size_t edge = 0; edge < model.springs.size(); ++edge) {
    const ElasticSpring& spring = model.springs[edge];
    const auto node = static_cast<Index>(edge / 3);
    if (spring.axial > 0 && spring.rest_length > 0) {
      const std::uint32_t at = layout.Offset(node / layout.cols, node % layout.cols);
      stiffness_[edge % 3][at] = static_cast<float>(spring.axial / spring.rest_length);
      if (prestrained) {
        const Vec3d along = model.rest_position[spring.b] - model.rest_position[spring.a];
        const double strain = along.norm() / spring.rest_length - 1;
        const Vec3d tension =
            spring.axial * (strain + model.stiffening * strain * strain * strain) * along.normalized();
        for (std::size_t axis = 0; axis < 3; ++axis) {
          rest_tension_[edge % 3][axis][at] = static_cast<float>(tension[static_cast<Eigen::Index>(axis)]);
        }
      }
      const float scene_rest = tissue->rest(static_cast<int>(edge % 3))[at];
      // The same ratio for all edges. A shrunk edge has a larger one, hence the minimum; a cut edge has none.
      if (scene_rest > 0.0f) {
        membrane_.rest_scale = std::min(membrane_.rest_scale, static_cast<float>(spring.rest_length) / scene_rest);
      }
    }
  }
  for (std::size_t d = 0; d < 3; ++d) {
    membrane_.stiffness[d] = stiffness_[d].data();
  }
  for (std::size_t i = 0; i < model.tets.size(); ++i) {
    const ElasticTet& tet = model.tets[i];
    NeoHookeanBatch& batch = tets_[tissue->tet_slots()[i] / kLanes];
    const Index lane = tissue->tet_slots()[i] % kLanes;
    const Mat3d inverse = tet.inverse_edges;
    const double edge = (model.rest_position[tet.v[1]] - model.rest_position[tet.v[0]]).norm();
    if (!(tet.volume > 0) || !inverse.allFinite() || inverse.norm() * edge > kMaxAspect) {
      continue;
    }
    for (int row = 0; row < 3; ++row) {
      for (int col = 0; col < 3; ++col) {
        batch.inverse_edges[3 * row + col][lane] = static_cast<float>(inverse(row, col));
      }
    }
    batch.mu[lane] = static_cast<float>(tet.scale * model.mu_Pa * tet.volume);
    batch.lambda[lane] = static_cast<float>(tet.scale * (model.lambda_Pa + model.mu_Pa) * tet.volume);
  }
  for (std::size_t i = 0; i < model.hinges.size(); ++i) {
    const ElasticHinge& hinge = model.hinges[i];
    HingeBatch& batch = hinges_[tissue->hinge_slots()[i] / kLanes];
    const Index lane = tissue->hinge_slots()[i] % kLanes;
    Vec3d offset = Vec3d::Zero();
    for (std::size_t j = 0; j < 4; ++j) {
      batch.c[j][lane] = static_cast<float>(hinge.c[j]);
      offset += hinge.c[j] * model.rest_position[hinge.v[j]];
    }
    for (int axis = 0; axis < 3; ++axis) {
      batch.offset[axis][lane] = static_cast<float>(offset[axis]);
    }
    batch.stiffness[lane] = static_cast<float>(hinge.stiffness);
  }
  for (std::size_t i = 0; i < model.bindings.size(); ++i) {
    bindings_[tissue->binding_slots()[i] / kLanes].stiffness[tissue->binding_slots()[i] % kLanes] =
        static_cast<float>(model.bindings[i].stiffness);
  }
}

std::uint32_t XpbdSolver::Predict(float h) {
  IntegrateSettings settings{1.0f / (1.0f + damping_per_s_ * h), {}, kDamagedOverMaxMove * kMaxSpeed * h};
  for (int axis = 0; axis < 3; ++axis) {
    settings.gravity[axis] = gravity_[axis] * h * h;
  }
  float* const now[3] = {particles_->plane(0), particles_->plane(1), particles_->plane(2)};
  float* const previous[3] = {particles_->previous_plane(0), particles_->previous_plane(1),
                              particles_->previous_plane(2)};
  const std::uint32_t resets =
      motion_.integrate_xyzw(particles_->tube(), particles_->tube_previous(), particles_->tube_floats(), settings) +
      motion_.integrate(now, previous, particles_->plane(3), particles_->layout().plane(), settings);
  return resets;
}

void XpbdSolver::ScaleLastMove(float ratio) {
  for (Index p = 0; p < particles_->particle_count(); ++p) {
    const ParticleRef at = particles_->Ref(p);
    particles_->SetPrevious(at, particles_->At(at) - ratio * (particles_->At(at) - particles_->Previous(at)));
  }
}

void XpbdSolver::Iterate(float h) {
  const float h_sq = h * h;
  const GridLayout& layout = particles_->layout();
  const GridArrays grid{particles_->plane(0),
                        particles_->plane(1),
                        particles_->plane(2),
                        particles_->plane(3),
                        {tissue_->rest(0), tissue_->rest(1), tissue_->rest(2)},
                        static_cast<int>(layout.rows),
                        static_cast<int>(layout.slots)};
  kernels_.tets(particles_->tube(), tissue_->tets().data(), tets_.data(), tets_.size(), h_sq);
  kernels_.membrane(grid, membrane_, h_sq);
  if (!hinges_.empty()) {
    Bend(h_sq);
  }
  kernels_.bindings(particles_->pool(), tissue_->bindings().data(), bindings_.data(), bindings_.size(), h_sq);
}

void XpbdSolver::Bend(float h_sq) {
  const std::vector<ParticleRef>& refs = tissue_->hinge_particles();
  CopyHingeParticles(refs, particles_->pool(), hinge_particles_.data());
  kernels_.hinges(hinge_particles_.data(), tissue_->bending().data(), hinges_.data(), hinges_.size(), h_sq);
  PutHingeParticles(refs, hinge_particles_.data(), particles_->pool());
}

FinishResult XpbdSolver::Finish(float h) {
  const float limit_sq = kMaxSpeed * h * kMaxSpeed * h;
  float* const now[3] = {particles_->plane(0), particles_->plane(1), particles_->plane(2)};
  const float* const previous[3] = {particles_->previous_plane(0), particles_->previous_plane(1),
                                    particles_->previous_plane(2)};
  const FinishResult grid = motion_.finish(now, previous, particles_->plane(3), particles_->layout().plane(), limit_sq);
  const FinishResult tube =
      motion_.finish_xyzw(particles_->tube(), particles_->tube_previous(), particles_->tube_floats(), limit_sq);
  return {std::max(grid.max_step_sq, tube.max_step_sq), grid.resets + tube.resets};
}

void XpbdSolver::Stop() { particles_->StopAll(); }

}  // namespace fulcrum::physics::xpbd
