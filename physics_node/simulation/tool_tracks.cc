// Motion of the tools in a step, and what follows from it directly: grasps and contact pairs.
//
//   p' = p + (p_in - p) / n,   q' = slerp(q, q_in, 1 / n),   n = max(1, |p_in - p| / (v h), angle(q, q_in) / (omega h))
//
//   jaw' = jaw limited to [jaw_in - kJawPlay_rad, jaw_in]
//
//   p, q, p_in, q_in  last pose and input, frame W        v, omega  kMaxToolSpeed, kMaxToolTurn        h  step [s]
#include <algorithm>
#include <cmath>
#include <span>

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

/// Reach of a clip to both sides of a line of nodes, in cells: the next lines, also of a sheet that is stretched by a
/// fifth.
constexpr float kBesideCells = 1.2f;

/// Longest side of the cells at nodes of one row or one column of a sheet [m]; 0 where the tissue is not that.
float CellOfLine(std::span<const Index> tissue, const TissueScene& scene) {
  const Index first = scene.membrane.first, cols = scene.membrane.cols;
  bool row = !tissue.empty(), col = row;
  float cell = 0;
  for (const Index p : tissue) {
    if (p < first) return 0;
    row = row && (p - first) / cols == (tissue[0] - first) / cols;
    col = col && (p - first) % cols == (tissue[0] - first) % cols;
    for (std::size_t d = 0; d < 2; ++d) cell = std::max(cell, scene.membrane_rest_length[3 * (p - first) + d]);
  }
  return row || col ? cell : 0;
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
      const bool was_open = grasps_[i].state() == Grasp::State::kOpen;
      grasps_[i].Update(scene_.tools[i], track.now, model_, &particles_);
      const bool closes = was_open && grasps_[i].state() != Grasp::State::kOpen;
      if (scene_.tools[i].kind == ToolKind::kClipApplier && closes) ApplyClip(i);
    } else if (grasps_[i].holding()) {
      grasps_[i].Release(model_, &particles_);
    }
  }
}

/// What other tools hold is clipped as well: the vessel is closed beside the grasper that steadies it.
void TissueSimulation::ApplyClip(std::size_t tool) {
  const ToolDescription& applier = scene_.tools[tool];
  const ToolPose& pose = tracks_[tool].now;
  const float jaw = std::min(applier.tip_radius_m, scene_.physics.grasp_radius_m);
  std::vector<Index> tissue = Grasp::InJaws(applier, pose, jaw, model_, particles_);
  // Jaws that lie along a row or column of a sheet whose cells are wider than they are hold that line alone. They have
  // pressed together what lies beside it too.
  if (const float cell = CellOfLine(tissue, scene_); cell > 0.0f) {
    for (const Index p : Grasp::InJaws(applier, pose, std::max(jaw, kBesideCells * cell), model_, particles_)) {
      const bool is_new = p >= scene_.membrane.first && std::ranges::find(tissue, p) == tissue.end();
      if (is_new) tissue.push_back(p);
    }
  }
  // The vertices of a duct may all lie beside the jaws that have closed on it.
  if (tissue.size() < kLeastClipped) {
    for (const Index p : Grasp::AcrossJaws(applier, pose, jaw, scene_.tube_surface, model_, particles_)) {
      if (std::ranges::find(tissue, p) == tissue.end()) tissue.push_back(p);
    }
  }
  if (tissue.empty()) return;
  (void)clips_.Apply(static_cast<std::uint8_t>(tool), applier, pose, tissue, particles_);
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
