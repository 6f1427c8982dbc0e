// What is wrong, in plain words, and what to do about it. Pure.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "services/base/core/messages.h"

namespace fulcrum::console {

/// How a node is, for a glance from two metres.
struct NodeCondition {
  const char* level;  ///< "good", "busy", "bad", "off": the page has a colour for each.
  const char* word;   ///< "Healthy", "Slow", "Silent", …
};

/// What is known of one node.
struct NodeReport {
  NodeId node = NodeId::kSupervisor;
  const Health* health = nullptr;  ///< pid 0: never heard.
  int restarts = 0;
  std::int64_t restarted_ns = 0;  ///< 0: never.
};

[[nodiscard]] NodeCondition ConditionOf(const NodeReport& report, std::int64_t now_ns);

/// "Haptics", "Tissue", "Heat", …
[[nodiscard]] const char* PlainName(NodeId node);

struct Warning {
  const char* level;  ///< "danger": the patient or a figure is at stake; "fault": something does not work; "note".
  std::string text, todo;
};

struct SituationReport {
  std::int64_t now_ns = 0;
  bool begun = false;
  std::vector<NodeReport> nodes;
  /// When an event of each ThermalEventKind last came [ns]; 0: none.
  std::array<std::int64_t, 10> events_ns{};
  std::string bus_trouble;
};

/// Most urgent first.
[[nodiscard]] std::vector<Warning> WarningsOf(const SituationReport& situation);

}  // namespace fulcrum::console
