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

/// Neither the part outside nor the part inside gets shorter than this: near the pivot a small motion of the hand would
/// be a wild one of the shaft [m].
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

/// Forward kinematics. J = -(l_t / l_h)(I - d d^T) + d d^T: sideways motion is inverted and scaled (the fulcrum
/// effect), motion along the shaft passes. Where a part is clamped, J has no component along the shaft.
[[nodiscard]] TrocarPose PoseFromAttachPoint(const Trocar& trocar, const Vec3d& p_WA) noexcept;

/// The attach point that puts the tip at `p_WT`, clamped as above; a tip at the pivot itself points downwards.
[[nodiscard]] Vec3d AttachPointForTip(const Trocar& trocar, const Vec3d& p_WT) noexcept;

/// Largest |J^T n| of any direction n: how much of a tip force the hand may feel.
[[nodiscard]] double LargestLever(const TrocarPose& pose) noexcept;

/// Force at the attach point that does the work of `f_T` at the tip: J^T f_T, hence f_A . v_A = f_T . v_T.
[[nodiscard]] inline Vec3d ForceAtAttachPoint(const TrocarPose& pose, const Vec3d& f_T) noexcept {
  return pose.J.transpose() * f_T;
}

/// The tip force that is felt as `f_A` at the attach point: the inverse of the above off the clamps. Along a clamped
/// shaft, where the tip does not move, there is none.
[[nodiscard]] Vec3d ForceAtTip(const TrocarPose& pose, const Vec3d& f_A) noexcept;

/// Orientation of the tool frame: z along the shaft, x the projection of `x_reference` on the plane normal to it.
/// @pre x_reference is a unit vector; a shaft along it gets any x.
[[nodiscard]] Eigen::Quaterniond ToolOrientation(const Vec3d& d_W, const Vec3d& x_reference) noexcept;

}  // namespace fulcrum::haptics
