#include "physics_node/grasp/grasp.h"

#include <algorithm>

#include "physics_node/collision/closest.h"

namespace fulcrum::physics {
namespace {

/// Tissue that creeps this many grasp radii from the jaws' line is out of them.
constexpr float kLostRadii = 1.5f;
/// Creep per step at twice the grip force: 50 mm/s at 100 Hz [m].
constexpr float kCreep = 0.0005f;

float DistanceToJaws(const Vec3f& p, const Capsule& jaws) {
  return (jaws.a + ClosestOnSegment(p, jaws.a, jaws.b) * (jaws.b - jaws.a) - p).norm();
}

}  // namespace

void Grasp::Update(const ToolDescription& tool, const ToolPose& pose, const TissueModel& model,
                   ParticleStore* particles) {
  if (tool.kind != ToolKind::kGrasper) {
    return;
  }
  if (state_ == State::kOpen && pose.jaw_rad < scene_.physics.grasp_close_rad) {
    TakeHold(tool, pose, particles);
  } else if (state_ != State::kOpen && pose.jaw_rad > scene_.physics.grasp_open_rad) {
    Release(model, particles);
    state_ = State::kOpen;
  }
}

void Grasp::TakeHold(const ToolDescription& tool, const ToolPose& pose, ParticleStore* particles) {
  const Capsule jaws = WorkingLine(tool, pose);
  const auto take = [&](Index first, Index last) {
    for (Index p = first; p < last; ++p) {
      const ParticleRef at = particles->Ref(p);
      const Vec3f x = particles->At(at);
      if (particles->InverseMass(at) > 0.0f && DistanceToJaws(x, jaws) < scene_.physics.grasp_radius_m) {
        held_.push_back({p, pose.ToTool(x)});
        particles->SetInverseMass(at, 0.0f);
      }
    }
  };
  held_.clear();
  take(scene_.membrane.first, particles->particle_count());
  if (held_.empty()) {
    take(0, scene_.tube_vertex_count);
  }
  state_ = held_.empty() ? State::kClosedEmpty : State::kHolding;
}

void Grasp::Move(const ToolPose& pose, ParticleStore* particles) const {
  for (const HeldParticle& held : held_) {
    particles->Set(particles->Ref(held.particle), pose.ToWorld(held.p_T));
  }
}

template <class Predicate>
void Grasp::DropIf(const TissueModel& model, ParticleStore* particles, const Predicate& gone) {
  const auto last = std::remove_if(held_.begin(), held_.end(), [&](const HeldParticle& held) {
    if (!gone(held)) {
      return false;
    }
    particles->SetInverseMass(particles->Ref(held.particle), model.BaseInverseMass(held.particle));
    return true;
  });
  held_.erase(last, held_.end());
  if (state_ == State::kHolding && held_.empty()) {
    state_ = State::kClosedEmpty;
  }
}

void Grasp::Slip(const Vec3f& traction_W, const ToolDescription& tool, const ToolPose& pose, const TissueModel& model,
                 ParticleStore* particles) {
  const float traction = traction_W.norm(), grip = scene_.physics.grip_force_N;
  if (!holding() || !(traction > grip)) {
    return;
  }
  const Vec3f creep_T =
      (kCreep * std::min(traction / grip - 1.0f, 2.0f) / traction) * (pose.q_WT.conjugate() * traction_W);
  for (HeldParticle& held : held_) {
    held.p_T += creep_T;
  }
  const Capsule jaws = WorkingLine(tool, pose);
  const float lost = kLostRadii * scene_.physics.grasp_radius_m;
  DropIf(model, particles,
         [&](const HeldParticle& held) { return DistanceToJaws(pose.ToWorld(held.p_T), jaws) > lost; });
}

void Grasp::DropDead(const TissueModel& model, ParticleStore* particles) {
  DropIf(model, particles, [&](const HeldParticle& held) { return model.BaseInverseMass(held.particle) == 0.0f; });
  for (const HeldParticle& held : held_) {
    particles->SetInverseMass(particles->Ref(held.particle), 0.0f);  // A revived node takes its mass back.
  }
}

void Grasp::Release(const TissueModel& model, ParticleStore* particles) {
  DropIf(model, particles, [](const HeldParticle&) { return true; });
}

void Grasp::Restore(State state, std::vector<HeldParticle> held, ParticleStore* particles) {
  state_ = state;
  held_ = std::move(held);
  for (const HeldParticle& h : held_) {
    particles->SetInverseMass(particles->Ref(h.particle), 0.0f);
  }
}

}  // namespace fulcrum::physics
