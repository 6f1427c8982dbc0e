// The estimators that the jaw estimator is measured against, linked into the benchmark only.
#pragma once

#include <cstddef>
#include <memory>
#include <random>
#include <vector>

#include "handle_bridge/estimator/jaw_calibration.h"
#include "handle_bridge/estimator/jaw_estimator.h"

namespace fulcrum::handle_bridge {

/// Codes at 400 Hz in, the angle of the same moment out [deg].
class AngleFilter {
 public:
  virtual ~AngleFilter() = default;
  virtual double Update(int code) = 0;
};

/// The middle of the code's interval.
class RawCode final : public AngleFilter {
 public:
  explicit RawCode(const JawCalibration& calibration) : calibration_(calibration) {}
  double Update(int code) override { return calibration_.Angle(code); }

 private:
  JawCalibration calibration_;
};

/// Mean of the last n angles.
class MovingAverage final : public AngleFilter {
 public:
  MovingAverage(const JawCalibration& calibration, std::size_t n) : calibration_(calibration), ring_(n) {}
  double Update(int code) override;

 private:
  JawCalibration calibration_;
  std::vector<double> ring_;
  std::size_t count_ = 0;
};

/// The 1-euro filter of Casiez, Roussel and Vogel 2012: a low-pass whose cut-off rises with the speed.
class OneEuro final : public AngleFilter {
 public:
  /// @param beta [1/deg]: Hz of cut-off per deg/s.
  OneEuro(const JawCalibration& calibration, double min_cutoff_Hz, double beta)
      : calibration_(calibration), min_cutoff_Hz_(min_cutoff_Hz), beta_(beta) {}
  double Update(int code) override;

 private:
  JawCalibration calibration_;
  double min_cutoff_Hz_, beta_;
  double angle_ = 0, rate_ = 0, last_raw_ = 0;
  bool started_ = false;
};

/// Constant velocity; the measurement is the middle of the code's interval, with the variance of the interval and
/// noise.
class Kalman final : public AngleFilter {
 public:
  /// @param rate_noise_deg_s standard deviation of the velocity noise per period.
  Kalman(const JawCalibration& calibration, double rate_noise_deg_s)
      : calibration_(calibration), q_(rate_noise_deg_s * rate_noise_deg_s) {}
  double Update(int code) override;

 private:
  JawCalibration calibration_;
  double q_;
  double angle_ = 0, rate_ = 0, p_aa_ = 0, p_ar_ = 0, p_rr_ = 0;
  bool started_ = false;
};

/// The estimator itself with any settings. Two modes with the same noise act as one: this gives the IMM with two modes.
class IntervalImm final : public AngleFilter {
 public:
  IntervalImm(const JawCalibration& calibration, const JawEstimatorSettings& settings)
      : estimator_(settings, calibration) {}
  double Update(int code) override {
    estimator_.Update(code);
    return estimator_.estimate().angle_deg;
  }

 private:
  JawEstimator estimator_;
};

/// The reference: the same three modes without the Gaussian approximation, as particles. They are resampled whenever
/// half of them have negligible weight (systematic resampling).
class ParticleFilter final : public AngleFilter {
 public:
  ParticleFilter(const JawCalibration& calibration, std::size_t particles, std::uint64_t seed);
  double Update(int code) override;

 private:
  struct Particle {
    double angle = 0, rate = 0, weight = 0;
    int mode = 0;
  };
  void Resample();

  JawCalibration calibration_;
  JawEstimatorSettings settings_;
  std::vector<Particle> particles_, drawn_;
  std::mt19937_64 random_;
  bool started_ = false;
};

}  // namespace fulcrum::handle_bridge
