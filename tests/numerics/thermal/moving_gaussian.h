// A Gaussian heat source that moves over the sheet, against its exact integral in time.
#pragma once

namespace fulcrum::thermal {

struct MovingGaussianResult {
  double max_error = 0;  ///< Relative to the highest exact temperature.
  double step_ms = 0;    ///< Median of one frame: source, conduction, source.
  int tiles = 0;
};

/// s = 0.25 mm, 10 mm/s, window of 9.6 mm, frames of 10 ms for 0.4 s, without losses; half of each frame's swept source
/// before the conduction and half after.
MovingGaussianResult RunMovingGaussian(float cell_m);

}  // namespace fulcrum::thermal
