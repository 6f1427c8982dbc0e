#include "physics_node/grasp/grasp.h"

#include <algorithm>

#include "physics_node/collision/closest.h"

namespace fulcrum::physics {
namespace {

/// Distance from the jaws' middle line at which tissue is no longer held, in grasp radii. Assumed.
constexpr float kLostRadii = 1.5f;
/// Creep at twice the grip force and full hold [m/s]. Assumed.
constexpr float kCreepSpeed = 0.05f;
/// Largest excess of the traction over the grip force that counts for the creep, in grip forces; bounds its speed.
constexpr float kMaxExcess = 2.0f;
/// Time constant of the traction [s]: a shorter jolt does not pull tissue out of the jaws.
constexpr float kTractionTime = 0.03f;
/// Hold at grasp_radius from the middle line; it falls linearly from 1 at kFirmShare of that radius. Assumed.
constexpr float kLeastHold = 0.3f;
constexpr float kFirmShare = 0.5f;

/// Distance from the surface between the axes of jaws at an opening angle; angle 0: from their middle line.
float DistanceToJaws(const Vec3f& p_T, const ToolDescription& tool, float jaw_rad) {
  const float length = tool.tip_length_m, half = 0.5f * std::max(jaw_rad, 0.0f);
  const Vec3f hinge(0, 0, -length);
  const Vec3f up = hinge + length * Vec3f(std::sin(half), 0, std::cos(half)), down(-up.x(), 0, up.z());
  const auto b = ClosestOnTriangle(p_T, hinge, up, down);
  return (b[0] * hinge + b[1] * up + b[2] * down - p_T).norm();
}

}  // namespace

float Grasp::GripForce(const PhysicsParams& params, float jaw_rad) {
  return params.grip_force_N * std::clamp(1.0f - jaw_rad / params.grasp_open_rad, 0.0f, 1.0f);
}

float Grasp::HoldOf(const HeldParticle& held, const ToolDescription& tool) const {
  const float radius = scene_.physics.grasp_radius_m;
  const float out = DistanceToJaws(held.p_T, tool, 0.0f) / radius;
  return std::clamp(1.0f - (1.0f - kLeastHold) * (out - kFirmShare) / (1.0f - kFirmShare), kLeastHold, 1.0f);
}

std::vector<Index> Grasp::InJaws(const ToolDescription& tool, const ToolPose& pose, float reach,
                                 const TissueModel& model, const ParticleStore& particles) {
  std::vector<Index> tissue;
  for (Index p = 0; p < particles.particle_count(); ++p) {
    const Vec3f p_T = pose.ToTool(particles.At(particles.Ref(p)));
    if (DistanceToJaws(p_T, tool, pose.jaw_rad) < reach && model.BaseInverseMass(p) > 0.0f) tissue.push_back(p);
  }
  return tissue;
}

std::vector<Index> Grasp::AcrossJaws(const ToolDescription& tool, const ToolPose& pose, float reach,
                                     std::span<const Triangle> surface, const TissueModel& model,
                                     const ParticleStore& particles) {
  std::vector<Index> ends;
  for (const Triangle& triangle : surface) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Index a = triangle[k], b = triangle[(k + 1) % 3];
      const Vec3f a_T = pose.ToTool(particles.At(particles.Ref(a))), b_T = pose.ToTool(particles.At(particles.Ref(b)));
      if ((a_T.y() < 0.0f) == (b_T.y() < 0.0f)) continue;  // The jaws move in the plane y = 0.
      const Vec3f at = a_T + a_T.y() / (a_T.y() - b_T.y()) * (b_T - a_T);
      if (DistanceToJaws(at, tool, pose.jaw_rad) >= reach) continue;
      for (const Index end : {a, b}) {
        if (model.BaseInverseMass(end) > 0.0f) ends.push_back(end);
      }
    }
  }
  std::ranges::sort(ends);
  ends.erase(std::unique(ends.begin(), ends.end()), ends.end());
  return ends;
}

void Grasp::Update(const ToolDescription& tool, const ToolPose& pose, const TissueModel& model,
                   ParticleStore* particles) {
  if (tool.kind != ToolKind::kGrasper && tool.kind != ToolKind::kClipApplier) {
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
  const auto take = [&](Index first, Index last, float between, float around) {
    for (Index p = first; p < last; ++p) {
      const ParticleRef at = particles->Ref(p);
      const Vec3f p_T = pose.ToTool(particles->At(at));
      // The inverse mass is 0 for dead, loose and fixed tissue and for tissue that the other tool holds.
      if (particles->InverseMass(at) > 0.0f &&
          (DistanceToJaws(p_T, tool, pose.jaw_rad) < between || DistanceToJaws(p_T, tool, 0.0f) < around)) {
        held_.push_back({p, p_T});
        particles->SetInverseMass(at, 0.0f);
      }
    }
  };
  const bool clips = tool.kind == ToolKind::kClipApplier;
  const float radius = scene_.physics.grasp_radius_m, jaw = std::min(tool.tip_radius_m, radius);
  held_.clear();
  take(0, scene_.tube_vertex_count, jaw, 0.0f);
  take(scene_.membrane.first, particles->particle_count(), jaw, clips ? 0.0f : radius);
  if (held_.empty() && !clips) {
    take(0, scene_.tube_vertex_count, jaw, radius);
  }
  traction_.setZero();
  state_ = held_.empty() ? State::kClosedEmpty : State::kHolding;
}

void Grasp::Move(const ToolPose& pose, ParticleStore* particles) const {
  for (const HeldParticle& held : held_) {
    particles->Set(particles->Ref(held.particle), pose.ToWorld(held.p_T));
  }
}

template <class Predicate>
void Grasp::DropIf(const TissueModel& model, ParticleStore* particles, const Predicate& released) {
  const auto last = std::remove_if(held_.begin(), held_.end(), [&](const HeldParticle& held) {
    if (!released(held)) {
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

void Grasp::Slip(const Vec3f& traction_W, float step_s, const ToolDescription& tool, const ToolPose& pose,
                 const TissueModel& model, ParticleStore* particles) {
  traction_ += step_s / (step_s + kTractionTime) * (traction_W - traction_);
  const float traction = traction_.norm(), grip = GripForce(scene_.physics, pose.jaw_rad);
  if (!holding() || !(traction > grip)) {
    return;
  }
  const float excess = grip > 0.0f ? std::min(traction / grip - 1.0f, kMaxExcess) : kMaxExcess;
  const Vec3f creep_T = (kCreepSpeed * step_s * excess / traction) * (pose.q_WT.conjugate() * traction_);
  for (HeldParticle& held : held_) {
    held.p_T += creep_T / HoldOf(held, tool);
  }
  const float lost = kLostRadii * scene_.physics.grasp_radius_m;
  DropIf(model, particles, [&](const HeldParticle& held) { return DistanceToJaws(held.p_T, tool, 0.0f) > lost; });
}

void Grasp::DropDead(const TissueModel& model, ParticleStore* particles) {
  DropIf(model, particles, [&](const HeldParticle& held) { return model.BaseInverseMass(held.particle) == 0.0f; });
  for (const HeldParticle& held : held_) {
    particles->SetInverseMass(particles->Ref(held.particle), 0.0f);  // A revived node has got its mass again.
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
