// A tool as capsules. Frame T: origin at the tip, +z along the shaft towards the tip.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "services/base/core/scene_view.h"

namespace fulcrum::physics {

enum class ToolPart : std::uint8_t { kTip, kJaw, kShaft };

struct Capsule {
  Vec3f a = Vec3f::Zero();
  Vec3f b = Vec3f::Zero();
  float radius = 0;
  ToolPart part = ToolPart::kShaft;
};

/// Length of the thin neck between the foot of a hook and its shaft [m].
inline constexpr float kHookNeck = 0.012f;
inline constexpr int kMaxCapsules = 3;

struct ToolPose {
  Vec3f p_WT = Vec3f::Zero();
  Quatf q_WT = Quatf::Identity();
  float jaw_rad = 0;
  [[nodiscard]] Vec3f ToWorld(const Vec3f& p_T) const { return p_WT + q_WT * p_T; }
  [[nodiscard]] Vec3f ToTool(const Vec3f& p_W) const { return q_WT.conjugate() * (p_W - p_WT); }
};

/// Between two poses, u in [0, 1].
[[nodiscard]] ToolPose Interpolate(const ToolPose& from, const ToolPose& to, float u);

struct ToolShape {
  std::array<Capsule, kMaxCapsules> capsules;
  int count = 0;
};

/// Capsules in frame W. Hook: foot from the heel (T's origin, on the shaft axis) along +x, neck, shaft. Grasper and
/// scissors: two jaws about a hinge at -z * tip_length, opening in the x-z plane by jaw_rad / 2 each, and the shaft.
/// Suction tube: the last tip_length and the shaft, whatever its handle does.
[[nodiscard]] ToolShape ShapeOf(const ToolDescription& tool, const ToolPose& pose);

/// Distance between the surface of a capsule and the middle of a sheet of this thickness in contact [m]. For the bare
/// metal of a hook it is half the thickness, so that mechanical contact is electrical contact.
[[nodiscard]] inline float ContactMargin(const TissueScene& scene, ToolPart part, float thickness_m) {
  const float margin = scene.physics.collision_margin_m;
  return part == ToolPart::kTip ? std::min(margin, 0.5f * thickness_m) : margin;
}
/// The same of the thickness of `thermal`: of solids, and of sheets without one of their own.
[[nodiscard]] inline float ContactMargin(const TissueScene& scene, ToolPart part) {
  return ContactMargin(scene, part, scene.thermal.thickness_m);
}

/// Centre line of the jaws, from hinge to tip; of a hook: its foot.
[[nodiscard]] Capsule WorkingLine(const ToolDescription& tool, const ToolPose& pose);

}  // namespace fulcrum::physics
