// Position of the trocar from poses of a tool that was moved about it: the least-squares intersection of the shafts.
#pragma once

#include <string>
#include <vector>

#include "haptics_node/device/recorded_motion.h"
#include "services/base/core/types.h"

namespace fulcrum::haptics {

struct PivotFit {
  Vec3d p_DP = Vec3d::Zero();  ///< Pivot in frame D [m].
  double residual_m = 0;       ///< Root mean square distance of the shafts from the pivot.
  double largest_m = 0;        ///< Largest distance.
  /// Condition number of the normal matrix: the squared ratio of the pivot's uncertainty along the shaft to that across
  /// it. About 1/tan² of the root mean square swing.
  double condition = 0;
  double swing_rad = 0;  ///< Root mean square angle of the shafts about their mean.
  std::size_t poses = 0;
  std::string refusal;  ///< Why the fit is rejected and what to do; empty if it is valid.
};

/// Limits of a valid fit: number of poses, condition (100 is a swing of 6 degrees), residual (a tool in a trocar has 1
/// to 2 mm of play).
inline constexpr std::size_t kMinPivotPoses = 100;
inline constexpr double kMaxPivotCondition = 100, kMaxPivotResidual_m = 0.003;

/// Least squares Σ (I − dᵢdᵢᵀ)(P − Aᵢ) = 0 over the poses with attach point A and unit vector d along the shaft.
[[nodiscard]] PivotFit FitPivot(const std::vector<DevicePose>& poses);

}  // namespace fulcrum::haptics
