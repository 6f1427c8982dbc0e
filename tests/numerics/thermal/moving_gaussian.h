// A Gaussian heat source that moves over the sheet, against its exact integral in time.
#pragma once

namespace fulcrum::thermal {

struct MovingGaussianResult {
  double max_error = 0;  ///< Relative to the highest exact temperature.
  double step_ms = 0;    ///< Median of one frame: source, conduction, source.
  int tiles = 0;
};

/// s = 0.25 mm, 4 mm of way in a window of 9.6 mm, frames of 10 ms, without losses; half of each frame's swept source
/// before the conduction and half after.
MovingGaussianResult RunMovingGaussian(float cell_m, double speed_m_s = 0.01);

}  // namespace fulcrum::thermal
