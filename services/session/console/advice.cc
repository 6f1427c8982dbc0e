#include "services/session/console/advice.h"

#include <algorithm>
#include <string_view>
#include <utility>

#include "services/base/core/tick.h"
#include "services/session/supervisor/outcome.h"
#include "services/session/supervisor/session_view.h"

namespace fulcrum::console {
namespace {

// A warning of heat stands as long as one has come lately; injuries stay.
constexpr std::int64_t kWarningStands = 4 * kSecond_ns;
constexpr std::int64_t kRestartTold = 10 * kSecond_ns;
// Below this share of the rate asked for a node is slow: above the scatter of a second's count.
constexpr float kSlowShare = 0.8f;

bool IsStale(const Health& health, std::int64_t now_ns) {
  return now_ns - health.stamp.stamp_ns > supervisor::kSilence_ns;
}

bool IsSlow(const Health& health) {
  return health.state == HealthState::kRunning && health.rate_achieved_Hz > 0 &&
         health.rate_achieved_Hz < kSlowShare * health.rate_asked_Hz;
}

/// What the operator misses without it.
std::string_view Missing(NodeId node) {
  switch (node) {
    case NodeId::kHandleBridge:
      return "Jaws and pedal do not answer.";
    case NodeId::kHaptics:
      return "Tools stand still and no force is felt.";
    case NodeId::kPhysics:
      return "The tissue stands still; forces fade out.";
    case NodeId::kThermal:
      return "Nothing is heated or cut.";
    case NodeId::kRender:
      return "The picture stands still.";
    case NodeId::kRecorder:
      return "Nothing is recorded.";
    case NodeId::kSupervisor:
      break;
  }
  return "Nobody restarts what fails.";
}

void WarnOfNode(const NodeReport& report, const SituationReport& situation, std::vector<Warning>* warnings) {
  const Health& health = *report.health;
  const std::string name = PlainName(report.node);
  if (health.pid == 0) {
    if (situation.begun) {
      warnings->push_back({"fault", name + " has never reported. " + std::string(Missing(report.node)),
                           "Press Restart at its row. If it stays: end the session and read its log."});
    }
    return;
  }
  if (IsStale(health, situation.now_ns)) {
    const std::int64_t s = (situation.now_ns - health.stamp.stamp_ns) / kSecond_ns;
    warnings->push_back(
        {"fault", name + " has been silent for " + std::to_string(s) + " s. " + std::string(Missing(report.node)),
         "It is restarted by itself after 5 s. To be faster, press Restart at its row."});
    return;
  }
  if (report.restarted_ns != 0 && situation.now_ns - report.restarted_ns < kRestartTold) {
    warnings->push_back({"note", name + " was restarted and goes on.",
                         report.restarts < 3 ? "Nothing to do."
                                             : "It was restarted " + std::to_string(report.restarts) +
                                                   " times: read its log, and check cables and devices."});
  }
  if (!health.last_error.empty()) {
    warnings->push_back({"fault", name + ": " + health.last_error,
                         report.node == NodeId::kHandleBridge
                             ? "Check plug and power of the handle or pedal that is named."
                         : report.node == NodeId::kRecorder ? "Free some disk space, or record to another disk."
                                                            : "If it stays, press Restart at its row."});
  } else if (IsSlow(health)) {
    warnings->push_back({"fault",
                         name + " runs at " + supervisor::Fixed(static_cast<double>(health.rate_achieved_Hz), 0) +
                             " of " + supervisor::Fixed(static_cast<double>(health.rate_asked_Hz), 0) +
                             " Hz: the computer is too slow.",
                         "Close other programs; choose fewer pictures per second or a smaller scene."});
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
                          "Pedal up. Talk the step over; replay the recording."});
    } else if (recent(kinds.first)) {
      warnings.push_back({"danger", std::string("Heat near the ") + name + ".",
                          "Pedal up, move the hook away, or lift the tissue off."});
    }
  }
  if (!situation.bus_trouble.empty()) {
    warnings.push_back({"fault", "The session cannot be watched: " + situation.bus_trouble,
                        "Start console and session from the same installation."});
  }
  for (const NodeReport& report : situation.nodes) WarnOfNode(report, situation, &warnings);
  if (recent(ThermalEventKind::kQuarantine)) {
    warnings.push_back({"note", "A piece of tissue had to be reset.",
                        "Nothing to do; if it comes again, end the session and keep the recording."});
  }
  const auto rank = [](const Warning& warning) {
    return std::string_view(warning.level) == "danger" ? 0 : std::string_view(warning.level) == "fault" ? 1 : 2;
  };
  std::stable_sort(warnings.begin(), warnings.end(),
                   [&](const Warning& a, const Warning& b) { return rank(a) < rank(b); });
  return warnings;
}

}  // namespace fulcrum::console
