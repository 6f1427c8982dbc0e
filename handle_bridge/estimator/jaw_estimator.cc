#include "handle_bridge/estimator/jaw_estimator.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace fulcrum::handle_bridge {
namespace {

/// Distance of an interval from the mean, in standard deviations, beyond which cancellation makes the truncated moments
/// useless.
constexpr double kFarSigmas = 6.0;
/// Likelihood of such an interval, the tail of the normal distribution at 6: keeps the weight of every mode above 0.
constexpr double kFarLikelihood = 1e-9;
constexpr double kMinWeight = 1e-6;
/// Standard deviation of the rate at the first code [deg/s].
constexpr double kStartRate = 100.0;

double NormalPdf(double x) { return std::exp(-0.5 * x * x) * (std::numbers::inv_sqrtpi / std::numbers::sqrt2); }

/// P(a < X < b) of the standard normal distribution, computed from the tail without cancellation.
double NormalMass(double a, double b) {
  constexpr double kInvSqrt2 = 1.0 / std::numbers::sqrt2;
  if (a > 0) {
    return 0.5 * (std::erfc(a * kInvSqrt2) - std::erfc(b * kInvSqrt2));
  }
  return 0.5 * (std::erfc(-b * kInvSqrt2) - std::erfc(-a * kInvSqrt2));
}

}  // namespace

JawEstimator::JawEstimator(const JawEstimatorSettings& settings, const JawCalibration& calibration)
    : settings_(settings), calibration_(calibration) {
  Reset();
}

void JawEstimator::Reset() noexcept {
  started_ = false;
  mode_ = {};
  weight_.fill(1.0 / kJawModes);
}

void JawEstimator::Start(int code) noexcept {
  const double width = std::abs(calibration_.Slope(code));
  for (Mode& mode : mode_) {
    mode = {calibration_.Angle(code), 0.0, width * width / 12.0, 0.0, kStartRate * kStartRate};
  }
  mode_[0].p_rr = settings_.rate_noise_deg_s[0];
  weight_.fill(1.0 / kJawModes);
  started_ = true;
}

void JawEstimator::Mix() noexcept {
  constexpr double kOthers = kJawModes - 1;
  const double stay = 1.0 - settings_.switch_probability;
  const double move = settings_.switch_probability / kOthers;
  const std::array<Mode, kJawModes> before = mode_;
  std::array<double, kJawModes> predicted{};
  for (std::size_t j = 0; j < kJawModes; ++j) {
    std::array<double, kJawModes> share{};
    for (std::size_t i = 0; i < kJawModes; ++i) {
      share[i] = weight_[i] * (i == j ? stay : move);
      predicted[j] += share[i];
    }
    Mode mixed;
    for (std::size_t i = 0; i < kJawModes; ++i) {
      share[i] /= predicted[j];
      mixed.angle += share[i] * before[i].angle;
      mixed.rate += share[i] * before[i].rate;
    }
    for (std::size_t i = 0; i < kJawModes; ++i) {
      const double da = before[i].angle - mixed.angle;
      const double dr = before[i].rate - mixed.rate;
      mixed.p_aa += share[i] * (before[i].p_aa + da * da);
      mixed.p_ar += share[i] * (before[i].p_ar + da * dr);
      mixed.p_rr += share[i] * (before[i].p_rr + dr * dr);
    }
    mode_[j] = mixed;
  }
  weight_ = predicted;
}

void JawEstimator::Propagate() noexcept {
  const double dt = settings_.dt_s;
  for (std::size_t j = 0; j < kJawModes; ++j) {
    Mode& m = mode_[j];
    const double keep = j == 0 ? 1.0 - settings_.hold_leak_per_s * dt : 1.0;
    m.angle += dt * m.rate;
    m.rate *= keep;
    m.p_aa += dt * (2.0 * m.p_ar + dt * m.p_rr);
    m.p_ar = keep * (m.p_ar + dt * m.p_rr);
    m.p_rr *= keep * keep;
    // A rate change q that is linear over the period moves the angle by q dt / 2.
    const double q = settings_.rate_noise_deg_s[j];
    m.p_aa += 0.25 * dt * dt * q * q;
    m.p_ar += 0.5 * dt * q * q;
    m.p_rr += q * q;
  }
}

void JawEstimator::Observe(double low_deg, double high_deg, double noise_deg) noexcept {
  double total = 0;
  for (std::size_t j = 0; j < kJawModes; ++j) {
    Mode& m = mode_[j];
    const double s = m.p_aa + noise_deg * noise_deg;
    const double root = std::sqrt(s);
    const double alpha = (low_deg - m.angle) / root;
    const double beta = (high_deg - m.angle) / root;
    double likelihood = kFarLikelihood;
    double mean = 0;    // Mean of the truncated standard normal, and
    double shrink = 0;  // its variance.
    if (alpha > kFarSigmas || beta < -kFarSigmas) {
      mean = alpha > kFarSigmas ? alpha : beta;  // The nearer edge of the interval.
    } else {
      likelihood = std::max(NormalMass(alpha, beta), kFarLikelihood);
      const double pdf_a = NormalPdf(alpha);
      const double pdf_b = NormalPdf(beta);
      mean = std::clamp((pdf_a - pdf_b) / likelihood, alpha, beta);
      shrink = std::clamp(1.0 + (alpha * pdf_a - beta * pdf_b) / likelihood - mean * mean, 0.0, 1.0);
    }
    const double k_a = m.p_aa / s;
    const double k_r = m.p_ar / s;
    m.angle += k_a * root * mean;
    m.rate += k_r * root * mean;
    const double gain = s * (1.0 - shrink);
    m.p_aa -= k_a * k_a * gain;
    m.p_ar -= k_a * k_r * gain;
    m.p_rr -= k_r * k_r * gain;
    weight_[j] = std::max(weight_[j] * likelihood, 1e-300);
    total += weight_[j];
  }
  double kept = 0;
  for (double& w : weight_) {
    w = std::max(w / total, kMinWeight);
    kept += w;
  }
  for (double& w : weight_) {
    w /= kept;
  }
}

void JawEstimator::Predict() noexcept {
  if (started_) {
    Mix();
    Propagate();
  }
}

void JawEstimator::Update(int code) noexcept {
  if (!started_) {
    Start(code);
    return;
  }
  Mix();
  Propagate();
  double low = calibration_.Angle(code - 0.5);
  double high = calibration_.Angle(code + 0.5);
  if (low > high) {
    std::swap(low, high);
  }
  const double noise = settings_.noise_V / settings_.adc_step_V * std::abs(calibration_.Slope(code));
  Observe(low, high, noise);
}

void JawEstimator::Hold() noexcept {
  const double angle = estimate().angle_deg;
  for (Mode& mode : mode_) {
    mode = {angle, 0.0, mode.p_aa, 0.0, kStartRate * kStartRate};
  }
}

JawEstimate JawEstimator::estimate() const noexcept {
  JawEstimate e;
  for (std::size_t j = 0; j < kJawModes; ++j) {
    e.angle_deg += weight_[j] * mode_[j].angle;
    e.rate_deg_s += weight_[j] * mode_[j].rate;
  }
  e.angle_deg = std::clamp(e.angle_deg, calibration_.min_angle(), calibration_.max_angle());
  return e;
}

}  // namespace fulcrum::handle_bridge
