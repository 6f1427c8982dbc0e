#include "services/session/supervisor/session_record.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "services/transport/bus/raw_input.h"

namespace fulcrum::supervisor {

void Curve::Add(double time_s, double value) {
  if (!std::isfinite(value)) {
    return;
  }
  max_ = std::max(max_, value);
  if (++skipped_ < stride_) {
    return;
  }
  skipped_ = 0;
  points_.push_back({time_s, value});
  if (points_.size() == kMostPoints) {
    for (std::size_t i = 0; 2 * i < points_.size(); ++i) {
      points_[i] = points_[2 * i];
    }
    points_.resize(points_.size() / 2);
    stride_ *= 2;
  }
}

const char* EventName(ThermalEventKind kind) {
  switch (kind) {
    case ThermalEventKind::kContact:
      return "contact";
    case ThermalEventKind::kBlanch:
      return "blanching";
    case ThermalEventKind::kSteam:
      return "steam";
    case ThermalEventKind::kCut:
      return "cut";
    case ThermalEventKind::kChar:
      return "charring";
    case ThermalEventKind::kUreterWarning:
      return "ureter warning";
    case ThermalEventKind::kUreterInjury:
      return "ureter injury";
    case ThermalEventKind::kNerveWarning:
      return "nerve warning";
    case ThermalEventKind::kNerveInjury:
      return "nerve injury";
    case ThermalEventKind::kQuarantine:
      return "region reset";
    case ThermalEventKind::kSolidBurn:
      return "organ burnt";
  }
  return "unknown";
}

void SessionRecord::AddHealth(double time_s, const Health& health) {
  NodeTrack& track = nodes_[static_cast<std::size_t>(health.node)];
  NodeFigures& figures = track.figures;
  if (health.stamp.epoch < track.epoch) {
    return;  // A sample of the previous process that was delivered late.
  }
  if (!figures.seen) {
    figures.seen = true;
    track.first_time_s = std::max(time_s, 0.0);
  }
  const bool is_new = health.stamp.epoch > track.epoch;
  if (is_new) {
    track.epoch = health.stamp.epoch;
    track.base_ticks += track.live_ticks;
    track.base_overruns += track.live_overruns;
    track.base_drops += track.live_drops;
  }
  const bool works = health.state == HealthState::kRunning || health.state == HealthState::kDegraded;
  const bool rejoins = health.state == HealthState::kRunning && figures.dead_since_s >= 0;
  if (rejoins) {
    const double rejoin_s = time_s - figures.dead_since_s;
    figures.dead_since_s = -1;
    figures.longest_rejoin_s = std::max(figures.longest_rejoin_s, rejoin_s);
    const auto last = std::find_if(restarts_.rbegin(), restarts_.rend(),
                                   [&](const RestartRecord& record) { return record.node == health.node; });
    if (last != restarts_.rend()) {
      last->rejoin_s = rejoin_s;
    }
  }
  track.live_ticks = health.ticks;
  track.live_overruns = health.overruns;
  track.live_drops = health.write_failures;
  for (const InputHealth& input : health.inputs) {
    track.live_drops += input.lost + input.rejected;
  }
  figures.heard_s = time_s;
  const bool advanced = is_new || !figures.begun || figures.ticks != track.base_ticks + track.live_ticks;
  if (works && (advanced || rejoins)) figures.progress_s = time_s;
  figures.begun |= works;
  figures.stepped = health.ticks > 0;
  figures.pid = health.pid;
  figures.state = health.state;
  figures.rate_asked_Hz = static_cast<double>(health.rate_asked_Hz);
  figures.rate_last_second_Hz = static_cast<double>(health.rate_achieved_Hz);
  figures.ticks = track.base_ticks + track.live_ticks;
  figures.overruns = track.base_overruns + track.live_overruns;
  figures.drops = track.base_drops + track.live_drops;
  const float step_max_us = std::max(figures.step.max_us, health.step.max_us);
  const float wake_max_us = std::max(figures.wake.max_us, health.wake.max_us);
  figures.step = health.step;
  figures.wake = health.wake;
  figures.step.max_us = step_max_us;
  figures.wake.max_us = wake_max_us;
  figures.last_error = health.last_error;
  if (time_s > track.first_time_s) {
    figures.rate_achieved_Hz = static_cast<double>(figures.ticks) / (time_s - track.first_time_s);
  }
  if (time_s >= 0) {
    for (const Metric& metric : health.metrics) {
      // A message of the recorder to the nodes, no figure.
      if (!metric.name.starts_with(bus::kReadsMetric)) curves_[metric.name].Add(time_s, metric.value);
    }
  }
}

void SessionRecord::AddEvent(const ThermalEvent& event) {
  ++event_counts_[event.kind];
  if (event.kind == ThermalEventKind::kSolidBurn && event.solid != kNoSolid) {
    double& burnt_m2 = burnt_m2_[event.solid];
    burnt_m2 = std::max(burnt_m2, static_cast<double>(event.value));
  }
  if (events_.size() < kMostEvents) {
    events_.push_back({event.session_time_s, event.kind, static_cast<double>(event.temperature_C)});
  }
}

void SessionRecord::AddDeath(double time_s, NodeId node, const std::string& cause, bool for_good, bool asked) {
  NodeFigures& figures = nodes_[static_cast<std::size_t>(node)].figures;
  if (figures.dead_since_s < 0) {
    figures.dead_since_s = std::max(time_s, 0.0);
  }
  figures.ended_by_command = asked;
  figures.failed = for_good;
  if (!for_good) {
    ++figures.restarts;
    figures.crashes += asked ? 0 : 1;
  }
  restarts_.push_back({time_s, node, cause, asked, -1});
}

void SessionRecord::AddRefusals(double time_s, const bus::Refusals& refusals) {
  for (std::size_t i = refused_.size(); i < refusals.texts.size(); ++i) {
    refused_.push_back({std::max(time_s, 0.0), refusals.texts[i]});
  }
  refusals_ = refusals;
}

const Curve& SessionRecord::curve(const std::string& metric) const {
  static const Curve kNone;
  const auto found = curves_.find(metric);
  return found == curves_.end() ? kNone : found->second;
}

namespace {

/// The membrane had current while the script cut. Of a record that has not kept all events: at any time.
bool CutCurrentInMembrane(const SessionRecord& record, const ScriptDemands& demands) {
  // From the script's pedal to the event at the tip, and the other way round at the end of a pedal.
  constexpr double kLate_s = 0.5;
  if (!record.event_counts().contains(ThermalEventKind::kContact)) return false;
  if (demands.cutting.empty() || record.events().size() == SessionRecord::kMostEvents) return true;
  return std::ranges::any_of(record.events(), [&](const EventRecord& event) {
    return event.kind == ThermalEventKind::kContact && std::ranges::any_of(demands.cutting, [&](const TimeSpan& span) {
             return event.time_s >= span.begin_s && event.time_s <= span.end_s + kLate_s;
           });
  });
}

}  // namespace

std::string MissingFrom(const SessionRecord& record, const ScriptDemands& demands) {
  const auto missing = [](const char* what, double value, double least) {
    char text[160];
    std::snprintf(text, sizeof(text), "%s, although the scene's script demands it (%.2f mm; at least %.1f mm expected)",
                  what, value, least);
    return std::string(text);
  };
  // Current in an organ and none in the membrane: the script burns organs, which cuts nothing and hardly moves them.
  const bool burns = !record.burnt_m2().empty();
  const bool organs_only = burns && !record.event_counts().contains(ThermalEventKind::kContact);
  const double displacement = record.peak("max_displacement_mm");
  if (demands.deformation && displacement < kLeastDisplacement_mm && (demands.grasp || !organs_only)) {
    return missing("nothing was deformed", displacement, kLeastDisplacement_mm);
  }
  const double cut = record.peak("cut_length_mm");
  if (demands.cut && cut < kLeastCut_mm && (!burns || CutCurrentInMembrane(record, demands))) {
    return missing("nothing was cut", cut, kLeastCut_mm);
  }
  return {};
}

}  // namespace fulcrum::supervisor
