#include "handle_bridge/node/handle_bridge_node.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include "handle_bridge/node/cart_links.h"

namespace fulcrum::handle_bridge {
namespace {

constexpr double kRadPerDeg = std::numbers::pi / 180.0;
/// Buffer for one tick's bytes. In 2.5 ms at 115200 baud at most 29 bytes arrive; the rest is for the backlog of a late
/// tick.
constexpr std::size_t kReadBytes = 512;

/// Longest time between two samples while nothing changes and no pedal is down: short for 0.2 s after a change of more
/// than kRestingAngle_rad, so that a lost sample is repeated, then long.
constexpr std::int64_t kShortSilence_ns = 9'000'000, kLongSilence_ns = 39'000'000, kRestsAfter_ns = 200'000'000;
/// Longest time between two steps at rest; lines that arrive end it.
constexpr std::int64_t kRest_ns = 40'000'000;
/// Changes of an angle since the newest sample that are published at once. A count of the converter is 0.03 rad.
constexpr float kSameAngle_rad = 0.005f;
/// Smaller changes since the last one, up to 0.4 counts, are noise of a jaw that rests between two counts.
constexpr float kRestingAngle_rad = 0.012f;

/// Lines at another speed than the cart's are as good as any.
bool IsInUse(LinkState state) { return state == LinkState::kOk || state == LinkState::kWrongBaud; }

bool LooksTheSame(const HandleSample& a, const HandleSample& b, float angle_rad) {
  return a.present == b.present && a.quality == b.quality && std::abs(a.jaw_angle_rad - b.jaw_angle_rad) < angle_rad;
}

}  // namespace

char SenderOf(config::Hand hand) { return hand == config::Hand::kLeft ? kLeftHandle : kRightHandle; }

JawChannelSettings MakeJawChannelSettings(const config::HandleConfig& handle, const CalibrationPoints* stored) {
  const config::JawCalibration& c = handle.calibration;
  std::array<double, JawCalibration::kMaxPoints> codes{}, angles_deg{};
  const std::size_t n = stored ? stored->codes.size() : c.volts.size();
  for (std::size_t i = 0; i < n; ++i) {
    codes[i] = stored ? stored->codes[i] : c.volts[i] / c.adc_step_V;
    angles_deg[i] = stored ? stored->angles_deg[i] : c.angles_rad[i] / kRadPerDeg;
  }
  JawLineSettings line;
  line.sender = SenderOf(handle.hand);
  line.adc_step_V = c.adc_step_V;
  line.min_code = static_cast<int>(std::lround(codes[0]));
  line.max_code = static_cast<int>(std::lround(codes[n - 1]));
  JawEstimatorSettings estimator;
  estimator.adc_step_V = c.adc_step_V;
  return {line, estimator, JawCalibration({codes.data(), n}, {angles_deg.data(), n})};
}

HandleBridgeNode::HandleBridgeNode(const config::CartConfig& cart, CalibrationStore calibrations, Links links,
                                   bus::Output<HandleState>* output, std::int64_t epoch_ns,
                                   bus::Input<ToolState>* tools)
    : handles_(cart.handles),
      calibrations_(std::move(calibrations)),
      links_(std::move(links)),
      buttons_(cart, tools),
      output_(output),
      stamper_(epoch_ns),
      scripted_(IsScripted(cart)) {
  for (std::size_t tool = 0; tool < jaws_.size(); ++tool) {
    if (links_.handles[tool]) {
      jaws_[tool].emplace(MakeJawChannelSettings(handles_[tool], nullptr));
      snapshot_.links[tool].configured = true;
    }
  }
  snapshot_.links[kMaxTools].configured = links_.pedal != nullptr;
  published_.Store(snapshot_);
}

void HandleBridgeNode::Step(const Tick& tick) {
  // A late thread skips whole periods, so the elapsed time is a multiple of the period.
  const double periods = snapshot_.stepping ? static_cast<double>(tick.index - next_index_ + 1) : 1.0;
  next_index_ = tick.index + 1;
  if (!snapshot_.stepping) {
    DropBacklog();
    snapshot_.stepping = true;
  }
  const double dt_s = periods * tick.dt_s;
  buttons_.Read(tick.stamp_ns);
  for (std::size_t tool = 0; tool < jaws_.size(); ++tool) {
    state_.handles[tool] = ReadHandle(tool, dt_s);
  }
  state_.pedals = ReadPedals(dt_s);
  Publish(tick);
  published_.Store(snapshot_);
  stepped_ns_ = tick.stamp_ns;
}

std::int64_t HandleBridgeNode::RestsUntil() const {
  const bool rests = scripted_ && stepped_ns_ - changed_ns_ >= kRestsAfter_ns && state_.pedals == kPedalNone;
  return rests ? stepped_ns_ + kRest_ns : stepped_ns_;
}

/// A pedal that is down is repeated each period: whether the current flows must not wait.
void HandleBridgeNode::Publish(const Tick& tick) {
  const auto is_like = [this](const HandleState& other, float angle_rad) {
    const auto same = [angle_rad](const HandleSample& a, const HandleSample& b) {
      return LooksTheSame(a, b, angle_rad);
    };
    return state_.pedals == kPedalNone && state_.pedals == other.pedals &&
           std::equal(state_.handles.begin(), state_.handles.end(), other.handles.begin(), same);
  };
  if (!is_like(rest_, kRestingAngle_rad)) {
    rest_ = state_;
    changed_ns_ = tick.stamp_ns;
  }
  const bool quiet = is_like(sent_, kSameAngle_rad);
  const std::int64_t silence_ns = tick.stamp_ns - changed_ns_ < kRestsAfter_ns ? kShortSilence_ns : kLongSilence_ns;
  if ((quiet && tick.stamp_ns - sent_.stamp.stamp_ns < silence_ns) || !output_->has_readers()) return;
  state_.stamp = stamper_.Next(tick.stamp_ns);
  output_->Write(state_);
  sent_ = state_;
}

void HandleBridgeNode::DropBacklog() {
  // While the node waited for its session, the kernel has buffered about a second of old lines.
  constexpr int kMostReads = 64;  // 32 KiB: several times what a terminal holds.
  std::array<char, kReadBytes> buffer;
  const auto drain = [&buffer](WatchedLink* link) {
    for (int i = 0; link && i < kMostReads && link->Read(buffer).bytes == buffer.size(); ++i) {
    }
  };
  for (std::size_t tool = 0; tool < jaws_.size(); ++tool) {
    drain(links_.handles[tool].get());
    if (links_.handles[tool]) {
      TakeCalibration(tool);
    }
  }
  drain(links_.pedal.get());
}

void HandleBridgeNode::TakeCalibration(std::size_t tool) {
  const CalibrationPoints* stored = calibrations_.Find(links_.handles[tool]->unit());
  if (stored == in_use_[tool]) {
    return;  // The same handle is connected again: its angle is held until its first line.
  }
  in_use_[tool] = stored;
  jaws_[tool]->SetUnit(MakeJawChannelSettings(handles_[tool], stored));
  snapshot_.links[tool].calibration_points = stored ? static_cast<std::uint32_t>(stored->codes.size()) : 0;
}

HandleSample HandleBridgeNode::ReadHandle(std::size_t tool, double dt_s) {
  const HandleSample line = jaws_[tool] ? ReadLine(tool, dt_s) : HandleSample();
  LinkHealth& health = snapshot_.links[tool];
  const bool by_button = buttons_.button(tool) > 0 && (!jaws_[tool] || !IsInUse(health.state));
  health.button = by_button ? buttons_.button(tool) : 0;
  return buttons_.Jaw(tool, line, by_button, dt_s);
}

HandleSample HandleBridgeNode::ReadLine(std::size_t tool, double dt_s) {
  JawChannel& jaw = *jaws_[tool];
  WatchedLink& link = *links_.handles[tool];
  LinkHealth& health = snapshot_.links[tool];
  std::array<char, kReadBytes> buffer;
  const ByteLink::Result read = link.Read(buffer);
  if (read.fresh) {
    TakeCalibration(tool);
    jaw.Reconnected();
  }
  if (read.phase == LinkPhase::kOpen) {
    jaw.Tick({buffer.data(), read.bytes}, dt_s);
    link.Evaluate(jaw.tick_counts(), dt_s);
  } else {
    jaw.Disconnected();
  }
  const JawEstimate estimate = jaw.estimate();
  health.state = link.state(jaw.state());
  health.reconnects = link.reconnects();
  health.quality = jaw.quality();
  health.jaw_deg = static_cast<float>(estimate.angle_deg);
  health.totals = jaw.totals();
  HandleSample sample;
  sample.present = jaw.present();
  sample.jaw_angle_rad = static_cast<float>(kRadPerDeg * estimate.angle_deg);
  sample.jaw_rate_rad_s = static_cast<float>(kRadPerDeg * estimate.rate_deg_s);
  sample.quality = health.quality;
  sample.raw_counts = static_cast<std::uint16_t>(jaw.code());
  return sample;
}

std::uint8_t HandleBridgeNode::ReadPedals(double dt_s) {
  LinkHealth& health = snapshot_.links[kMaxTools];
  if (!links_.pedal) {
    snapshot_.pedals = buttons_.has_pedals() ? buttons_.Pedals() : std::uint8_t{kPedalNone};
    return snapshot_.pedals;
  }
  std::array<char, kReadBytes> buffer;
  const ByteLink::Result read = links_.pedal->Read(buffer);
  if (read.fresh) {
    pedal_.Reconnected();
  }
  if (read.phase == LinkPhase::kOpen) {
    pedal_.Tick({buffer.data(), read.bytes}, dt_s);
    links_.pedal->Evaluate(pedal_.tick_counts(), dt_s);
  } else {
    pedal_.Disconnected();
  }
  health.state = links_.pedal->state(pedal_.state());
  health.reconnects = links_.pedal->reconnects();
  health.totals = pedal_.totals();
  const bool by_button = buttons_.has_pedals() && !IsInUse(health.state);
  health.button = by_button ? 1 : 0;
  snapshot_.pedals = by_button ? buttons_.Pedals() : pedal_.pedals();
  return snapshot_.pedals;
}

void HandleBridgeNode::FillHealth(Health* health) const {
  const Snapshot s = published_.Load();
  LinkCounts sum;
  std::uint32_t reconnects = 0;
  for (std::size_t i = 0; i < s.links.size(); ++i) {
    const LinkHealth& link = s.links[i];
    if (!link.configured) {
      continue;
    }
    sum += link.totals;
    reconnects += link.reconnects;
    if (s.stepping && link.state != LinkState::kOk) {
      // The remedy is given for the first fault only; the others are named, because the text is limited in length.
      const bool first = health->last_error.empty();
      health->last_error += first ? "" : "; ";
      health->last_error += i < kMaxTools ? std::string("handle ") + std::to_string(i) : "pedal";
      health->last_error +=
          std::string(": ") + Code(link.state) + (first ? std::string(": ") + Explain(link.state) : "");
      if (link.button > 0) {
        health->last_error +=
            i < kMaxTools ? "; meanwhile button " + std::to_string(link.button) + " of its haptic device closes the jaw"
                          : "; meanwhile buttons of the haptic devices are the pedals";
      }
      health->state = HealthState::kDegraded;
    }
    if (i < kMaxTools) {
      const std::string index = std::to_string(i);
      health->metrics.push_back({std::string("jaw") + index + "_deg", link.jaw_deg});
      health->metrics.push_back({std::string("quality") + index, link.quality});
      health->metrics.push_back(
          {std::string("calibration") + index + "_points", static_cast<double>(link.calibration_points)});
    }
  }
  health->metrics.push_back({"lines", static_cast<double>(sum.lines())});
  health->metrics.push_back({"bad_lines", static_cast<double>(sum.lines() - sum.good)});
  health->metrics.push_back({"lost_frames", static_cast<double>(sum.lost)});
  health->metrics.push_back({"reconnects", static_cast<double>(reconnects)});
  health->metrics.push_back({"pedals", static_cast<double>(s.pedals)});
}

}  // namespace fulcrum::handle_bridge
