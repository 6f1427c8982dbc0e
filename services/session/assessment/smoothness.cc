#include "services/session/assessment/smoothness.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <complex>
#include <limits>
#include <unsupported/Eigen/FFT>
#include <vector>

namespace fulcrum::assessment {
namespace {

constexpr double kHighest_Hz = 10;
constexpr double kLeastMagnitude = 0.05;
/// The spectrum is sampled 2^4 times finer than the length of the movement requires, so that the curve is smooth.
constexpr int kPaddingLevel = 4;

}  // namespace

double SpectralArcLength(std::span<const double> speed, double rate_Hz) {
  const double none = std::numeric_limits<double>::quiet_NaN();
  if (speed.size() < 2) return none;
  std::vector<double> padded(std::bit_ceil(speed.size()) << kPaddingLevel, 0.0);
  std::copy(speed.begin(), speed.end(), padded.begin());
  std::vector<std::complex<double>> spectrum;
  Eigen::FFT<double> fft;
  fft.SetFlag(Eigen::FFT<double>::HalfSpectrum);
  fft.fwd(spectrum, padded);
  const double step_Hz = rate_Hz / static_cast<double>(padded.size());
  const auto count = std::min(spectrum.size(), static_cast<std::size_t>(kHighest_Hz / step_Hz) + 1);
  double largest = 0;
  for (const auto& value : spectrum) largest = std::max(largest, std::abs(value));
  if (!(largest > 0)) return none;
  std::size_t last = 0;
  for (std::size_t i = 0; i < count; ++i) {
    if (std::abs(spectrum[i]) >= kLeastMagnitude * largest) last = i;
  }
  if (last == 0) return none;
  double length = 0;
  for (std::size_t i = 1; i <= last; ++i) {
    const double rise = (std::abs(spectrum[i]) - std::abs(spectrum[i - 1])) / largest;
    length += std::hypot(1.0 / static_cast<double>(last), rise);
  }
  return -length;
}

}  // namespace fulcrum::assessment
