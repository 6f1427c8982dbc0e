// Questions to the tissue: static and one-step responses on the matrix of the last linearisation.
#include <algorithm>

#include "physics_node/accurate/accurate_solver.h"
#include "physics_node/accurate/for_tasks.h"

namespace fulcrum::physics::accurate {
namespace {

constexpr int kIterations = 2;
/// How far held particles are moved to see what pulls [m]; the answer is linear in it.
constexpr float kProbeStep = 1e-3f;

}  // namespace

bool AccurateSolver::Respond(const Question& question, Vec3f* displacement) {
  const float size = question.force.norm();
  if (regions_.nothing() || question.at.empty() || !(size > 0.0f)) {
    return false;
  }
  const Vec3f direction = question.force / size;
  const float inertia = question.horizon_s > 0.0f ? MakeInertia(question.horizon_s).inertia : 0.0f;
  const bool held = particles_->InverseMass(question.at[0]) == 0.0f;
  FloatArray& u = answer_[question.memory];
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
    if (held && particles_->InverseMass(at) == 0.0f) {
      AddField(u.data(), at, kProbeStep * direction - FieldAt(u.data(), at));
    }
  }
  std::swap(residual_, aside_);
  elements_.LeaveContactsOut(true);
  (void)Apply(u, inertia);
  ForTasks([&](const Task& task, int, int) {
    ForParts(task, [&](std::size_t first, std::size_t count) {
      for (std::size_t i = first; i < first + count; ++i) {
        residual_[i] = -q_[i];
      }
    });
  });
  for (std::size_t k = 0; k < question.at.size() && !held; ++k) {
    AddField(residual_.data(), question.at[k], question.weights[k] * question.force);
  }
  Solve(inertia, kIterations);
  ForTasks([&](const Task& task, int, int) {
    ForParts(task, [&](std::size_t first, std::size_t count) {
      for (std::size_t i = first; i < first + count; ++i) {
        u[i] += d_[i];
      }
    });
  });
  elements_.LeaveContactsOut(false);
  *displacement = Vec3f::Zero();
  float pull = 0;
  for (std::size_t k = 0; k < question.at.size(); ++k) {
    *displacement += question.weights[k] * FieldAt(u.data(), question.at[k]);
    pull -= FieldAt(residual_.data(), question.at[k]).dot(direction);
  }
  std::swap(residual_, aside_);
  if (held) {
    *displacement *= size / pull;
  }
  if (!displacement->allFinite() || (held && !(pull > 0.0f))) {
    std::fill_n(u.data(), u.size(), 0.0f);
    return false;
  }
  return true;
}

}  // namespace fulcrum::physics::accurate
