// Properties of the serial parsers for any bytes, checked on one input: shared by libFuzzer's target and the test.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <string>

#include "handle_bridge/node/jaw_channel.h"
#include "handle_bridge/node/pedal_channel.h"
#include "handle_bridge/protocol/frame.h"
#include "handle_bridge/protocol/pedal_line.h"

namespace fulcrum::handle_bridge {

struct ProtocolVerdict {
  std::string broken;  ///< The violated property; empty: none.
  int good_lines = 0;
  int good_frames = 0;
  int good_pedals = 0;
};

/// An accepted value must correspond exactly to its line, in the only form that senders write.
inline const char* CheckLine(std::string_view line, JawLineGate* gate, ProtocolVerdict* verdict) {
  if (const std::optional<Frame> frame = ParseFrame(line)) {
    const auto written = FormatFrame(*frame);
    if (line != std::string_view(written.data(), written.size() - 2)) {
      return "a frame was taken that no sender writes";
    }
  }
  if (const std::optional<std::uint8_t> pedals = ParsePedals(line)) {
    const auto written = FormatPedals(*pedals);
    if (line != std::string_view(written.data(), written.size() - 2)) {
      return "a pedal line was taken that no sender writes";
    }
  }
  const JawReading reading = gate->Check(line);
  if (reading.code < 0 || reading.code > kMaxCode) {
    return "a code outside the converter's";
  }
  if (reading.verdict == LineVerdict::kGood) {
    const JawLineSettings settings;
    if (IsFramed(line)) {
      ++verdict->good_frames;
      if (ParseFrame(line)->value != reading.code) {
        return "another code than the frame's";
      }
    } else {
      ++verdict->good_lines;
      const double volts = *ParseVoltage(line) * 1e-4;
      if (std::abs(volts / settings.adc_step_V - reading.code) > JawLineGate::kGridTolerance) {
        return "another code than the voltage's";
      }
    }
  }
  return nullptr;
}

/// Feeds `bytes` to the parsers in pieces of eight, as a 400 Hz node reads them.
inline ProtocolVerdict CheckProtocol(std::span<const char> bytes) {
  constexpr std::array kCodes = {485.66, 520.49};
  constexpr std::array kAngles = {0.0, 60.0};
  constexpr std::size_t kPiece = 8;
  static const JawCalibration kCalibration(kCodes, kAngles);
  ProtocolVerdict verdict;
  JawChannel jaw({JawLineSettings{}, JawEstimatorSettings{}, kCalibration});
  PedalChannel pedal;
  LineFramer framer;
  JawLineGate gate{JawLineSettings{}};
  for (std::size_t at = 0; at < bytes.size(); at += kPiece) {
    const auto piece = bytes.subspan(at, std::min(kPiece, bytes.size() - at));
    for (const char byte : piece) {
      if (framer.Add(byte) != LineFramer::Event::kLine) {
        continue;
      }
      if (framer.line().size() >= LineFramer::kMaxLineBytes) {
        verdict.broken = "a line longer than the framer holds";
      } else if (const char* broken = CheckLine(framer.line(), &gate, &verdict)) {
        verdict.broken = broken;
      }
    }
    jaw.Tick(piece, 0.0025);
    pedal.Tick(piece, 0.0025);
    const JawEstimate e = jaw.estimate();
    if (jaw.present() && !(e.angle_deg >= 0 && e.angle_deg <= 60 && std::isfinite(e.rate_deg_s))) {
      verdict.broken = "an angle outside the calibration";
    }
    if (pedal.pedals() > kAllPedals) {
      verdict.broken = "a pedal that there is not";
    }
  }
  // The gate of a channel also counts missing lines; the gate above does not.
  constexpr std::size_t kBytesBeforeALineIsLate = 64;
  if (bytes.size() <= kBytesBeforeALineIsLate &&
      static_cast<int>(jaw.totals().good) != verdict.good_lines + verdict.good_frames) {
    verdict.broken = "the channel took other lines than the gate";
  }
  verdict.good_pedals = static_cast<int>(pedal.totals().good);
  return verdict;
}

}  // namespace fulcrum::handle_bridge
