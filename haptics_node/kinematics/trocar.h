// Kinematics of a tool that turns about its trocar (the fulcrum), held from outside.
//
//     A  attach point: what the device moves and pushes (the handle)
//      \  l_h = |P - A|
//       P  pivot, fixed in W
//        \  l_t = L - l_h
//         T  tip = P + l_t d,   d = (P - A) / l_h: z axis of the tool frame
#pragma once

#include <Eigen/Core>

#include "services/base/core/types.h"

namespace fulcrum::haptics {

/// Lower limit of the shaft's length outside and inside [m]: near the pivot a small motion of the hand would turn the
/// shaft by a large angle.
inline constexpr double kMinShaftPart_m = 0.015;

struct Trocar {
  Vec3d p_WP = Vec3d::Zero();  ///< Pivot [m].
  double length_m = 0.3;       ///< L: from attach point to tip; more than 2 * kMinShaftPart_m.
};

struct TrocarPose {
  Vec3d p_WT = Vec3d::Zero();                       ///< Tip [m].
  Vec3d d_W = -Vec3d::UnitZ();                      ///< Unit vector along the shaft, from the pivot to the tip.
  Eigen::Matrix3d J = Eigen::Matrix3d::Identity();  ///< d(tip)/d(attach point); symmetric.
};

/// Forward kinematics. J = -(l_t / l_h)(I - d d^T) + d d^T: lateral motion is inverted and scaled (the fulcrum effect),
/// axial motion is transmitted unchanged. Where a part is clamped, J has no component along the shaft.
[[nodiscard]] TrocarPose PoseFromAttachPoint(const Trocar& trocar, const Vec3d& p_WA) noexcept;

/// Attach point for a tip at `p_WT`, with the lengths clamped as above; for a tip at the pivot the shaft points down.
[[nodiscard]] Vec3d AttachPointForTip(const Trocar& trocar, const Vec3d& p_WT) noexcept;

/// Largest |J^T n| over all unit vectors n: largest ratio of the force at the hand to that at the tip.
[[nodiscard]] double LargestLever(const TrocarPose& pose) noexcept;

/// Force at the attach point that does the same work as `f_T` at the tip: J^T f_T, hence f_A . v_A = f_T . v_T.
[[nodiscard]] inline Vec3d ForceAtAttachPoint(const TrocarPose& pose, const Vec3d& f_T) noexcept {
  return pose.J.transpose() * f_T;
}

/// Tip force that is felt as `f_A` at the attach point: the inverse of the above where no length is clamped. If one is,
/// the tip does not move along the shaft and the axial component is 0.
[[nodiscard]] Vec3d ForceAtTip(const TrocarPose& pose, const Vec3d& f_A) noexcept;

}  // namespace fulcrum::haptics
