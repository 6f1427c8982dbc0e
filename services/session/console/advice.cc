#include "services/session/console/advice.h"

#include <algorithm>
#include <string_view>
#include <utility>

#include "services/base/core/tick.h"
#include "services/session/supervisor/outcome.h"
#include "services/session/supervisor/session_view.h"

namespace fulcrum::console {
namespace {

// A warning of heat is shown for this time after the last event; injuries stay.
constexpr std::int64_t kWarningStands = 4 * kSecond_ns;
constexpr std::int64_t kRestartTold = 10 * kSecond_ns;
// Below this share of the requested rate a node is slow; the margin covers the scatter of counts over one second.
constexpr float kSlowShare = 0.8f;

bool IsStale(const Health& health, std::int64_t now_ns) {
  return now_ns - health.stamp.stamp_ns > supervisor::kSilence_ns;
}

bool IsSlow(const Health& health) {
  return health.state == HealthState::kRunning && health.rate_achieved_Hz > 0 &&
         health.rate_achieved_Hz < kSlowShare * health.rate_asked_Hz;
}

/// Effect of a missing node for the operator.
std::string_view Missing(NodeId node) {
  switch (node) {
    case NodeId::kHandleBridge:
      return "Jaws and pedal have no effect.";
    case NodeId::kHaptics:
      return "Tools do not move and no force is rendered.";
    case NodeId::kPhysics:
      return "The tissue does not move; forces fade out.";
    case NodeId::kThermal:
      return "Nothing is heated or cut.";
    case NodeId::kRender:
      return "The picture does not change.";
    case NodeId::kRecorder:
      return "Nothing is recorded.";
    case NodeId::kSupervisor:
      break;
  }
  return "Failed nodes are not restarted.";
}

void WarnOfNode(const NodeReport& report, const SituationReport& situation, std::vector<Warning>* warnings) {
  const Health& health = *report.health;
  const std::string name = PlainName(report.node);
  if (health.pid == 0) {
    if (situation.begun) {
      warnings->push_back({"fault", name + " has never reported. " + std::string(Missing(report.node)),
                           "Press Restart in its row. If this warning stays, stop the session and read its log."});
    }
    return;
  }
  if (IsStale(health, situation.now_ns)) {
    const std::int64_t s = (situation.now_ns - health.stamp.stamp_ns) / kSecond_ns;
    warnings->push_back(
        {"fault", name + " has been silent for " + std::to_string(s) + " s. " + std::string(Missing(report.node)),
         "It is restarted automatically after 5 s. To restart it now, press Restart in its row."});
    return;
  }
  if (report.restarted_ns != 0 && situation.now_ns - report.restarted_ns < kRestartTold) {
    warnings->push_back({"note", name + " was restarted and runs again.",
                         report.restarts < 3 ? "Nothing to do."
                                             : "It was restarted " + std::to_string(report.restarts) +
                                                   " times: read its log, and check cables and devices."});
  }
  if (!health.last_error.empty()) {
    warnings->push_back({"fault", name + ": " + health.last_error,
                         report.node == NodeId::kHandleBridge
                             ? "Check plug and power of the handle or pedal named here."
                         : report.node == NodeId::kRecorder ? "Free some disk space, or record to another disk."
                                                            : "If this warning stays, press Restart in its row."});
  } else if (IsSlow(health)) {
    warnings->push_back({"fault",
                         name + " runs at " + supervisor::Fixed(static_cast<double>(health.rate_achieved_Hz), 0) +
                             " of " + supervisor::Fixed(static_cast<double>(health.rate_asked_Hz), 0) +
                             " Hz: the computer is too slow.",
                         "Close other programs, or choose fewer pictures per second or a smaller scene."});
  }
}

}  // namespace

const char* PlainName(NodeId node) {
  switch (node) {
    case NodeId::kSupervisor:
      return "Supervisor";
    case NodeId::kHandleBridge:
      return "Handles and pedal";
    case NodeId::kHaptics:
      return "Haptics";
    case NodeId::kPhysics:
      return "Tissue";
    case NodeId::kThermal:
      return "Heat";
    case NodeId::kRender:
      return "Picture";
    case NodeId::kRecorder:
      return "Recorder";
  }
  return "Unknown";
}

NodeCondition ConditionOf(const NodeReport& report, std::int64_t now_ns) {
  const Health& health = *report.health;
  if (health.pid == 0) return {"off", "Starting"};
  if (IsStale(health, now_ns)) return {"bad", "Silent"};
  switch (health.state) {
    case HealthState::kStarting:
      return {"off", "Starting"};
    case HealthState::kWaiting:
      return {"off", "Ready"};
    case HealthState::kStopping:
      return {"off", "Ending"};
    case HealthState::kDegraded:
      return {"busy", "Impaired"};
    case HealthState::kRunning:
      break;
  }
  if (!health.last_error.empty()) return {"busy", "Impaired"};
  return IsSlow(health) ? NodeCondition{"busy", "Slow"} : NodeCondition{"good", "Healthy"};
}

std::vector<Warning> WarningsOf(const SituationReport& situation) {
  std::vector<Warning> warnings;
  const auto at = [&](ThermalEventKind kind) { return situation.events_ns[static_cast<std::size_t>(kind)]; };
  const auto recent = [&](ThermalEventKind kind) {
    return at(kind) != 0 && situation.now_ns - at(kind) < kWarningStands;
  };
  const std::array<std::pair<const char*, std::pair<ThermalEventKind, ThermalEventKind>>, 2> structures{
      {{"ureter", {ThermalEventKind::kUreterWarning, ThermalEventKind::kUreterInjury}},
       {"nerve", {ThermalEventKind::kNerveWarning, ThermalEventKind::kNerveInjury}}}};
  for (const auto& [name, kinds] : structures) {
    if (at(kinds.second) != 0) {
      warnings.push_back({"danger", std::string("The ") + name + " is injured by heat.",
                          "Release the pedal. Discuss this step; replay the recording."});
    } else if (recent(kinds.first)) {
      warnings.push_back({"danger", std::string("Heat near the ") + name + ".",
                          "Release the pedal, move the hook away, or lift the tissue off."});
    }
  }
  if (recent(ThermalEventKind::kSolidBurn)) {
    warnings.push_back({"danger", "The hook burns the surface of an organ.",
                        "Release the pedal, or move the hook off the organ, unless this is meant."});
  }
  if (!situation.bus_trouble.empty()) {
    warnings.push_back({"fault", "The console cannot join the session: " + situation.bus_trouble,
                        "Start console and session from the same installation."});
  }
  if (situation.insecure_link) {
    warnings.push_back({"fault", "The link to the other computer has no keys: every computer on its network can join.",
                        "Start both with keys, without --insecure-link: fulcrum keys init."});
  }
  for (const NodeReport& report : situation.nodes) WarnOfNode(report, situation, &warnings);
  if (recent(ThermalEventKind::kQuarantine)) {
    warnings.push_back({"note", "A piece of tissue had to be reset.",
                        "Nothing to do. If this warning comes again, stop the session and keep the recording."});
  }
  const auto rank = [](const Warning& warning) {
    return std::string_view(warning.level) == "danger" ? 0 : std::string_view(warning.level) == "fault" ? 1 : 2;
  };
  std::stable_sort(warnings.begin(), warnings.end(),
                   [&](const Warning& a, const Warning& b) { return rank(a) < rank(b); });
  return warnings;
}

}  // namespace fulcrum::console
