// Calibration, damaged bytes, replug and the cost of a tick.
#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <mutex>
#include <numbers>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "handle_bridge/estimator/jaw_calibrator.h"
#include "handle_bridge/node/cart_links.h"
#include "handle_bridge/node/handle_bridge_node.h"
#include "handle_bridge/node/jaw_channel.h"
#include "handle_bridge/simulation/jaw_firmware.h"
#include "services/base/runtime/cyclic_thread.h"
#include "services/transport/bus/in_process.h"
#include "tests/benchmark/handle/cases.h"
#include "tests/unit/handle/jaw_truth.h"

namespace fulcrum::handle_bridge {
namespace {

using Clock = std::chrono::steady_clock;

/// RMS error of a calibration over the handle's range [deg^2, summed over 61 angles].
double SquaredError(const JawCalibration& calibration, const JawFirmwareSettings& part) {
  double sum = 0;
  for (int angle = 0; angle <= 60; ++angle) {
    const double x = angle / 60.0;
    const double volts = part.closed_V + (part.open_V - part.closed_V) * (x + 4 * part.bow * x * (1 - x));
    const double e = calibration.Angle(volts / part.adc_step_V) - angle;
    sum += e * e;
  }
  return sum;
}

JawCalibration Calibrated(JawFirmware* firmware, const std::vector<double>& angles_deg) {
  constexpr int kReadings = 400;  // As the command takes.
  JawCalibrator calibrator;
  for (const double angle : angles_deg) {
    std::vector<int> codes;
    for (int i = 0; i < kReadings; ++i) {
      codes.push_back(firmware->Convert(angle));
    }
    static_cast<void>(calibrator.Add(angle, codes));
  }
  const CalibrationPoints points = calibrator.Solve();
  return {points.codes, points.angles_deg};
}

/// Accepts any line that begins with a number: the baseline for the strict parsers.
bool NaiveVoltage(const std::string& line, double* volts) {
  char* end = nullptr;
  *volts = std::strtod(line.c_str(), &end);
  return end != line.c_str();
}

struct Damage {
  double wrong_per_h = 0, naive_wrong_per_h = 0, lost_percent = 0;
};

Damage PassThroughABadCable(bool framed, double hours) {
  constexpr ByteDamage kCable = {0.5e-3, 0.5e-3, false};  // One byte in a thousand is lost or has a flipped bit.
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
    received.clear();
    if (framed) {
      const auto line = FormatFrame({kLeftHandle, static_cast<std::uint8_t>(i), code});
      cable.Pass({line.data(), line.size()}, kCable, &received);
    } else {
      const auto line = firmware.Format(code);
      cable.Pass({line.data(), line.size()}, kCable, &received);
    }
    bool good = false;
    for (const char byte : received) {
      if (framer.Add(byte) == LineFramer::Event::kLine) {
        const JawReading reading = gate.Check(framer.line());
        good = reading.verdict == LineVerdict::kGood;
        wrong += good && reading.code != code;
      }
      if (byte == '\n' && !framed) {
        double volts = 0;
        naive_wrong += NaiveVoltage(naive_line, &volts) && std::abs(volts - code * 0.00488) > 0.5 * 0.00488;
        naive_line.clear();
      } else {
        naive_line.push_back(byte);
      }
    }
    if (framed) {
      naive_line.clear();
    }
    lost += !good;
  }
  return {static_cast<double>(wrong) / hours, static_cast<double>(naive_wrong) / hours,
          100.0 * static_cast<double>(lost) / static_cast<double>(lines)};
}

}  // namespace

void MeasureCalibration(benchmark::Report* report) {
  if (!report->Wants("handle.calibrated") && !report->Wants("handle.uncalibrated")) {
    return;
  }
  const int parts = report->quick() ? 40 : 200;
  std::mt19937_64 random(3);
  std::normal_distribution<double> unit;
  double none = 0, two = 0, five = 0;
  for (int i = 0; i < parts; ++i) {
    JawFirmwareSettings part;
    part.tremor_deg = 0.25;
    part.closed_V += 0.010 * unit(random);
    part.open_V = part.closed_V + 0.17 * (1 + 0.08 * unit(random));
    part.bow = 0.03 * unit(random);
    JawFirmware firmware(part, 1000 + static_cast<std::uint64_t>(i));
    none += SquaredError(PaperCalibration(), part);
    two += SquaredError(Calibrated(&firmware, {0, 60}), part);
    five += SquaredError(Calibrated(&firmware, {0, 15, 30, 45, 60}), part);
  }
  report->Add("handle.calibrated_rms_deg", std::sqrt(five / (61 * parts)), "deg");
  report->Add("handle.calibrated_2_points_rms_deg", std::sqrt(two / (61 * parts)), "deg");
  report->Add("handle.uncalibrated_rms_deg", std::sqrt(none / (61 * parts)), "deg");
}

