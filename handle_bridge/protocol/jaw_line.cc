#include "handle_bridge/protocol/jaw_line.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace fulcrum::handle_bridge {
namespace {

constexpr double kVoltsPerUnit = 1e-4;

bool IsDigit(char c) { return c >= '0' && c <= '9'; }

}  // namespace

std::optional<int> ParseVoltage(std::string_view line) noexcept {
  if (line.size() != 6 || line[1] != '.') {
    return {};
  }
  int value = 0;
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (i == 1) {
      continue;
    }
    if (!IsDigit(line[i])) {
      return {};
    }
    value = 10 * value + (line[i] - '0');
  }
  return value;
}

JawReading JawLineGate::Check(std::string_view line) noexcept {
  if (IsFramed(line)) {
    const std::optional<Frame> frame = ParseFrame(line);
    if (!frame || frame->sender != settings_.sender) {
      Miss();
      return {frame ? LineVerdict::kOther : LineVerdict::kMalformed, 0};
    }
    const std::uint32_t lost = sequence_.Lost(frame->sequence);
    JawReading reading = frame->value <= kMaxCode ? CheckCode(frame->value) : JawReading{};
    reading.lost = lost;
    return reading;
  }
  const std::optional<int> units = ParseVoltage(line);
  if (!units) {
    Miss();
    return {};
  }
  const double counts = *units * kVoltsPerUnit / settings_.adc_step_V;
  const int code = static_cast<int>(std::lround(counts));
  if (std::abs(counts - code) > kGridTolerance || code > kMaxCode) {
    Miss();
    return {LineVerdict::kOffGrid, 0};
  }
  return CheckCode(code);
}

JawReading JawLineGate::CheckCode(int code) noexcept {
  if (code < settings_.min_code - kOutsideMargin || code > settings_.max_code + kOutsideMargin) {
    Miss();
    return {LineVerdict::kOutside, code};
  }
  if (last_code_ >= 0 && std::abs(code - last_code_) > allowed_jump_) {
    agreeing_ = agreeing_ > 0 && std::abs(code - candidate_) <= kMaxJump ? agreeing_ + 1 : 1;
    candidate_ = code;
    if (agreeing_ < kAgreeing) {
      Miss();
      return {LineVerdict::kJump, code};
    }
  }
  last_code_ = code;
  allowed_jump_ = kMaxJump;
  agreeing_ = 0;
  return {LineVerdict::kGood, code};
}

void JawLineGate::Miss() noexcept { allowed_jump_ = std::min(allowed_jump_ + 1, kMaxCode); }

void JawLineGate::Reset() noexcept {
  const SequenceCounter sequence = sequence_;
  Reconnected();
  sequence_ = sequence;
}

void JawLineGate::Reconnected() noexcept { *this = JawLineGate(settings_); }

}  // namespace fulcrum::handle_bridge
