// Error and lag of the jaw estimator and of its alternatives on simulated hands.
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "handle_bridge/simulation/jaw_firmware.h"
#include "tests/benchmark/handle/baselines/filters.h"
#include "tests/benchmark/handle/cases.h"
#include "tests/benchmark/handle/lag_plot.h"
#include "tests/unit/handle/jaw_truth.h"

namespace fulcrum::handle_bridge {
namespace {

using Clock = std::chrono::steady_clock;
using MakeFilter = std::function<std::unique_ptr<AngleFilter>()>;

struct Errors {
  double static_rms_deg = 0;
  double motion_rms_deg = 0;  ///< Within moves.
  double mixed_rms_deg = 0;   ///< Moves and the holds between them.
  double lag_ms = 0;
  double sample_us = 0;
};

double Rms(double sum, std::size_t n) { return std::sqrt(sum / static_cast<double>(n)); }

Errors Measure(const MakeFilter& make, int runs) {
  constexpr std::size_t kSettled = 400;  // The first second, in which the estimate settles, is excluded.
  Errors errors;
  std::vector<double> sample_us;
  for (const bool moves : {false, true}) {
    double sum = 0, moving_sum = 0;
    std::size_t n = 0, moving_n = 0;
    for (int run = 0; run < runs; ++run) {
      const JawTruth truth = MakeJawTruth(20, moves, 100 + static_cast<std::uint64_t>(run));
      JawFirmware firmware({}, 500 + static_cast<std::uint64_t>(run));
      std::vector<int> codes;
      for (const double angle : truth.angle_deg) {
        codes.push_back(firmware.Convert(angle));
      }
      const std::unique_ptr<AngleFilter> filter = make();
      std::vector<double> estimate(codes.size());
      const Clock::time_point start = Clock::now();
      for (std::size_t i = 0; i < codes.size(); ++i) {
        estimate[i] = filter->Update(codes[i]);
      }
      const std::chrono::duration<double, std::micro> elapsed = Clock::now() - start;
      sample_us.push_back(elapsed.count() / static_cast<double>(codes.size()));
      for (std::size_t i = kSettled; i < codes.size(); ++i) {
        const double e = estimate[i] - truth.angle_deg[i];
        sum += e * e;
        ++n;
        if (truth.moving[i]) {
          moving_sum += e * e;
          ++moving_n;
        }
      }
      if (moves) {
        errors.lag_ms += 1000.0 / kTruthRate_Hz * LagSamples(truth.angle_deg, estimate) / runs;
      }
    }
    (moves ? errors.mixed_rms_deg : errors.static_rms_deg) = Rms(sum, n);
    if (moves) {
      errors.motion_rms_deg = Rms(moving_sum, moving_n);
    }
  }
  errors.sample_us = benchmark::Quantile(sample_us, 0.5);
  return errors;
}

MakeFilter Imm(const JawEstimatorSettings& settings) {
  return [settings] { return std::make_unique<IntervalImm>(PaperCalibration(), settings); };
}

}  // namespace

JawCalibration PaperCalibration() {
  const std::array codes = {2.37 / (5.0 / 1024), 2.54 / (5.0 / 1024)};
  const std::array angles = {0.0, 60.0};
  return {codes, angles};
}

void MeasureEstimator(benchmark::Report* report) {
  const std::array keys = {"handle.static_rms_deg", "handle.motion_rms_deg", "handle.mixed_rms_deg",
                           "handle.lag_ms",         "handle.step_us_p50",    "handle.raw_"};
  if (std::none_of(keys.begin(), keys.end(), [report](const char* key) { return report->Wants(key); })) {
    return;
  }
  const int runs = report->quick() ? 20 : 60;
  const Errors imm = Measure(Imm({}), runs);
  const Errors raw = Measure([] { return std::make_unique<RawCode>(PaperCalibration()); }, runs);
  report->Add("handle.static_rms_deg", imm.static_rms_deg, "deg");
  report->Add("handle.motion_rms_deg", imm.motion_rms_deg, "deg");
  report->Add("handle.mixed_rms_deg", imm.mixed_rms_deg, "deg");
  report->Add("handle.lag_ms", imm.lag_ms, "ms");
  report->Add("handle.step_us_p50", imm.sample_us, "us");
  report->Add("handle.raw_static_rms_deg", raw.static_rms_deg, "deg");
  report->Add("handle.raw_motion_rms_deg", raw.motion_rms_deg, "deg");
}

void PlotEstimators(benchmark::Report* report) {
  const char* folder = std::getenv("FULCRUM_BENCH_OUT");
  if (!folder || !report->Wants("handle.estimators.")) {
    return;
  }
  const int runs = report->quick() ? 3 : 6;
  const JawCalibration calibration = PaperCalibration();
  std::vector<LagPoint> points;
  const auto add = [&](const std::string& family, const std::string& label, const MakeFilter& make) {
    const Errors e = Measure(make, runs);
    points.push_back({family, label, e.lag_ms, e.motion_rms_deg, e.static_rms_deg});
    std::fprintf(stderr, "%-24s lag %6.2f ms, motion %.3f, still %.3f deg, %.2f us\n", label.c_str(), e.lag_ms,
                 e.motion_rms_deg, e.static_rms_deg, e.sample_us);
  };
  const auto number = [](double value) {
    char text[32];
    std::snprintf(text, sizeof(text), "%g", value);
    return std::string(text);
  };
  add("raw", "raw code", [&] { return std::make_unique<RawCode>(calibration); });
  for (const std::size_t n : {4, 8, 16}) {
    add("average", "mean of " + std::to_string(n), [&] { return std::make_unique<MovingAverage>(calibration, n); });
  }
  for (const double beta : {0.02, 0.1, 0.5, 2.0}) {
    add("1-euro", "1-euro " + number(beta), [&] { return std::make_unique<OneEuro>(calibration, 1.0, beta); });
  }
  for (const double q : {0.3, 1.0, 3.0, 10.0}) {
    add("kalman", "Kalman " + number(q), [&] { return std::make_unique<Kalman>(calibration, q); });
  }
  for (const double q : {1.0, 3.0, 8.0}) {
    JawEstimatorSettings two;
    two.rate_noise_deg_s = {two.rate_noise_deg_s[0], q, q};
    add("two", "IMM 2 modes, " + number(q), Imm(two));
  }
  add("three", "IMM 3 modes", Imm({}));
  add("particles", "particles", [&] { return std::make_unique<ParticleFilter>(calibration, 1000, 1); });
  const std::filesystem::path file = std::filesystem::path(folder) / "handle_estimators.svg";
  std::ofstream(file) << LagSvg(points);
  std::fprintf(stderr, "wrote %s\n", file.c_str());
}

}  // namespace fulcrum::handle_bridge
