// Transformation between the frame D of a haptic device and the world W. The trocar is the common point: its place in D
// is calibrated, its place in W is given by the scene.
//
//     p_W = p_WP + scale R_WD (p_D - p_DP)        f_D = R_WD^T f_W
#pragma once

#include "services/base/core/types.h"

namespace fulcrum::haptics {

struct WorkspaceMap {
  Mat3d R_WD = Mat3d::Identity();
  double scale = 1;            ///< Motion of the tool per motion of the hand.
  Vec3d p_DP = Vec3d::Zero();  ///< Trocar in frame D [m].
  Vec3d p_WP = Vec3d::Zero();  ///< Trocar in frame W [m].

  [[nodiscard]] Vec3d ToWorld(const Vec3d& p_D) const { return p_WP + scale * (R_WD * (p_D - p_DP)); }
  [[nodiscard]] Vec3d ForceToDevice(const Vec3d& f_W) const { return R_WD.transpose() * f_W; }
};

/// Rotation about the fixed axes X, then Y, then Z [rad].
[[nodiscard]] inline Mat3d RotationFromAngles(const Vec3d& angles_rad) {
  return (Eigen::AngleAxisd(angles_rad.z(), Vec3d::UnitZ()) * Eigen::AngleAxisd(angles_rad.y(), Vec3d::UnitY()) *
          Eigen::AngleAxisd(angles_rad.x(), Vec3d::UnitX()))
      .toRotationMatrix();
}

}  // namespace fulcrum::haptics