void MeasureWrongValues(benchmark::Report* report) {
  if (!report->Wants("handle.wrong_values_per_h.") && !report->Wants("handle.lost_lines_percent.")) {
    return;
  }
  const double hours = report->quick() ? 1.0 : 20.0;
  const Damage framed = PassThroughABadCable(true, hours);
  const Damage plain = PassThroughABadCable(false, hours);
  report->Add("handle.wrong_values_per_h.framed", framed.wrong_per_h, "1/h");
  report->Add("handle.wrong_values_per_h.plain", plain.wrong_per_h, "1/h");
  report->Add("handle.wrong_values_per_h.naive", plain.naive_wrong_per_h, "1/h");
  report->Add("handle.lost_lines_percent.framed", framed.lost_percent, "%");
  report->Add("handle.lost_lines_percent.plain", plain.lost_percent, "%");
}

void MeasureRecovery(benchmark::Report* report) {
  if (!report->Wants("handle.recover_ms")) {
    return;
  }
  constexpr double kDegPerRad = 180.0 / std::numbers::pi;
  constexpr double kRight_deg =
      2.0;  // The jaw has moved meanwhile, so this shows that the angle is right again, not only the link.
  const auto jaw_deg = [](std::int64_t now_ns) { return 30 + 25 * std::sin(1e-9 * static_cast<double>(now_ns)); };
  std::mutex mutex;
  LinkFaults faults;  // Guarded by mutex.
  SimulatedFirmware firmware([&](std::int64_t now_ns) {
    SimulatedInput input;
    input.jaw_deg = {jaw_deg(now_ns), 30};
    const std::lock_guard lock(mutex);
    input.faults[0] = faults;
    return std::optional(input);
  });
  bus::InProcessTopic<HandleState> topic;
  const auto input = topic.MakeInput();
  const auto output = topic.MakeOutput();
  const config::CartConfig cart;
  HandleBridgeNode node(cart, {}, MakeCartLinks(cart, &firmware), output.get(), runtime::MonotonicNs());
  runtime::CyclicThread thread({.name = "handle", .period_ns = 2500000}, [&](const Tick& tick) { node.Step(tick); });
  thread.Start();
  /// Waits until handle 0 is (or is not) present with the right angle; returns the time [ms].
  const auto wait = [&](bool there) {
    const Clock::time_point start = Clock::now();
    HandleState state;
    while (Clock::now() - start < std::chrono::seconds(10)) {
      if (input->TakeLatest(&state)) {
        const HandleSample& sample = state.handles[0];
        const double error = sample.jaw_angle_rad * kDegPerRad - jaw_deg(state.stamp.stamp_ns);
        if (there ? sample.quality > 0.5f && std::abs(error) < kRight_deg : sample.quality == 0.0f) {
          break;
        }
      }
      std::this_thread::sleep_for(std::chrono::microseconds(500));
    }
    return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
  };
  const auto set_unplugged = [&](bool unplugged) {
    const std::lock_guard lock(mutex);
    faults.unplugged = unplugged;
  };
  wait(true);
  std::vector<double> recover_ms;
  for (int i = 0; i < (report->quick() ? 6 : 20); ++i) {
    set_unplugged(true);
    wait(false);
    // The replug happens at varying phases of the search for the port.
    std::this_thread::sleep_for(std::chrono::milliseconds(300 + 37 * i % 250));
    set_unplugged(false);
    recover_ms.push_back(wait(true));
  }
  report->Add("handle.recover_ms", benchmark::Quantile(recover_ms, 1.0), "ms");
  report->Add("handle.recover_ms_p50", benchmark::Quantile(recover_ms, 0.5), "ms");
}

void MeasureTick(benchmark::Report* report) {
  if (!report->Wants("handle.tick_")) {
    return;
  }
  constexpr int kTicks = 20000;
  for (const bool framed : {false, true}) {
    JawChannel channel({JawLineSettings{}, JawEstimatorSettings{}, PaperCalibration()});
    JawFirmware firmware({}, 3);
    std::vector<double> us;
    for (int i = 0; i < kTicks; ++i) {
      const int code = firmware.Convert(30 + 20 * std::sin(0.01 * i));
      const auto plain_line = firmware.Format(code);
      const auto frame = FormatFrame({kLeftHandle, static_cast<std::uint8_t>(i), code});
      const std::span<const char> bytes = framed ? std::span<const char>(frame) : std::span<const char>(plain_line);
      const Clock::time_point start = Clock::now();
      channel.Tick(bytes, 0.0025);
      benchmark::DoNotOptimise(channel.estimate());
      us.push_back(std::chrono::duration<double, std::micro>(Clock::now() - start).count());
    }
    const std::string name = framed ? "handle.tick_framed_us" : "handle.tick_us";
    report->Add(name + "_p50", benchmark::Quantile(us, 0.5), "us");
    report->Add(name + "_p99", benchmark::Quantile(us, 0.99), "us");
  }
}

}  // namespace fulcrum::handle_bridge
