#include "tests/benchmark/handle/baselines/filters.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace fulcrum::handle_bridge {
namespace {

constexpr double kDt_s = 1.0 / 400;

double NormalCdf(double x) { return 0.5 * std::erfc(-x / std::numbers::sqrt2); }

double NoiseOf(const JawCalibration& calibration, int code) {
  const JawEstimatorSettings settings;
  return settings.noise_V / settings.adc_step_V * std::abs(calibration.Slope(code));
}

}  // namespace

double MovingAverage::Update(int code) {
  ring_[count_++ % ring_.size()] = calibration_.Angle(code);
  const std::size_t n = std::min(count_, ring_.size());
  double sum = 0;
  for (std::size_t i = 0; i < n; ++i) {
    sum += ring_[i];
  }
  return sum / static_cast<double>(n);
}

double OneEuro::Update(int code) {
  constexpr double kRateCutoff_Hz = 1.0;
  const auto gain = [](double cutoff_Hz) { return 1.0 / (1.0 + 1.0 / (2 * std::numbers::pi * cutoff_Hz * kDt_s)); };
  const double raw = calibration_.Angle(code);
  if (!started_) {
    started_ = true;
    angle_ = last_raw_ = raw;
    return raw;
  }
  rate_ += gain(kRateCutoff_Hz) * ((raw - last_raw_) / kDt_s - rate_);
  last_raw_ = raw;
  angle_ += gain(min_cutoff_Hz_ + beta_ * std::abs(rate_)) * (raw - angle_);
  return angle_;
}

double Kalman::Update(int code) {
  const double raw = calibration_.Angle(code);
  const double width = std::abs(calibration_.Slope(code)), noise = NoiseOf(calibration_, code);
  const double r = width * width / 12 + noise * noise;
  if (!started_) {
    started_ = true;
    angle_ = raw;
    p_aa_ = r;
    p_rr_ = 1e4;
    return raw;
  }
  angle_ += kDt_s * rate_;
  p_aa_ += kDt_s * (2 * p_ar_ + kDt_s * p_rr_) + 0.25 * kDt_s * kDt_s * q_;
  p_ar_ += kDt_s * p_rr_ + 0.5 * kDt_s * q_;
  p_rr_ += q_;
  const double k_a = p_aa_ / (p_aa_ + r), k_r = p_ar_ / (p_aa_ + r), residual = raw - angle_;
  angle_ += k_a * residual;
  rate_ += k_r * residual;
  p_rr_ -= k_r * p_ar_;
  p_ar_ -= k_r * p_aa_;
  p_aa_ -= k_a * p_aa_;
  return angle_;
}

ParticleFilter::ParticleFilter(const JawCalibration& calibration, std::size_t particles, std::uint64_t seed)
    : calibration_(calibration), particles_(particles), drawn_(particles), random_(seed) {}

double ParticleFilter::Update(int code) {
  std::uniform_real_distribution<double> uniform(0, 1);
  std::normal_distribution<double> normal;
  const double low = std::min(calibration_.Angle(code - 0.5), calibration_.Angle(code + 0.5));
  const double high = std::max(calibration_.Angle(code - 0.5), calibration_.Angle(code + 0.5));
  const double noise = NoiseOf(calibration_, code);
  if (!started_) {
    started_ = true;
    for (Particle& p : particles_) {
      p = {low + (high - low) * uniform(random_), 0, 1.0 / static_cast<double>(particles_.size()),
           static_cast<int>(random_() % kJawModes)};
    }
  }
  double total = 0;
  for (Particle& p : particles_) {
    if (uniform(random_) < settings_.switch_probability) {
      p.mode = (p.mode + 1 + static_cast<int>(random_() % (kJawModes - 1))) % kJawModes;
    }
    const double step = settings_.rate_noise_deg_s[static_cast<std::size_t>(p.mode)] * normal(random_);
    p.angle += kDt_s * (p.rate + 0.5 * step);
    p.rate = p.rate * (p.mode == 0 ? 1 - settings_.hold_leak_per_s * kDt_s : 1.0) + step;
    p.weight *= NormalCdf((high - p.angle) / noise) - NormalCdf((low - p.angle) / noise) + 1e-12;
    total += p.weight;
  }
  double angle = 0, squares = 0;
  for (Particle& p : particles_) {
    p.weight /= total;
    angle += p.weight * p.angle;
    squares += p.weight * p.weight;
  }
  if (1 / squares < 0.5 * static_cast<double>(particles_.size())) {
    Resample();
  }
  return angle;
}

void ParticleFilter::Resample() {
  const double each = 1.0 / static_cast<double>(particles_.size());
  double at = each * std::uniform_real_distribution<double>(0, 1)(random_), sum = 0;
  std::size_t from = 0;
  for (Particle& p : drawn_) {
    while (sum + particles_[from].weight < at && from + 1 < particles_.size()) {
      sum += particles_[from++].weight;
    }
    p = particles_[from];
    p.weight = each;
    at += each;
  }
  particles_.swap(drawn_);
}

}  // namespace fulcrum::handle_bridge
