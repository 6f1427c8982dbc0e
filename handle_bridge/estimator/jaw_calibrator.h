// Finds the calibration of a handle from holds at known angles.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace fulcrum::handle_bridge {

/// A calibration as it is stored: points of JawCalibration.
struct CalibrationPoints {
  std::vector<double> codes;       ///< [counts], strictly rising.
  std::vector<double> angles_deg;  ///< Strictly monotone.
};

/// Takes one hold after the other. A mean of codes is wrong by up to 0.13 counts (0.23 deg) when noise and tremor move
/// the voltage by only a fifth of a count: what counts is how often each code came. So the place of each hold is the
/// mean of its posterior given the histogram of its codes, with one unknown spread (normal, standard deviation even in
/// its logarithm) for all holds together, which are the same hand and the same converter.
class JawCalibrator {
 public:
  static constexpr double kMaxSpread = 0.75;  ///< Counts, standard deviation of a hold: 1.3 deg of an unsteady hand.
  static constexpr double kMinGap = 4;        ///< Counts between neighbours: closer, and the converter makes the slope.
  static constexpr std::size_t kMinCodes = 100;

  /// A hold at this angle. Returns an empty string when it was taken, else why not, in one line for people.
  [[nodiscard]] std::string Add(double angle_deg, std::span<const int> codes);
  [[nodiscard]] std::size_t size() const { return holds_.size(); }
  /// The points in the order of their codes. @pre size() >= 2
  [[nodiscard]] CalibrationPoints Solve() const;

 private:
  struct Hold {
    double angle_deg = 0;
    double mean_code = 0;
    int first_code = 0;
    std::vector<int> counts;  ///< How often first_code, first_code + 1, … came.
  };
  std::vector<Hold> holds_;
};

}  // namespace fulcrum::handle_bridge
