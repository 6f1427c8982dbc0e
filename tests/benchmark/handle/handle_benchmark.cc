// Jaw angle: error against the true motion, cost of a sample, and what a bad cable gets past the parser.
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "handle_bridge/estimator/jaw_estimator.h"
#include "handle_bridge/node/jaw_channel.h"
#include "handle_bridge/simulation/jaw_firmware.h"
#include "tests/benchmark/report.h"
#include "tests/unit/handle/jaw_truth.h"

namespace fulcrum::handle_bridge {
namespace {

using Clock = std::chrono::steady_clock;

JawCalibration PaperCalibration() {
  const std::array codes = {2.37 / 0.00488, 2.54 / 0.00488};
  const std::array angles = {0.0, 60.0};
  return {codes, angles};
}

double Rms(double sum, std::size_t n) { return std::sqrt(sum / static_cast<double>(n)); }

void MeasureErrors(benchmark::Report* report, bool moves, int runs) {
  constexpr std::size_t kSettled = 400;  // The first second is the start, not the state.
  const JawCalibration calibration = PaperCalibration();
  double sum = 0, raw_sum = 0, moving_sum = 0, lag = 0;
  std::size_t n = 0, moving_n = 0;
  std::vector<double> step_us;
  for (int run = 0; run < runs; ++run) {
    const JawTruth truth = MakeJawTruth(20, moves, 100 + static_cast<std::uint64_t>(run));
    JawFirmware firmware({}, 500 + static_cast<std::uint64_t>(run));
    std::vector<int> codes;
    for (const double angle : truth.angle_deg) {
      codes.push_back(firmware.Convert(angle));
    }
    JawEstimator estimator({}, calibration);
    std::vector<double> estimate(codes.size());
    const Clock::time_point start = Clock::now();
    for (std::size_t i = 0; i < codes.size(); ++i) {
      estimator.Update(codes[i]);
      estimate[i] = estimator.estimate().angle_deg;
    }
    const std::chrono::duration<double, std::micro> elapsed = Clock::now() - start;
    step_us.push_back(elapsed.count() / static_cast<double>(codes.size()));
    for (std::size_t i = kSettled; i < codes.size(); ++i) {
      const double e = estimate[i] - truth.angle_deg[i];
      const double raw = calibration.Angle(codes[i]) - truth.angle_deg[i];
      sum += e * e;
      raw_sum += raw * raw;
      ++n;
      if (truth.moving[i]) {
        moving_sum += e * e;
        ++moving_n;
      }
    }
    if (moves) {
      lag += 1000.0 / kTruthRate_Hz * LagSamples(truth.angle_deg, estimate) / runs;
    }
  }
  if (moves) {
    report->Add("handle.motion_rms_deg", Rms(moving_sum, moving_n), "deg");
    report->Add("handle.mixed_rms_deg", Rms(sum, n), "deg");
    report->Add("handle.raw_motion_rms_deg", Rms(raw_sum, n), "deg");
    report->Add("handle.lag_ms", lag, "ms");
  } else {
    report->Add("handle.static_rms_deg", Rms(sum, n), "deg");
    report->Add("handle.raw_static_rms_deg", Rms(raw_sum, n), "deg");
    report->Add("handle.step_us_p50", benchmark::Quantile(step_us, 0.5), "us");
  }
}

/// What a reader that only asks for a number would take: how the strict one is judged.
bool NaiveVoltage(const std::string& line, double* volts) {
  char* end = nullptr;
  *volts = std::strtod(line.c_str(), &end);
  return end != line.c_str();
}

void MeasureWrongValues(benchmark::Report* report, double hours) {
  constexpr ByteDamage kCable = {0.5e-3, 0.5e-3};  // One byte in a thousand is lost or has a flipped bit.
  JawFirmware firmware({}, 7);
  DamagedLine cable(8);
  LineFramer framer;
  JawLineGate gate{JawLineSettings{}};
  const auto lines = static_cast<std::size_t>(hours * 3600 * kTruthRate_Hz);
  const JawTruth truth = MakeJawTruth(600, true, 9);
  std::string received, naive_line;
  std::size_t wrong = 0, naive_wrong = 0, lost = 0;
  for (std::size_t i = 0; i < lines; ++i) {
    const int code = firmware.Convert(truth.angle_deg[i % truth.angle_deg.size()]);
    const auto line = firmware.Format(code);
    received.clear();
    cable.Pass({line.data(), line.size()}, kCable, &received);
    bool good = false;
    for (const char byte : received) {
      if (framer.Add(byte) == LineFramer::Event::kLine) {
        const JawReading reading = gate.Check(framer.line());
        good = reading.verdict == LineVerdict::kGood;
        wrong += good && reading.code != code;
      }
      if (byte == '\n') {
        double volts = 0;
        naive_wrong += NaiveVoltage(naive_line, &volts) && std::abs(volts - code * 0.00488) > 0.5 * 0.00488;
        naive_line.clear();
      } else {
        naive_line.push_back(byte);
      }
    }
    lost += !good;
  }
  report->Add("handle.wrong_values_per_h", static_cast<double>(wrong) / hours, "1/h");
  report->Add("handle.naive_wrong_values_per_h", static_cast<double>(naive_wrong) / hours, "1/h");
  report->Add("handle.lost_lines_percent", 100.0 * static_cast<double>(lost) / static_cast<double>(lines), "%");
}

/// A tick of one handle: bytes to estimate.
void MeasureChannel(benchmark::Report* report, int ticks) {
  JawChannel channel({JawLineSettings{}, JawEstimatorSettings{}, PaperCalibration()});
  JawFirmware firmware({}, 3);
  std::vector<double> us;
  for (int i = 0; i < ticks; ++i) {
    const auto line = firmware.Line(30 + 20 * std::sin(0.01 * i));
    const Clock::time_point start = Clock::now();
    channel.Tick({line.data(), line.size()}, 0.0025);
    benchmark::DoNotOptimise(channel.estimate());
    us.push_back(std::chrono::duration<double, std::micro>(Clock::now() - start).count());
  }
  report->Add("handle.tick_us_p50", benchmark::Quantile(us, 0.5), "us");
  report->Add("handle.tick_us_p99", benchmark::Quantile(us, 0.99), "us");
}

}  // namespace
}  // namespace fulcrum::handle_bridge

int main(int argc, char** argv) {
  using namespace fulcrum::handle_bridge;
  fulcrum::benchmark::Report report(argc, argv);
  if (!report.Wants("handle.")) {
    return 0;
  }
  const int runs = report.quick() ? 20 : 60;
  MeasureErrors(&report, false, runs);
  MeasureErrors(&report, true, runs);
  MeasureWrongValues(&report, report.quick() ? 1.0 : 20.0);
  MeasureChannel(&report, 20000);
  return 0;
}
