// Conditions of the nodes and warnings for the operator, each with its remedy. Pure functions.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "services/base/core/messages.h"

namespace fulcrum::console {

/// Condition of a node as one word, readable from two metres.
struct NodeCondition {
  const char* level;  ///< "good", "busy", "bad", "off": the page has a colour for each.
  const char* word;   ///< "Healthy", "Slow", "Silent", …
};

/// State of one node as reported by its Health and the supervisor's.
struct NodeReport {
  NodeId node = NodeId::kSupervisor;
  const Health* health = nullptr;  ///< Newest Health; pid 0: none has arrived.
  int restarts = 0;
  std::int64_t restarted_ns = 0;  ///< Time of the last restart [ns]; 0: none.
};

[[nodiscard]] NodeCondition ConditionOf(const NodeReport& report, std::int64_t now_ns);

/// Name of a node for the operator: "Haptics", "Tissue", "Heat", …
[[nodiscard]] const char* PlainName(NodeId node);

struct Warning {
  const char* level;  ///< "danger": an injury or its warning; "fault": a part does not work; "note": information.
  std::string text, todo;
};

struct SituationReport {
  std::int64_t now_ns = 0;
  bool begun = false;
  std::vector<NodeReport> nodes;
  /// Time of the last event of each ThermalEventKind [ns]; 0: none.
  std::array<std::int64_t, kThermalEventKinds> events_ns{};
  std::string bus_trouble;
  bool insecure_link = false;  ///< The link to another host has no keys.
};

/// All warnings, the most urgent first.
[[nodiscard]] std::vector<Warning> WarningsOf(const SituationReport& situation);

}  // namespace fulcrum::console
