// Motion of the tools in a step, and what follows from it directly: grasps and contact pairs.
//
//   p' = p + (p_in - p) / n,   q' = slerp(q, q_in, 1 / n),   n = max(1, |p_in - p| / (v h), angle(q, q_in) / (omega h))
//
//   p, q, p_in, q_in  last pose and input, frame W        v, omega  kMaxToolSpeed, kMaxToolTurn        h  step [s]
#include <algorithm>
#include <cmath>

#include "physics_node/simulation/tissue_simulation.h"

namespace fulcrum::physics {
namespace {

/// Movement in a step below which a tool is at rest [m]: far below the resolution of a haptic device, 9 um.
constexpr float kToolStill = 1e-7f;

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
    track.last = appears ? tools[i].pose : track.now;
    track.now = Approach(track.last, tools[i].pose, kMaxToolSpeed * step_s(), kMaxToolTurn * step_s());
  }
}

void TissueSimulation::UpdateGrasps() {
  for (std::size_t i = 0; i < kMaxTools; ++i) {
    const ToolTrack& track = tracks_[i];
    if (track.present) {
      grasps_[i].Update(scene_.tools[i], track.now, model_, &particles_);
    } else if (grasps_[i].holding()) {
      grasps_[i].Release(model_, &particles_);
    }
  }
}

void TissueSimulation::FindContacts(bool tissue_moved, float tissue_step) {
  std::array<ToolCollision::ToolMotion, kMaxTools> motions;
  for (std::size_t i = 0; i < kMaxTools; ++i) {
    if (tracks_[i].present) {
      motions[i] = {ShapeOf(scene_.tools[i], tracks_[i].last), ShapeOf(scene_.tools[i], tracks_[i].now),
                    grasps_[i].holding(), tracks_[i].now.jaw_rad < tracks_[i].last.jaw_rad};
    }
  }
  collision_.FindPairs(motions, tissue_moved, tissue_step);
}

}  // namespace fulcrum::physics
