// Jaw angle and rate from coarse codes: an interacting multiple model (IMM) filter whose measurement is not a number
// but the interval of angles that a code stands for. 60 degrees are only 34.8 codes, 1.72 degrees each: the filter
// resolves angles between the codes from the times at which the code changes.
#pragma once

#include <array>

#include "handle_bridge/estimator/jaw_calibration.h"

namespace fulcrum::handle_bridge {

inline constexpr int kJawModes = 3;

struct JawEstimatorSettings {
  double dt_s = 1.0 / 400.0;
  double noise_V = 1.46e-3;  ///< Standard deviation of analogue noise and tremor before the converter.
  double adc_step_V = 5.0 / 1024;
  double switch_probability = 0.018;  ///< Probability per period of leaving a mode, shared by the other modes.
  double hold_leak_per_s = 2.0;       ///< Decay of velocity in the hold mode.
  /// Velocity noise of each mode per period [deg/s]: hold, move, snap.
  std::array<double, kJawModes> rate_noise_deg_s = {0.035, 1.0, 8.0};
};

struct JawEstimate {
  double angle_deg = 0;
  double rate_deg_s = 0;
};

/// Blom and Bar-Shalom 1988 for the mixing; the interval update matches the first two moments of a Gaussian truncated
/// to the interval (a form of the Tobit Kalman filter). Every call is noexcept, without allocation, about 0.24 us.
class JawEstimator {
 public:
  JawEstimator(const JawEstimatorSettings& settings, const JawCalibration& calibration);

  /// Advances by one period whose line was lost or bad.
  void Predict() noexcept;
  /// Advances by one period with a received code.
  void Update(int code) noexcept;
  /// Keeps the angle and sets the rate to 0; for a silent link.
  void Hold() noexcept;
  /// Resets the filter: the next Update starts it again.
  void Reset() noexcept;

  /// Angle, limited to the calibrated range, and rate.
  [[nodiscard]] JawEstimate estimate() const noexcept;
  /// False until the first Update.
  [[nodiscard]] bool started() const noexcept { return started_; }
  /// Probability of each mode.
  [[nodiscard]] const std::array<double, kJawModes>& weights() const noexcept { return weight_; }

 private:
  struct Mode {
    double angle = 0, rate = 0;           // [deg], [deg/s]
    double p_aa = 0, p_ar = 0, p_rr = 0;  // Covariance.
  };
  void Start(int code) noexcept;
  void Mix() noexcept;
  void Propagate() noexcept;
  void Observe(double low_deg, double high_deg, double noise_deg) noexcept;

  JawEstimatorSettings settings_;
  JawCalibration calibration_;
  std::array<Mode, kJawModes> mode_{};
  std::array<double, kJawModes> weight_{};
  bool started_ = false;
};

}  // namespace fulcrum::handle_bridge
