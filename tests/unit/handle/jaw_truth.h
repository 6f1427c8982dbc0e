// True jaw motions of a hand on a handle, for tests and benchmarks of the estimator.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

namespace fulcrum::handle_bridge {

/// Holds and minimum-jerk moves with a physiological tremor over both, sampled at the firmware's 400 Hz.
struct JawTruth {
  std::vector<double> angle_deg;
  std::vector<bool> moving;  ///< Within a minimum-jerk move.
};

inline constexpr double kTruthRate_Hz = 400.0;

/// @param moves false: one still hold. true: moves of 5 to 50 degrees in 0.25 to 1 s, each followed by a hold of at
/// most 0.5 s.
inline JawTruth MakeJawTruth(double seconds, bool moves, std::uint64_t seed) {
  constexpr double kTremor_deg = 0.25;  // Amplitude; two tones within the 8 to 12 Hz of physiological tremor.
  constexpr double kLow_deg = 3, kHigh_deg = 57;
  std::mt19937_64 random(seed);
  const auto uniform = [&random](double a, double b) { return std::uniform_real_distribution<double>(a, b)(random); };
  const double f1 = uniform(8, 10), f2 = uniform(10, 12), phase1 = uniform(0, 6.28), phase2 = uniform(0, 6.28);
  JawTruth truth;
  double from = uniform(kLow_deg, kHigh_deg), to = from, start = 0, duration = 0, hold = 0;
  const auto n = static_cast<std::size_t>(seconds * kTruthRate_Hz);
  for (std::size_t i = 0; i < n; ++i) {
    const double t = static_cast<double>(i) / kTruthRate_Hz;
    if (moves && t >= start + duration + hold) {
      from = to;
      const double size = uniform(5, 50);
      to = from + size <= kHigh_deg && (from - size < kLow_deg || uniform(0, 1) < 0.5) ? from + size : from - size;
      to = std::clamp(to, kLow_deg, kHigh_deg);
      start = t;
      duration = uniform(0.25, 1.0);
      hold = uniform(0, 0.5);
    }
    const double u = duration > 0 ? std::clamp((t - start) / duration, 0.0, 1.0) : 1.0;
    const double s = u * u * u * (10 + u * (-15 + 6 * u));
    const double tremor =
        0.5 * kTremor_deg *
        (std::sin(2 * std::numbers::pi * f1 * t + phase1) + std::sin(2 * std::numbers::pi * f2 * t + phase2));
    truth.angle_deg.push_back(from + s * (to - from) + tremor);
    truth.moving.push_back(u < 1.0);
  }
  return truth;
}

/// Delay of `estimate` behind `truth` [samples, fractions by parabola]: the shift with the least RMS difference.
inline double LagSamples(const std::vector<double>& truth, const std::vector<double>& estimate) {
  constexpr int kMaxLag = 40;
  std::vector<double> error;
  for (int lag = -kMaxLag; lag <= kMaxLag; ++lag) {
    double sum = 0;
    for (int i = 2 * kMaxLag; i + 2 * kMaxLag < static_cast<int>(truth.size()); ++i) {
      const double e = estimate[static_cast<std::size_t>(i)] - truth[static_cast<std::size_t>(i - lag)];
      sum += e * e;
    }
    error.push_back(sum);
  }
  const auto best =
      std::clamp<std::ptrdiff_t>(std::min_element(error.begin(), error.end()) - error.begin(), 1, 2 * kMaxLag - 1);
  const auto k = static_cast<std::size_t>(best);
  const double curvature = error[k - 1] - 2 * error[k] + error[k + 1];
  return static_cast<double>(best - kMaxLag) + 0.5 * (error[k - 1] - error[k + 1]) / curvature;
}

}  // namespace fulcrum::handle_bridge
