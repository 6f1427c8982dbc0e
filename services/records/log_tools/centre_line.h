// The centre line of a hole: its course, length and width.
#pragma once

#include <vector>

#include "services/base/core/types.h"
#include "services/records/log_tools/mask.h"

namespace fulcrum::log_tools {

struct CentrePoint {
  Vec2d place = Vec2d::Zero();  ///< [texels]; texel (0, 0) is the square from (0, 0) to (1, 1).
  double width = 0;             ///< Twice the distance to the nearest living tissue [texels].
};

struct CentreLine {
  struct Stretch {
    std::vector<CentrePoint> points;
    bool closed = false;
    double length = 0;   ///< Includes the extension to the end of the hole at a free end [texels].
    double counted = 0;  ///< Its part of the cut length [texels].
  };
  std::vector<Stretch> stretches;  ///< Stretches between ends and junctions, each once.

  /// Cut length [texels]. Of the n stretches at a junction the n - 2 shortest with a free end are branches. A branch
  /// counts with four times its excess over the width of the hole, at most with its length: whether it counts does not
  /// turn on a texel.
  [[nodiscard]] double length() const {
    double sum = 0;
    for (const Stretch& stretch : stretches) sum += stretch.counted;
    return sum;
  }
};

struct CentreLineSettings {
  double smooth = 10;  ///< Width of the moving average along the line [texels].
  double spur = 3;  ///< A branch that extends no farther beyond the edge than this is roughness of the edge [texels].
};

[[nodiscard]] CentreLine FindCentreLine(const Mask& hole, const CentreLineSettings& settings = {});

}  // namespace fulcrum::log_tools
