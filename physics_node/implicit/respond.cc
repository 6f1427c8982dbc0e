// Stiffness queries: static and one-step stiffness on the matrix of the last linearisation. With the queried particles
// moved together by u_q along a direction n and what is left free,
//
//   K u = 0 for the free particles (at rest), or (K + s M) u = 0 with s of a substep of the horizon's length,
//   stiffness = n . (K u)_q / u_q
#include <algorithm>
#include <cmath>
#include <utility>

#include "physics_node/implicit/conjugate_gradients.h"
#include "physics_node/implicit/implicit_solver.h"
#include "physics_node/implicit/phases.h"

namespace fulcrum::physics::implicit {
namespace {

/// Iterations of a query; queries are repeated, and each begins with the last answer.
constexpr int kQueryIterations = 2;
/// u_q [m]: far above rounding; the answer is linear in it.
constexpr float kProbeStep_m = 1e-3f;

/// Exchanges a particle's block of the preconditioner; a block of zeros keeps the particle where it is.
void SwapBlock(const FieldLayout& layout, ParticleRef at, std::array<float, kMatrixFloats>* block,
               Linearisation* linearisation) {
  if (layout.InTube(at)) {
    std::swap_ranges(block->begin(), block->end(),
                     linearisation->organ_blocks.data() + kMatrixFloats * (at.base / kVertexFloats));
    return;
  }
  for (std::size_t i = 0; i < linearisation->sheet_blocks.size(); ++i) {
    std::swap((*block)[i], linearisation->sheet_blocks[i][layout.InPlane(at)]);
  }
}

/// Holds the particles of a query, whatever touches them, and takes them out of the preconditioner: moved together they
/// need few iterations, while a force on them spreads slowly (deploy/docs/measurements/physics, Stiffness queries).
void HoldQueried(const SolverContext& context, std::span<const ParticleRef> at, Linearisation* linearisation,
                 std::vector<QueriedParticle>* queried) {
  queried->clear();
  for (const ParticleRef particle : at) {
    QueriedParticle& kept = queried->emplace_back();
    kept.inverse_mass = context.particles.InverseMass(particle);
    context.particles.SetInverseMass(particle, 0.0f);
    SwapBlock(context.model.layout, particle, &kept.block, linearisation);
  }
}
void ReleaseQueried(const SolverContext& context, std::span<const ParticleRef> at, Linearisation* linearisation,
                    std::vector<QueriedParticle>* queried) {
  // Backwards: a particle may be in a query twice.
  for (std::size_t k = at.size(); k-- > 0;) {
    context.particles.SetInverseMass(at[k], (*queried)[k].inverse_mass);
    SwapBlock(context.model.layout, at[k], &(*queried)[k].block, linearisation);
  }
}

/// u <- the last answer where particles move, `step` at those of the query, 0 elsewhere.
void SetFirstGuess(const SolverContext& context, std::span<const ParticleRef> at, const Vec3f& step,
                   const RegionSet& computed, FloatArray* u) {
  const FieldLayout& layout = context.model.layout;
  ForTasks(&context.workers, computed, [&](const Task& task, int, int) {
    const auto first = static_cast<std::size_t>(task.first), end = static_cast<std::size_t>(task.end);
    if (!task.sheet) {
      for (std::size_t v = first; v < end; ++v) {
        const float keep = context.particles.tube()[kVertexFloats * v + 3] > 0.0f ? 1.0f : 0.0f;
        for (std::size_t i = kVertexFloats * v; i < kVertexFloats * v + 3; ++i) {
          (*u)[i] *= keep;
        }
      }
      return;
    }
    const float* const inverse_mass = context.particles.plane(3);
    for (float* const plane : layout.Planes(u)) {
      for (std::size_t i = layout.stride * first; i < layout.stride * end; ++i) {
        plane[i] = inverse_mass[i] > 0.0f ? plane[i] : 0.0f;
      }
    }
  });
  for (const ParticleRef particle : at) {
    AddField(u->data(), particle, step - FieldAt(u->data(), particle));
  }
}

}  // namespace

bool ImplicitSolver::Stiffness(const StiffnessQuery& query, float* newton_per_m) {
  const RegionSet& computed = state_.regions.computed();
  // Where a region sleeps, the residual is that of an older step.
  if (query.at.empty() || !std::all_of(query.at.begin(), query.at.end(), [this](ParticleRef at) {
        return state_.regions.computed(model_.partition.Of(at));
      })) {
    return false;
  }
  Linearisation& at = state_.linearisation;
  FloatArray &u = state_.query_displacement[query.number], &q = scratch_.krylov.q, &d = scratch_.krylov.d;
  HoldQueried(context_, query.at, &at, &scratch_.queried);
  SetFirstGuess(context_, query.at, kProbeStep_m * query.direction, computed, &u);
  std::swap(at.residual, scratch_.kept_residual);
  state_.elements.ExcludeContacts(true);

  // The residual of the first guess, and its correction.
  const float inertia = query.horizon_s > 0.0f ? model_.InertiaOf(query.horizon_s).inertia : 0.0f;
  const LinearSystem system(context_, inertia, &state_, &scratch_);
  LinearSolver solver(context_, system, &state_, &scratch_);
  (void)solver.Apply(u);
  ForTasks(&workers_, computed, [&](const Task& task, int, int) {
    solver.AddElements(task, &q);
    ForPieces(model_.layout, task, [&](std::size_t first, std::size_t count) {
      for (std::size_t i = first; i < first + count; ++i) {
        at.residual[i] = -q[i];
      }
    });
  });
  std::fill(scratch_.wanted.begin(), scratch_.wanted.end(), std::uint8_t{0});
  for (const ParticleRef particle : query.at) {
    scratch_.wanted[static_cast<std::size_t>(model_.partition.Of(particle))] = 1;
  }
  solver.SelectResidual(scratch_.wanted);
  solver.Solve(kQueryIterations);
  ForTasks(&workers_, computed, [&](const Task& task, int, int) {
    ForPieces(model_.layout, task, [&](std::size_t first, std::size_t count) {
      for (std::size_t i = first; i < first + count; ++i) {
        u[i] += d[i];
      }
    });
  });

  float pull = 0;
  for (const ParticleRef particle : query.at) {
    pull -= FieldAt(at.residual.data(), particle).dot(query.direction);
    // The product of the organ, unlike that of the membrane, contains the mass of what is held.
    if (model_.layout.InTube(particle)) {
      pull -= inertia * system.organ.mass[particle.base / kVertexFloats] * kProbeStep_m;
    }
  }
  state_.elements.ExcludeContacts(false);
  ReleaseQueried(context_, query.at, &at, &scratch_.queried);
  std::swap(at.residual, scratch_.kept_residual);
  *newton_per_m = pull / kProbeStep_m;
  if (!std::isfinite(pull) || !(pull > 0.0f)) {
    std::fill_n(u.data(), u.size(), 0.0f);
    return false;
  }
  return true;
}

}  // namespace fulcrum::physics::implicit
