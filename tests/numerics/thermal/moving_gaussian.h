// A Gaussian heat source that moves over the sheet, against its exact integral in time.
#pragma once

namespace fulcrum::thermal {

/// s = 0.25 mm, a path of 4 mm in a window of 9.6 mm, frames of 10 ms, without losses. Coordinates [m] from the
/// window's corner; the tip moves along x from `kStart` at time 0.
struct MovingGaussian {
  static constexpr double kWidth = 2.5e-4, kWindow = 9.6e-3, kStart = 2.8e-3, kRow = 4.8e-3, kWay = 4e-3;
  static constexpr double kDt = 0.01;

  double speed_m_s = 0.01;
  double diffusivity_m2_s = 1.26e-7;

  [[nodiscard]] int frames() const;
  /// Heating in the middle of the source [K/s].
  [[nodiscard]] double PeakRate() const;
  /// Heating at (x, y) at a time [K/s].
  [[nodiscard]] double Rate(double x, double y, double time_s) const;
  /// theta(x, y, T) = int_0^T PeakRate s^2/(s^2 + 2 alpha (T - t)) exp(...) dt [K], by Simpson's rule on a fine grid.
  [[nodiscard]] double Exact(double x, double y, double time_s) const;
};

struct MovingGaussianResult {
  double max_error = 0;  ///< Relative to the highest exact temperature.
  double step_ms = 0;    ///< Median of the conduction of one frame.
  int tiles = 0;
};

/// Half of each frame's swept source before the conduction and half after.
MovingGaussianResult RunMovingGaussian(float cell_m, double speed_m_s = 0.01);

}  // namespace fulcrum::thermal
