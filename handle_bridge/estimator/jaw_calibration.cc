#include "handle_bridge/estimator/jaw_calibration.h"

#include <algorithm>
#include <stdexcept>

namespace fulcrum::handle_bridge {

JawCalibration::JawCalibration(std::span<const double> codes, std::span<const double> angles_deg)
    : count_(codes.size()) {
  const std::size_t n = codes.size();
  if (n < 2 || n > kMaxPoints || n != angles_deg.size()) {
    throw std::invalid_argument("a jaw calibration has 2 to 9 points");
  }
  std::copy(codes.begin(), codes.end(), codes_.begin());
  std::copy(angles_deg.begin(), angles_deg.end(), angles_.begin());
  std::array<double, kMaxPoints> chord{};
  for (std::size_t i = 0; i + 1 < n; ++i) {
    chord[i] = (angles_[i + 1] - angles_[i]) / (codes_[i + 1] - codes_[i]);
    if (!(codes_[i + 1] > codes_[i]) || !(chord[i] * chord[0] > 0)) {
      throw std::invalid_argument("a jaw calibration is strictly monotone");
    }
  }
  for (std::size_t i = 1; i + 1 < n; ++i) {
    const double h0 = codes_[i] - codes_[i - 1];
    const double h1 = codes_[i + 1] - codes_[i];
    const double weight = (h0 + 2 * h1) / (3 * (h0 + h1));
    slopes_[i] = chord[i - 1] * chord[i] / (weight * chord[i] + (1 - weight) * chord[i - 1]);
  }
  // Ends: one-sided three-point slope, limited to between 0 and three times the slope of the chord, so that the end
  // pieces stay monotone.
  const auto end_slope = [](double h0, double h1, double d0, double d1) {
    const double slope = ((2 * h0 + h1) * d0 - h0 * d1) / (h0 + h1);
    return std::clamp(slope / d0, 0.1, 3.0) * d0;
  };
  slopes_[0] = chord[0];
  slopes_[n - 1] = chord[n - 2];
  if (n > 2) {
    slopes_[0] = end_slope(codes_[1] - codes_[0], codes_[2] - codes_[1], chord[0], chord[1]);
    slopes_[n - 1] =
        end_slope(codes_[n - 1] - codes_[n - 2], codes_[n - 2] - codes_[n - 3], chord[n - 2], chord[n - 3]);
  }
}

std::size_t JawCalibration::Segment(double code) const noexcept {
  std::size_t i = 0;
  while (i + 2 < count_ && code > codes_[i + 1]) {
    ++i;
  }
  return i;
}

double JawCalibration::Angle(double code) const noexcept {
  const auto last = count_ - 1;
  if (code <= codes_[0]) {
    return angles_[0] + slopes_[0] * (code - codes_[0]);
  }
  if (code >= codes_[last]) {
    return angles_[last] + slopes_[last] * (code - codes_[last]);
  }
  const auto i = Segment(code);
  const double h = codes_[i + 1] - codes_[i];
  const double t = (code - codes_[i]) / h;
  const double s = 1 - t;
  return angles_[i] * s * s * (1 + 2 * t) + angles_[i + 1] * t * t * (1 + 2 * s) + h * slopes_[i] * t * s * s -
         h * slopes_[i + 1] * s * t * t;
}

double JawCalibration::Slope(double code) const noexcept {
  const auto last = count_ - 1;
  if (code <= codes_[0]) {
    return slopes_[0];
  }
  if (code >= codes_[last]) {
    return slopes_[last];
  }
  const auto i = Segment(code);
  const double h = codes_[i + 1] - codes_[i];
  const double t = (code - codes_[i]) / h;
  return 6 * t * (1 - t) * (angles_[i + 1] - angles_[i]) / h + slopes_[i] * (1 - t) * (1 - 3 * t) +
         slopes_[i + 1] * t * (3 * t - 2);
}

double JawCalibration::min_angle() const noexcept { return std::min(angles_[0], angles_[count_ - 1]); }

double JawCalibration::max_angle() const noexcept { return std::max(angles_[0], angles_[count_ - 1]); }

}  // namespace fulcrum::handle_bridge
