#include "haptics_node/kinematics/trocar.h"

#include <algorithm>
#include <cmath>

namespace fulcrum::haptics {

TrocarPose PoseFromAttachPoint(const Trocar& trocar, const Vec3d& p_WA) noexcept {
  TrocarPose pose;
  const Vec3d shaft = trocar.p_WP - p_WA;
  const double distance = shaft.norm();
  if (distance > 0.0) pose.d_W = shaft / distance;
  const double outside = std::clamp(distance, kMinShaftPart_m, trocar.length_m - kMinShaftPart_m);
  const double inside = trocar.length_m - outside;
  pose.p_WT = trocar.p_WP + inside * pose.d_W;
  const Eigen::Matrix3d along = pose.d_W * pose.d_W.transpose();
  pose.J = -(inside / std::max(distance, kMinShaftPart_m)) * (Eigen::Matrix3d::Identity() - along);
  if (outside == distance) pose.J += along;
  return pose;
}

Vec3d AttachPointForTip(const Trocar& trocar, const Vec3d& p_WT) noexcept {
  const Vec3d reach = p_WT - trocar.p_WP;
  const double distance = reach.norm();
  const Vec3d d = distance > 0.0 ? Vec3d(reach / distance) : Vec3d(-Vec3d::UnitZ());
  const double inside = std::clamp(distance, kMinShaftPart_m, trocar.length_m - kMinShaftPart_m);
  return trocar.p_WP - (trocar.length_m - inside) * d;
}

namespace {

/// J is diagonal in the frame of the shaft: `across` in the two directions normal to d, `along` in d itself.
struct Levers {
  double along, across;
  explicit Levers(const TrocarPose& pose) noexcept
      : along(pose.d_W.dot(pose.J * pose.d_W)), across(0.5 * (pose.J.trace() - along)) {}
};

}  // namespace

double LargestLever(const TrocarPose& pose) noexcept {
  const Levers lever(pose);
  return std::max(std::abs(lever.along), std::abs(lever.across));
}

Vec3d ForceAtTip(const TrocarPose& pose, const Vec3d& f_A) noexcept {
  const auto [along, across] = Levers(pose);
  const double f_along = pose.d_W.dot(f_A);
  Vec3d f_T = (f_A - f_along * pose.d_W) / across;
  if (along > 0.5) f_T += f_along * pose.d_W;  // `along` is 1, or 0 if a length is clamped.
  return f_T;
}

}  // namespace fulcrum::haptics
