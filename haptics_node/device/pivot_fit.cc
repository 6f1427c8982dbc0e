#include "haptics_node/device/pivot_fit.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>

namespace fulcrum::haptics {
namespace {

Mat3d AcrossShaft(const Vec3d& d) { return Mat3d::Identity() - d * d.transpose(); }

std::string Refusal(const PivotFit& fit) {
  char text[200] = "";
  if (fit.poses < kMinPivotPoses) {
    std::snprintf(text, sizeof(text),
                  "only %zu poses; valid: %zu or more: hold the button down while the tool is in the trocar and moves",
                  fit.poses, kMinPivotPoses);
  } else if (!(fit.condition <= kMaxPivotCondition)) {
    std::snprintf(text, sizeof(text),
                  "the motion was too small: the shaft swung by %.1f deg (RMS), condition %.0f; valid: at most %.0f; "
                  "swing the tool wider, in both directions",
                  fit.swing_rad * 180 / std::numbers::pi, std::min(fit.condition, 1e9), kMaxPivotCondition);
  } else if (!(fit.residual_m <= kMaxPivotResidual_m)) {
    std::snprintf(
        text, sizeof(text),
        "the shafts pass one point by %.1f mm (RMS); valid: at most %.1f mm; keep the tool in the trocar, and "
        "check that device and trocar stand firm",
        1e3 * fit.residual_m, 1e3 * kMaxPivotResidual_m);
  }
  return text;
}

}  // namespace

PivotFit FitPivot(const std::vector<DevicePose>& poses) {
  PivotFit fit;
  fit.poses = poses.size();
  fit.condition = std::numeric_limits<double>::infinity();
  if (poses.size() < kMinPivotPoses) {
    fit.refusal = Refusal(fit);
    return fit;
  }
  const double share = 1.0 / static_cast<double>(poses.size());
  Mat3d normal = Mat3d::Zero();
  Vec3d right = Vec3d::Zero();
  for (const DevicePose& pose : poses) {
    const Mat3d across = share * AcrossShaft(pose.d_D);
    normal += across;
    right += across * pose.p_D;
  }
  const Eigen::SelfAdjointEigenSolver<Mat3d> eigen(normal);
  // The smallest eigenvalue is the mean squared sine of the angle between the shafts and their common axis.
  const double smallest = std::max(0.0, eigen.eigenvalues()[0]), largest = eigen.eigenvalues()[2];
  fit.swing_rad = std::asin(std::sqrt(std::min(1.0, smallest)));
  if (smallest > 0) fit.condition = largest / smallest;
  if (fit.condition <= kMaxPivotCondition) {
    fit.p_DP = normal.ldlt().solve(right);
    double sum = 0;
    for (const DevicePose& pose : poses) {
      const double squared = (AcrossShaft(pose.d_D) * (fit.p_DP - pose.p_D)).squaredNorm();
      sum += share * squared;
      fit.largest_m = std::max(fit.largest_m, std::sqrt(squared));
    }
    fit.residual_m = std::sqrt(sum);
  }
  fit.refusal = Refusal(fit);
  return fit;
}

}  // namespace fulcrum::haptics
