// One tick of a node as a recording has it.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "services/base/core/messages.h"
#include "services/base/core/tick.h"

namespace fulcrum::replay {

struct RecordedTick {
  NodeId node = NodeId::kPhysics;
  std::uint64_t epoch = 0;  ///< Of the node's process: another one is a restart.
  Tick tick;
  /// Of the node after the tick; none where it said nothing (haptics says it with each model and each tenth tick).
  std::optional<std::uint64_t> state_hash;
  // What the node took in that it had not yet had, oldest first.
  std::vector<ToolState> tools;
  std::vector<HandleState> handles;
  std::vector<GeneratorSetting> generator;
  std::vector<TopologyState> topology;
  std::vector<OpenCells> open_cells;
  std::vector<CauteryContact> cautery;
  std::vector<TearState> tears;
  std::vector<ContactModel> model;
  /// Why this tick cannot be made again; empty: it can.
  std::string missing;
};

}  // namespace fulcrum::replay
