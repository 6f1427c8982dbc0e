// Where the trocar is, from poses of a tool that was moved about it: the point that is nearest to all shafts.
#pragma once

#include <string>
#include <vector>

#include "haptics_node/device/recorded_motion.h"
#include "services/base/core/types.h"

namespace fulcrum::haptics {

struct PivotFit {
  Vec3d p_DP = Vec3d::Zero();  ///< Pivot in frame D [m].
  double residual_m = 0;       ///< Root mean square distance of the shafts from it.
  double largest_m = 0;        ///< Largest distance.
  /// Ratio of the extreme eigenvalues of the normal matrix: how much worse the pivot is known along the shaft than
  /// across it, squared. 1/tan² of the root mean square swing, nearly.
  double condition = 0;
  double swing_rad = 0;  ///< Root mean square angle of the shafts about their mean.
  std::size_t poses = 0;
  std::string refusal;  ///< Why it cannot be used and what to do; empty when it can.
};

/// At least this many poses, a condition of at most kMaxPivotCondition (a swing of 6 degrees or more), a residual of at
/// most kMaxPivotResidual_m: a tool in a trocar has 1 to 2 mm of play.
inline constexpr std::size_t kMinPivotPoses = 100;
inline constexpr double kMaxPivotCondition = 100, kMaxPivotResidual_m = 0.003;

/// Least squares Σ (I − dᵢdᵢᵀ)(P − Aᵢ) = 0 over the poses with attach point A and unit vector d along the shaft.
[[nodiscard]] PivotFit FitPivot(const std::vector<DevicePose>& poses);

}  // namespace fulcrum::haptics
