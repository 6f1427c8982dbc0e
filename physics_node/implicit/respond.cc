// Questions to the tissue: static and one-step stiffness on the matrix of the last linearisation.
#include <algorithm>
#include <cmath>

#include "physics_node/implicit/for_tasks.h"
#include "physics_node/implicit/implicit_solver.h"

namespace fulcrum::physics::implicit {
namespace {

constexpr int kIterations = 2;
/// How far the particles are moved to see what pulls [m]; the answer is linear in it.
constexpr float kProbeStep = 1e-3f;

}  // namespace

/// Exchanges a particle's block of the preconditioner; one of zeros keeps the particle where it is.
void ImplicitSolver::SwapBlock(ParticleRef at, std::array<float, 12>* block) {
  if (at.base < tube_floats_) {
    std::swap_ranges(block->begin(), block->end(), organ_block_.data() + 3 * std::size_t{at.base});
    return;
  }
  for (std::size_t i = 0; i < block_.size(); ++i) {
    std::swap((*block)[i], block_[i][at.base - tube_floats_]);
  }
}

bool ImplicitSolver::Stiffness(const Question& question, float* newton_per_m) {
  if (regions_.nothing() || question.at.empty()) {
    return false;
  }
  const float inertia = question.horizon_s > 0.0f ? MakeInertia(question.horizon_s).inertia : 0.0f;
  FloatArray& u = answer_[question.memory];
  // The particles move together as asked, as held ones do, whatever touches them: so the answer is soon a good one.
  fixed_.clear();
  for (const ParticleRef at : question.at) {
    Fixed& fixed = fixed_.emplace_back();
    fixed.inverse_mass = particles_->InverseMass(at);
    particles_->SetInverseMass(at, 0.0f);
    SwapBlock(at, &fixed.block);
  }
  // What cannot move does not; what is held moves as asked.
  ForTasks([&](const Task& task, int, int) {
    const auto first = static_cast<std::size_t>(task.first), end = static_cast<std::size_t>(task.end);
    if (!task.sheet) {
      for (std::size_t v = first; v < end; ++v) {
        const float keep = particles_->tube()[4 * v + 3] > 0.0f ? 1.0f : 0.0f;
        for (std::size_t i = 4 * v; i < 4 * v + 3; ++i) {
          u[i] *= keep;
        }
      }
      return;
    }
    const std::size_t stride = particles_->layout().stride;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      float* plane = u.data() + tube_floats_ + axis * plane_;
      for (std::size_t i = stride * first; i < stride * end; ++i) {
        plane[i] = particles_->plane(3)[i] > 0.0f ? plane[i] : 0.0f;
      }
    }
  });
  for (const ParticleRef at : question.at) {
    AddField(u.data(), at, kProbeStep * question.direction - FieldAt(u.data(), at));
  }
  std::swap(residual_, aside_);
  elements_.LeaveContactsOut(true);
  (void)Apply(u, inertia);
  ForTasks([&](const Task& task, int, int) {
    AddElements(task, &q_);
    ForParts(task, [&](std::size_t first, std::size_t count) {
      for (std::size_t i = first; i < first + count; ++i) {
        residual_[i] = -q_[i];
      }
    });
  });
  std::fill(wanted_now_.begin(), wanted_now_.end(), std::uint8_t{0});
  for (const ParticleRef at : question.at) {
    const int region = regions_.Of(at);
    wanted_now_[static_cast<std::size_t>(region)] = regions_.computed(region) ? 1 : 0;
  }
  WantResidual(wanted_now_);
  Solve(inertia, kIterations);
  ForTasks([&](const Task& task, int, int) {
    ForParts(task, [&](std::size_t first, std::size_t count) {
      for (std::size_t i = first; i < first + count; ++i) {
        u[i] += d_[i];
      }
    });
  });
  elements_.LeaveContactsOut(false);
  float pull = 0;
  for (std::size_t k = 0; k < question.at.size(); ++k) {
    pull -= FieldAt(residual_.data(), question.at[k]).dot(question.direction);
  }
  // Backwards: a particle may be asked about twice.
  for (std::size_t k = question.at.size(); k-- > 0;) {
    particles_->SetInverseMass(question.at[k], fixed_[k].inverse_mass);
    SwapBlock(question.at[k], &fixed_[k].block);
  }
  std::swap(residual_, aside_);
  *newton_per_m = pull / kProbeStep;
  if (!std::isfinite(pull) || !(pull > 0.0f)) {
    std::fill_n(u.data(), u.size(), 0.0f);
    return false;
  }
  return true;
}

}  // namespace fulcrum::physics::implicit
