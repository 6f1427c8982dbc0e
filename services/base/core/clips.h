// Where a clip of ClipState is, from the places of its three anchors.
#pragma once

#include <optional>

#include "services/base/core/messages.h"

namespace fulcrum {

inline constexpr float kMaxClipLength_m = 0.1f;  ///< Of a Clip.

struct ClipPose {
  Vec3f p_WC = Vec3f::Zero();  ///< Middle of the clip [m].
  Quatf q_WC = Quatf::Identity();
};

/// Frame A of three anchors: origin at their centre, +x from the first to the second, +z along their normal. None where
/// they are in one line or not finite.
[[nodiscard]] inline std::optional<ClipPose> AnchorFrame(const Vec3f& a, const Vec3f& b, const Vec3f& c) {
  constexpr float kLeastSine = 1e-3f;
  const Vec3f ab = b - a, ac = c - a, normal = ab.cross(ac);
  const float sides = ab.norm() * ac.norm();
  if (!(sides > 0.0f) || !(normal.norm() > kLeastSine * sides)) return std::nullopt;
  Eigen::Matrix3f axes;
  axes.col(0) = ab.normalized();
  axes.col(2) = normal.normalized();
  axes.col(1) = axes.col(2).cross(axes.col(0));
  return ClipPose{(a + b + c) / 3.0f, Quatf(axes)};
}

/// Pose of a clip whose anchors are at a, b and c [m, W].
[[nodiscard]] inline std::optional<ClipPose> PoseOf(const Clip& clip, const Vec3f& a, const Vec3f& b, const Vec3f& c) {
  const std::optional<ClipPose> anchors = AnchorFrame(a, b, c);
  if (!anchors) return std::nullopt;
  return ClipPose{anchors->p_WC + anchors->q_WC * clip.p_AC, anchors->q_WC * clip.q_AC};
}

/// Places a clip of pose `at` relative to its anchors at a, b and c. False, and unchanged, where they have no frame.
[[nodiscard]] inline bool Place(const ClipPose& at, const Vec3f& a, const Vec3f& b, const Vec3f& c, Clip* clip) {
  const std::optional<ClipPose> anchors = AnchorFrame(a, b, c);
  if (!anchors) return false;
  clip->p_AC = anchors->q_WC.conjugate() * (at.p_WC - anchors->p_WC);
  clip->q_AC = (anchors->q_WC.conjugate() * at.q_WC).normalized();
  return true;
}

}  // namespace fulcrum
