#include "handle_bridge/node/jaw_channel.h"

#include <algorithm>

namespace fulcrum::handle_bridge {
namespace {

/// Lines arrive in bursts, because the adapter buffers them; only a deficit beyond this number counts as lost lines.
constexpr double kLateLines = 8;
/// Longest time over which the filter predicts through lost lines [s]; beyond it the angle is held, which has the
/// smaller error.
constexpr double kMaxBlind_s = 0.05;

}  // namespace

JawChannel::JawChannel(const JawChannelSettings& settings)
    : gate_(settings.line), estimator_(settings.estimator, settings.calibration) {}

void JawChannel::Tick(std::span<const char> bytes, double dt_s) noexcept {
  connected_ = true;
  tick_counts_ = {};
  tick_counts_.bytes = static_cast<std::uint32_t>(bytes.size());
  owed_lines_ += dt_s * kLineRate_Hz;
  blind_s_ += dt_s;
  for (const char byte : bytes) {
    const LineFramer::Event event = framer_.Add(byte);
    if (event != LineFramer::Event::kNone) {
      TakeLine(event);
    }
  }
  monitor_.Add(tick_counts_, dt_s);
  totals_ += tick_counts_;
  if (blind_s_ > kMaxBlind_s) {
    HoldAngle();
  } else {
    for (; owed_lines_ > kLateLines; --owed_lines_) {
      estimator_.Predict();
      gate_.Miss();
    }
  }
  owed_lines_ = std::clamp(owed_lines_, -kLateLines, kLateLines);
}

void JawChannel::TakeLine(LineFramer::Event event) noexcept {
  --owed_lines_;
  const JawReading reading = event == LineFramer::Event::kLine ? gate_.Check(framer_.line()) : JawReading{};
  tick_counts_.lost += reading.lost;
  switch (reading.verdict) {
    case LineVerdict::kGood:
      ++tick_counts_.good;
      break;
    case LineVerdict::kMalformed:
      ++tick_counts_.malformed;
      break;
    case LineVerdict::kOffGrid:
      ++tick_counts_.off_grid;
      break;
    case LineVerdict::kOutside:
    case LineVerdict::kJump:
      ++tick_counts_.implausible;
      break;
    case LineVerdict::kOther:
      ++tick_counts_.other;
      break;
  }
  const bool good = reading.verdict == LineVerdict::kGood;
  if (good || reading.verdict == LineVerdict::kOutside || reading.verdict == LineVerdict::kJump) {
    wiring_.Add(reading.verdict);
  }
  if (wiring_.faulty()) {
    HoldAngle();  // Codes of a broken wire are random: some lie within the calibrated range but are not angles.
    return;
  }
  if (good) {
    code_ = reading.code;
    holding_ = false;
    blind_s_ = 0;
    estimator_.Update(reading.code);
    return;
  }
  // A bad line counts as one sample period, but noise with many line ends must not advance the filter beyond the clock.
  if (owed_lines_ > -1 && !holding_) {
    estimator_.Predict();
  }
}

void JawChannel::HoldAngle() noexcept {
  if (!holding_) {
    estimator_.Hold();
    gate_.Reset();
    holding_ = true;
  }
  owed_lines_ = 0;
}

void JawChannel::SetUnit(const JawChannelSettings& settings) noexcept {
  gate_ = JawLineGate(settings.line);
  estimator_ = JawEstimator(settings.estimator, settings.calibration);
}

void JawChannel::Reconnected() noexcept {
  framer_.Reset();
  monitor_.Reset();
  wiring_.Reset();
  HoldAngle();
  gate_.Reconnected();
  connected_ = true;
}

void JawChannel::Disconnected() noexcept {
  HoldAngle();
  connected_ = false;
}

LinkState JawChannel::state() const noexcept {
  const LinkState state = monitor_.state();
  return state == LinkState::kOk && wiring_.faulty() ? LinkState::kWiring : state;
}

}  // namespace fulcrum::handle_bridge
