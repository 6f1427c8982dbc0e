// Motion of the tools in a step, and what follows from it directly: grasps and contact pairs.
//
//   p' = p + (p_in - p) / n,   q' = slerp(q, q_in, 1 / n),   n = max(1, |p_in - p| / (v h), angle(q, q_in) / (omega h))
//
//   jaw' = jaw limited to [jaw_in - kJawPlay_rad, jaw_in]
//
//   p, q, p_in, q_in  last pose and input, frame W        v, omega  kMaxToolSpeed, kMaxToolTurn        h  step [s]
#include <algorithm>
#include <cmath>

#include "physics_node/simulation/tissue_simulation.h"

namespace fulcrum::physics {
namespace {

/// Movement in a step below which a tool is at rest [m]: far below the resolution of a haptic device, 9 um.
constexpr float kToolStill = 1e-7f;
/// Play of the jaws' angle [rad]: they open only by what exceeds it, so the noise of a handle at rest, up to 12 mrad to
/// either side (handle_bridge), neither counts as closing nor keeps touched tissue awake. A closing is followed
/// exactly.
constexpr float kJawPlay_rad = 0.024f;

float AngleBetween(const Quatf& a, const Quatf& b) { return 2.0f * std::acos(std::min(1.0f, std::abs(a.dot(b)))); }

/// Pose between `from` and `to`, at most `step` [m] and `turn` [rad] from `from`.
ToolPose Approach(const ToolPose& from, const ToolPose& to, float step, float turn) {
  const float steps = (to.p_WT - from.p_WT).norm() / step;
  const float turns = AngleBetween(from.q_WT, to.q_WT) / turn;
  const float part = 1.0f / std::max({1.0f, steps, turns});
  if (part == 1.0f) {
    return to;
  }
  ToolPose pose = Interpolate(from, to, part);
  pose.jaw_rad = to.jaw_rad;
  return pose;
}

}  // namespace

bool TissueSimulation::ToolTrack::moved() const {
  return (now.p_WT - last.p_WT).norm() > kToolStill || now.q_WT.coeffs() != last.q_WT.coeffs() ||
         now.jaw_rad != last.jaw_rad;
}

void TissueSimulation::FollowTools(const std::array<ToolInput, kMaxTools>& tools) {
  for (std::size_t i = 0; i < kMaxTools; ++i) {
    ToolTrack& track = tracks_[i];
    const bool appears = tools[i].present && !track.present;
    track.present = tools[i].present;
    if (!track.present) {
      continue;
    }
    ToolPose wanted = tools[i].pose;
    track.last = appears ? wanted : track.now;
    wanted.jaw_rad = std::clamp(track.last.jaw_rad, wanted.jaw_rad - kJawPlay_rad, wanted.jaw_rad);
    track.now = Approach(track.last, wanted, kMaxToolSpeed * step_s(), kMaxToolTurn * step_s());
  }
}

void TissueSimulation::UpdateGrasps() {
  for (std::size_t i = 0; i < kMaxTools; ++i) {
    const ToolTrack& track = tracks_[i];
    if (track.present) {
      const bool held = grasps_[i].holding();
      grasps_[i].Update(scene_.tools[i], track.now, model_, &particles_);
      if (scene_.tools[i].kind == ToolKind::kClipApplier && !held && grasps_[i].holding()) ApplyClip(i);
    } else if (grasps_[i].holding()) {
      grasps_[i].Release(model_, &particles_);
    }
  }
}

void TissueSimulation::ApplyClip(std::size_t tool) {
  std::vector<Index> held;
  for (const HeldParticle& particle : grasps_[tool].held()) held.push_back(particle.particle);
  (void)clips_.Apply(static_cast<std::uint8_t>(tool), scene_.tools[tool], tracks_[tool].now, held, particles_);
}

void TissueSimulation::FindContacts(bool tissue_moved, float tissue_step) {
  std::array<ToolCollision::ToolMotion, kMaxTools> motions;
  for (std::size_t i = 0; i < kMaxTools; ++i) {
    if (tracks_[i].present) {
      // The handle of a suction tube is a valve.
      const ToolKind kind = scene_.tools[i].kind;
      const bool has_jaws = kind == ToolKind::kGrasper || kind == ToolKind::kScissors || kind == ToolKind::kClipApplier;
      motions[i] = {ShapeOf(scene_.tools[i], tracks_[i].last), ShapeOf(scene_.tools[i], tracks_[i].now),
                    grasps_[i].holding(), has_jaws && tracks_[i].now.jaw_rad < tracks_[i].last.jaw_rad};
    }
  }
  collision_.FindPairs(motions, tissue_moved, tissue_step);
}

}  // namespace fulcrum::physics
