// A ball pressed into a block of the organ's tissue: the product's contact and solver against Hertz's theory for a
// layer.
#pragma once

#include <vector>

namespace fulcrum {

struct HertzPoint {
  double depth_m = 0, force_N = 0, expected_N = 0;
};

/// A ball of 10 mm radius, 0.5, 0.75 and 1 mm deep at rest, without friction, on a block of 40 x 40 x 20 mm that is
/// fixed at its base. Expected: Hertz's force with the correction of Dimitriadis et al. (Biophys. J. 82:2798, 2002) for
/// a layer that is bonded to its base. @param bricks along half of the block's side, 12 at the usual size of a cell
[[nodiscard]] std::vector<HertzPoint> PressBall(int bricks);

}  // namespace fulcrum
