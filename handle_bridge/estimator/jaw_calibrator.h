// Computes the calibration of a handle from holds at known angles.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace fulcrum::handle_bridge {

/// Stored form of a calibration: the points of JawCalibration.
struct CalibrationPoints {
  std::vector<double> codes;       ///< [counts], strictly rising.
  std::vector<double> angles_deg;  ///< Strictly monotone.
};

/// Collects holds, one per angle. If noise and tremor move the voltage by only a fifth of a count, the mean of the
/// codes has an error of up to 0.13 counts (0.23 deg). So the position of each hold between the codes is estimated from
/// the histogram of its codes, as the posterior mean. Model: normally distributed readings with one unknown standard
/// deviation for all holds, which share hand and converter; its prior is uniform in the logarithm.
class JawCalibrator {
 public:
  /// Largest standard deviation of a hold [counts]: 1.3 deg of an unsteady hand.
  static constexpr double kMaxSpread = 0.75;
  /// Smallest distance of neighbours [counts]: below it the converter's quantisation dominates the slope.
  static constexpr double kMinGap = 4;
  static constexpr std::size_t kMinCodes = 100;  ///< Smallest number of readings of a hold.

  /// Adds a hold at an angle that no other hold has. Returns an empty text if it is accepted, otherwise the reason in
  /// one line for people.
  [[nodiscard]] std::string Add(double angle_deg, std::span<const int> codes);
  [[nodiscard]] std::size_t size() const { return holds_.size(); }
  /// Points in ascending order of their codes. @pre size() >= 2
  [[nodiscard]] CalibrationPoints Solve() const;

 private:
  struct Hold {
    double angle_deg = 0;
    double mean_code = 0;
    int first_code = 0;
    std::vector<int> counts;  ///< Number of readings of first_code, first_code + 1, …
  };
  std::vector<Hold> holds_;
};

}  // namespace fulcrum::handle_bridge
