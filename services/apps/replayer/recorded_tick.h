// One recorded tick of a node.
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
  std::uint64_t epoch = 0;  ///< Epoch of the node's process; another one means a restart.
  Tick tick;
  /// State hash after the tick; nullopt where none is recorded (haptics sends it with each model and each tenth tick).
  std::optional<std::uint64_t> state_hash;
  // Samples that the node consumed for the first time in this tick, oldest first.
  std::vector<ToolState> tools;
  std::vector<HandleState> handles;
  std::vector<GeneratorSetting> generator;
  std::vector<TopologyState> topology;
  std::vector<OpenCells> open_cells;
  std::vector<CauteryContact> cautery;
  std::vector<TearState> tears;
  std::vector<ContactModel> model;
  std::vector<OperatorInput> operators;
  /// Reason why this tick cannot be replayed; empty: it can.
  std::string missing;
};

}  // namespace fulcrum::replay
