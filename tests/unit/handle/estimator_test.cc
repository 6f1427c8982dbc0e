#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

#include "handle_bridge/estimator/jaw_calibration.h"
#include "handle_bridge/estimator/jaw_calibrator.h"
#include "handle_bridge/estimator/jaw_estimator.h"
#include "handle_bridge/simulation/jaw_firmware.h"
#include "tests/unit/handle/jaw_truth.h"

namespace fulcrum::handle_bridge {
namespace {

JawCalibration PaperCalibration() {
  const std::array codes = {2.37 / (5.0 / 1024), 2.54 / (5.0 / 1024)};
  const std::array angles = {0.0, 60.0};
  return {codes, angles};
}

TEST(JawCalibration, TwoPointsAreAStraightLine) {
  const JawCalibration calibration = PaperCalibration();
  EXPECT_NEAR(calibration.Angle(2.37 / (5.0 / 1024)), 0, 1e-9);
  EXPECT_NEAR(calibration.Angle(2.54 / (5.0 / 1024)), 60, 1e-9);
  EXPECT_NEAR(calibration.Slope(500), 60 / (0.17 / (5.0 / 1024)), 1e-9);
  EXPECT_NEAR(calibration.Angle(600) - calibration.Angle(599), calibration.Slope(500), 1e-9);
}

TEST(JawCalibration, PassesThroughItsPointsMonotonically) {
  const std::array codes = {486.0, 490.0, 500.0, 501.0, 520.0};
  const std::array angles = {0.0, 12.0, 13.0, 40.0, 60.0};
  const JawCalibration calibration(codes, angles);
  for (std::size_t i = 0; i < codes.size(); ++i) {
    EXPECT_NEAR(calibration.Angle(codes[i]), angles[i], 1e-9);
  }
  for (double code = 480; code < 525; code += 0.01) {
    EXPECT_LT(calibration.Angle(code), calibration.Angle(code + 0.01)) << code;
  }
}

TEST(JawCalibration, SlopeIsTheDerivative) {
  const std::array codes = {480.0, 492.0, 500.0, 510.0, 525.0};
  const std::array angles = {60.0, 41.0, 30.0, 12.0, 0.0};
  const JawCalibration calibration(codes, angles);
  for (double code = 478.3; code < 527; code += 0.37) {
    const double difference = (calibration.Angle(code + 1e-5) - calibration.Angle(code - 1e-5)) / 2e-5;
    EXPECT_NEAR(calibration.Slope(code), difference, 1e-6) << code;
  }
}

TEST(JawCalibration, FivePointsRemoveBowSpreadAndOffset) {
  // Unit spread of the potentiometers: 10 mV, 8 %, 3 % bow.
  std::mt19937_64 random(3);
  std::normal_distribution<double> unit;
  double sum2 = 0, sum5 = 0;
  int n = 0;
  for (int part = 0; part < 200; ++part) {
    const double offset = 0.010 / (5.0 / 1024) * unit(random), gain = 1 + 0.08 * unit(random),
                 bow = 0.03 * unit(random);
    const auto code_of = [&](double angle) {
      const double x = angle / 60;
      return 485.66 + offset + 34.84 * gain * (x + 4 * bow * x * (1 - x));
    };
    const std::array<double, 2> a2 = {0, 60}, c2 = {code_of(0), code_of(60)};
    const std::array<double, 5> a5 = {0, 15, 30, 45, 60};
    std::array<double, 5> c5{};
    for (std::size_t i = 0; i < a5.size(); ++i) {
      c5[i] = code_of(a5[i]);
    }
    const JawCalibration two(c2, a2), five(c5, a5);
    for (double angle = 0; angle <= 60; angle += 1) {
      sum2 += std::pow(two.Angle(code_of(angle)) - angle, 2);
      sum5 += std::pow(five.Angle(code_of(angle)) - angle, 2);
      ++n;
    }
  }
  EXPECT_LT(std::sqrt(sum2 / n), 2.0);
  EXPECT_LT(std::sqrt(sum5 / n), 0.08);
}

/// Codes of a handle that is held still.
std::vector<int> Hold(JawFirmware* firmware, double angle_deg, int samples = 400) {
  std::vector<int> codes;
  for (int i = 0; i < samples; ++i) {
    codes.push_back(firmware->Convert(angle_deg));
  }
  return codes;
}

TEST(JawCalibrator, FindsTheVoltageBetweenTheCodes) {
  JawFirmwareSettings settings;
  settings.tremor_deg = 0.25;
  double squares = 0;
  int n = 0;
  for (std::uint64_t part = 0; part < 40; ++part) {
    settings.closed_V = 2.37 + 0.0001 * static_cast<double>(part);  // All positions between two codes.
    settings.open_V = settings.closed_V + 0.17;
    JawFirmware firmware(settings, part);
    JawCalibrator calibrator;
    for (const double angle : {0.0, 15.0, 30.0, 45.0, 60.0}) {
      EXPECT_EQ(calibrator.Add(angle, Hold(&firmware, angle)), "");
    }
    const CalibrationPoints points = calibrator.Solve();
    for (std::size_t i = 0; i < points.codes.size(); ++i) {
      const double truth = (settings.closed_V + 0.17 / 60 * points.angles_deg[i]) / settings.adc_step_V;
      squares += (points.codes[i] - truth) * (points.codes[i] - truth);
      ++n;
    }
  }
  EXPECT_LT(std::sqrt(squares / n), 0.04);  // In counts; the mean of the codes has an error of 0.09.
}

TEST(JawCalibrator, TakesFallingHandlesInAnyOrder) {
  JawFirmwareSettings settings;
  std::swap(settings.closed_V, settings.open_V);
  JawFirmware firmware(settings, 3);
  JawCalibrator calibrator;
  for (const double angle : {30.0, 0.0, 60.0}) {
    EXPECT_EQ(calibrator.Add(angle, Hold(&firmware, angle)), "");
  }
  EXPECT_EQ(calibrator.Solve().angles_deg, (std::vector<double>{60, 30, 0}));
}

TEST(JawCalibrator, RefusesWithTheReason) {
  JawFirmware firmware({}, 3);
  JawCalibrator calibrator;
  const auto says = [&calibrator](double angle, const std::vector<int>& codes, const char* what) {
    const std::string said = calibrator.Add(angle, codes);
    EXPECT_EQ(said.rfind(what, 0), 0u) << said;
  };
  says(0, {}, "only 0 readings came");
  says(0, std::vector<int>(400, 0), "the converter is at its stop");
  says(0, std::vector<int>(400, 1023), "the converter is at its stop");
  JawFirmwareSettings shaky;
  shaky.noise_V = 0.005;
  JawFirmware unsteady(shaky, 4);
  says(0, Hold(&unsteady, 10), "too noisy: the codes spread by 1.0");
  says(20, Hold(&firmware, 20), "");
  says(22, Hold(&firmware, 22), "too few counts apart: 1.");
  says(40, Hold(&firmware, 40), "");
  says(60, Hold(&firmware, 30), "not monotone: at 60.0 deg");
  says(10, Hold(&firmware, 50), "not monotone");
  says(60, Hold(&firmware, 60), "");
  EXPECT_EQ(calibrator.size(), 3u);
}

TEST(JawCalibrator, RefusesAnAngleThatItHas) {
  JawFirmware firmware({}, 3);
  JawCalibrator calibrator;
  EXPECT_EQ(calibrator.Add(30, Hold(&firmware, 20)), "");
  // Two points of one angle have no slope, and no third one lies on the right side of both.
  EXPECT_EQ(calibrator.Add(30, Hold(&firmware, 40)).rfind("30.0 deg is another point's angle", 0), 0u);
  EXPECT_EQ(calibrator.Add(60, Hold(&firmware, 60)), "");
  EXPECT_EQ(calibrator.size(), 2u);
}

struct Errors {
  double rms_deg = 0;
  double lag_ms = 0;
};

/// RMS error and lag over motions that were not used to choose the filter's settings.
Errors Measure(bool moves, int runs) {
  double sum = 0, lag = 0;
  std::size_t n = 0;
  for (int run = 0; run < runs; ++run) {
    const JawTruth truth = MakeJawTruth(20, moves, 5000 + static_cast<std::uint64_t>(run));
    JawFirmware firmware({}, 900 + static_cast<std::uint64_t>(run));
    JawEstimator estimator({}, PaperCalibration());
    std::vector<double> estimate;
    for (std::size_t i = 0; i < truth.angle_deg.size(); ++i) {
      estimator.Update(firmware.Convert(truth.angle_deg[i]));
      estimate.push_back(estimator.estimate().angle_deg);
      if (i >= 400) {
        sum += std::pow(estimate.back() - truth.angle_deg[i], 2);
        ++n;
      }
    }
    lag += 1000 / kTruthRate_Hz * LagSamples(truth.angle_deg, estimate);
  }
  return {std::sqrt(sum / static_cast<double>(n)), lag / runs};
}

TEST(JawEstimator, HoldsStillWithinAQuarterDegree) { EXPECT_LT(Measure(false, 20).rms_deg, 0.25); }

TEST(JawEstimator, FollowsMotionWithinTheTargets) {
  const Errors errors = Measure(true, 20);
  EXPECT_LT(errors.rms_deg, 0.35);
  EXPECT_LT(std::abs(errors.lag_ms), 2.0);
}

TEST(JawEstimator, RateIsTheDerivativeInASteadyMotion) {
  JawFirmware firmware({}, 4);
  JawEstimator estimator({}, PaperCalibration());
  for (int i = 0; i < 400; ++i) {
    estimator.Update(firmware.Convert(5 + 50.0 * i / 400));
  }
  EXPECT_NEAR(estimator.estimate().rate_deg_s, 50, 12);
  EXPECT_NEAR(estimator.estimate().angle_deg, 55, 1);
}

TEST(JawEstimator, FallingCalibrationIsAMirrorImage) {
  const std::array codes = {2.37 / (5.0 / 1024), 2.54 / (5.0 / 1024)};
  const std::array falling = {60.0, 0.0};
  JawEstimator up({}, PaperCalibration());
  JawEstimator down({}, JawCalibration(codes, falling));
  JawFirmware firmware({}, 6);
  for (int i = 0; i < 800; ++i) {
    const int code = firmware.Convert(30 + 20 * std::sin(0.01 * i));
    up.Update(code);
    down.Update(code);
    ASSERT_NEAR(up.estimate().angle_deg, 60 - down.estimate().angle_deg, 1e-6);
  }
}

TEST(JawEstimator, StaysFiniteAndInRangeOnAnyCodes) {
  std::mt19937_64 random(8);
  JawEstimator estimator({}, PaperCalibration());
  for (int i = 0; i < 200000; ++i) {
    switch (random() % 16) {
      case 0:
        estimator.Predict();
        break;
      case 1:
        estimator.Hold();
        break;
      default:
        estimator.Update(static_cast<int>(random() % 1024));
    }
    const JawEstimate e = estimator.estimate();
    ASSERT_TRUE(std::isfinite(e.angle_deg) && std::isfinite(e.rate_deg_s)) << i;
    ASSERT_GE(e.angle_deg, 0);
    ASSERT_LE(e.angle_deg, 60);
    ASSERT_NEAR(estimator.weights()[0] + estimator.weights()[1] + estimator.weights()[2], 1, 1e-9);
  }
}

TEST(JawEstimator, HoldKeepsTheAngleAndForgetsTheMotion) {
  JawEstimator estimator({}, PaperCalibration());
  for (int i = 0; i < 100; ++i) {
    estimator.Update(490 + i / 10);
  }
  const double angle = estimator.estimate().angle_deg;
  estimator.Hold();
  EXPECT_NEAR(estimator.estimate().angle_deg, angle, 1e-9);
  EXPECT_EQ(estimator.estimate().rate_deg_s, 0);
  estimator.Predict();
  EXPECT_NEAR(estimator.estimate().angle_deg, angle, 1e-9);
}

TEST(JawEstimator, SameCodesGiveTheSameBits) {
  JawEstimator a({}, PaperCalibration()), b({}, PaperCalibration());
  JawFirmware firmware({}, 2);
  for (int i = 0; i < 1000; ++i) {
    const int code = firmware.Convert(20 + 0.02 * i);
    a.Update(code);
    b.Update(code);
    ASSERT_EQ(a.estimate().angle_deg, b.estimate().angle_deg);
    ASSERT_EQ(a.estimate().rate_deg_s, b.estimate().rate_deg_s);
  }
}

}  // namespace
}  // namespace fulcrum::handle_bridge
