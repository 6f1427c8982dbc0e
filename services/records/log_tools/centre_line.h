// The centre line of a hole: where it runs, how long and how wide it is.
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
    double length = 0;  ///< To the end of the hole where it ends [texels].
  };
  std::vector<Stretch> stretches;  ///< Between ends and junctions; each is there once.

  [[nodiscard]] double length() const {
    double sum = 0;
    for (const Stretch& stretch : stretches) sum += stretch.length;
    return sum;
  }
};

struct CentreLineSettings {
  double smooth = 10;  ///< Width of the moving average along the line [texels].
  double spur = 3;     ///< What reaches no more than this beyond the edge is roughness of the edge [texels].
};

[[nodiscard]] CentreLine FindCentreLine(const Mask& hole, const CentreLineSettings& settings = {});

}  // namespace fulcrum::log_tools
