#include "services/session/supervisor/verdict.h"

#include <algorithm>

#include "services/session/supervisor/outcome.h"
#include "services/session/supervisor/watch_times.h"

namespace fulcrum::supervisor {
namespace {

constexpr double kHeldUp_s = 1e-9 * static_cast<double>(kHeldUp_ns);

/// A metric that is 0 in a session that is well.
struct FaultMetric {
  const char* metric;
  NodeId node;         ///< Its last_error is the cause.
  const char* before;  ///< Text before the value; nullptr: the text has no value.
  const char* after;
};
constexpr std::array kFaultMetrics{
    FaultMetric{"quarantined", NodeId::kPhysics, "physics_node reset ", " particles that were not finite or too fast"},
    FaultMetric{"quarantined_cells", NodeId::kThermal, "thermal_node excluded ", " cells that were not plausible"},
    FaultMetric{"forces_not_finite", NodeId::kHaptics, "haptics_node computed ", " forces that were not finite"},
    FaultMetric{"png_failed", NodeId::kRender, "render_node could not write ", " pictures"},
    FaultMetric{"png_dropped", NodeId::kRender, "render_node dropped ", " pictures, because writing was too slow"},
    FaultMetric{"recording_ended", NodeId::kRecorder, nullptr, "the recording ended before the session"},
    FaultMetric{"foreign_samples", NodeId::kSupervisor, "nodes dropped ",
                " samples of another session: somebody else writes on this bus"}};

std::string Percent(double share) { return Fixed(100 * share, 0) + " %"; }
std::string Name(NodeId node) { return NodeName(node); }
std::string WithCause(const std::string& text, const std::string& cause) {
  return cause.empty() ? text : text + ": " + cause;
}

}  // namespace

// An ordinary user without real-time scheduling, beside six busy loops on two cores, measured over 8 s: handle_bridge
// 67 %, haptics_node 86 %, physics_node 88 %, thermal_node 93 %, render_node 80 % of the rate asked for (beside two:
// 96, 96, 97, 98, 88 %). A machine that leaves less than the first row is too slow for the session.
NodeLimits LimitsOf(NodeId node) {
  switch (node) {
    case NodeId::kHaptics:
    case NodeId::kPhysics:
    case NodeId::kThermal:
      return {0.75, 0.15};
    case NodeId::kHandleBridge:
      return {0.6, 0.4};  // A skipped period delays a jaw angle by 2.5 ms.
    case NodeId::kRender:
      // Software OpenGL draws as many pictures as the processor allows: 25 % at a load of 20 on two cores.
      return {0.2, 1};
    case NodeId::kRecorder:
      return {0.5, 1};  // A late write is no loss; losses are counted.
    case NodeId::kSupervisor:
      break;
  }
  return {};
}

void Verdict::Add(const std::string& key, const Fault& fault) {
  if (known_.insert(key).second) faults_.push_back(fault);
}

void Verdict::Watch(double time_s, const SessionRecord& record) {
  // The machine or this process was suspended: nothing was received meanwhile.
  if (const double gap_s = time_s - last_s_; gap_s > kHeldUp_s) {
    no_gap_before_s_ = time_s + (gap_s > 1e-9 * kNearLease_ns ? 1e-9 * kRematch_ns : 0);
  }
  last_s_ = time_s;
  for (const NodeId node : session_.nodes) {
    WatchRestarts(node, time_s, record);
    if (time_s < 0) continue;
    WatchProgress(node, kLongestGap_s, time_s, record.node(node));
    WatchRate(node, time_s, record.node(node));
  }
  if (time_s < 0) return;
  for (const NodeId node : session_.remote) {
    WatchProgress(node, kLongestRemoteGap_s, time_s, record.node(node));
    WatchRate(node, time_s, record.node(node));
  }
  WatchRecorder(time_s, record);
  WatchMetrics(time_s, record);
}

void Verdict::WatchProgress(NodeId node, double longest_gap_s, double time_s, const NodeFigures& figures) {
  if (figures.failed || figures.state == HealthState::kStopping) return;
  const bool is_dead = figures.dead_since_s >= 0 && figures.progress_s <= figures.dead_since_s;
  if (is_dead || !figures.begun) {
    const double since_s = std::max({is_dead ? figures.dead_since_s : 0.0, no_gap_before_s_, 0.0});
    // After a swap the program may be one that sends no Health.
    if (time_s - since_s > kLongestAbsence_s && !(is_dead && figures.ended_by_command)) {
      Add("absent " + Name(node), {time_s, Name(node) + (is_dead ? " did not run again" : " did not begin") +
                                               " within " + Fixed(kLongestAbsence_s, 0) + " s"});
    }
    return;
  }
  // The first step is part of the start: a picture compiles and uploads what it shows.
  if (!figures.stepped) longest_gap_s = std::max(longest_gap_s, kLongestAbsence_s);
  if (figures.rate_asked_Hz > 0) longest_gap_s = std::max(longest_gap_s, kLongestGap_periods / figures.rate_asked_Hz);
  if (time_s - std::max(figures.progress_s, no_gap_before_s_) <= longest_gap_s) return;
  const bool is_silent = time_s - std::max(figures.heard_s, no_gap_before_s_) > longest_gap_s;
  Add("gap " + Name(node), {time_s, Name(node) + (is_silent ? " was silent" : " was stuck") + " for more than " +
                                        Fixed(longest_gap_s, 1) + " s"});
}

void Verdict::WatchRate(NodeId node, double time_s, const NodeFigures& figures) {
  Window& window = windows_[static_cast<std::size_t>(node)];
  const bool runs = figures.begun && !figures.failed && figures.dead_since_s < 0;
  if (!runs || window.begin_s < 0 || window.restarts != figures.restarts) {
    window = {runs ? figures.heard_s : -1, figures.ticks, figures.restarts};
    return;
  }
  if (figures.heard_s - window.begin_s < kRateWindow_s) return;
  JudgeRate(node, time_s, figures);
  window = {figures.heard_s, figures.ticks, figures.restarts};
}

void Verdict::JudgeRate(NodeId node, double time_s, const NodeFigures& figures) {
  const Window& window = windows_[static_cast<std::size_t>(node)];
  const double span_s = figures.heard_s - window.begin_s, least = LimitsOf(node).least_rate;
  const double rate_Hz = static_cast<double>(figures.ticks - window.ticks) / span_s;
  if (rate_Hz >= least * figures.rate_asked_Hz) return;
  Add("rate " + Name(node),
      {time_s, Name(node) + " ran at " + Fixed(rate_Hz, 1) + " of " + Fixed(figures.rate_asked_Hz, 0) + " Hz over " +
                   Fixed(span_s, 0) + " s; at least " + Percent(least) + " are needed"});
}

void Verdict::WatchRestarts(NodeId node, double time_s, const SessionRecord& record) {
  const NodeFigures& figures = record.node(node);
  if (figures.crashes == 0) return;
  const auto last = std::find_if(record.restarts().rbegin(), record.restarts().rend(),
                                 [&](const RestartRecord& restart) { return restart.node == node && !restart.asked; });
  const std::string cause = last != record.restarts().rend() ? last->cause : std::string();
  if (node == NodeId::kRecorder) {
    Add("recorder died", {time_s, WithCause("samples were lost with the recorder, which died", cause)});
  }
  if (figures.crashes <= session_.restarts) return;
  Add("restarts " + Name(node),
      {time_s, WithCause(Name(node) + " died " + std::to_string(figures.crashes) + " times, of which " +
                             std::to_string(session_.restarts) + " are allowed (verdict.restarts of the cart)",
                         cause)});
}

void Verdict::WatchRecorder(double time_s, const SessionRecord& record) {
  const NodeFigures& recorder = record.node(NodeId::kRecorder);
  if (recorder.drops == 0) return;
  Add("losses", {time_s, WithCause("the recorder lost samples", recorder.last_error)});
}

void Verdict::WatchMetrics(double time_s, const SessionRecord& record) {
  for (const FaultMetric& fault : kFaultMetrics) {
    const double value = record.peak(fault.metric);
    if (value <= 0) continue;
    const std::string count = fault.before != nullptr ? fault.before + Fixed(value, 0) : std::string();
    Add(fault.metric, {time_s, WithCause(count + fault.after, record.node(fault.node).last_error)});
  }
}

void Verdict::Close(double time_s, const SessionRecord& record) {
  const auto judge = [&](NodeId node) {
    const NodeFigures& figures = record.node(node);
    if (!figures.begun || figures.heard_s < kShortestRate_s) return;
    const Window& window = windows_[static_cast<std::size_t>(node)];
    if (window.begin_s >= 0 && figures.heard_s - window.begin_s >= kShortestRate_s) JudgeRate(node, time_s, figures);
    const auto missed = static_cast<double>(figures.overruns);
    const double share = missed / std::max(1.0, missed + static_cast<double>(figures.ticks));
    const double most = LimitsOf(node).most_missed;
    if (share <= most) return;
    Add("missed " + Name(node), {time_s, Name(node) + " missed " + Percent(share) + " of its periods; at most " +
                                             Percent(most) + " are allowed"});
  };
  std::for_each(session_.nodes.begin(), session_.nodes.end(), judge);
  std::for_each(session_.remote.begin(), session_.remote.end(), judge);
}

ExitCode Verdict::code() const {
  if (faults_.empty()) return ExitCode::kDone;
  const auto special =
      std::find_if(faults_.begin(), faults_.end(), [](const Fault& fault) { return fault.code != ExitCode::kFailure; });
  return special != faults_.end() ? special->code : ExitCode::kFailure;
}

}  // namespace fulcrum::supervisor
