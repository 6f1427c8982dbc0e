// Replayed nodes that feed each other.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "services/apps/replayer/recorded_tick.h"
#include "services/apps/replayer/replayed_node.h"

namespace fulcrum::replay {

/// What some nodes published, decoded, as far as others of them or a comparison need it.
struct Outcome {
  std::uint64_t state_hash = 0;
  std::optional<ToolState> tools;
  std::optional<TissueFrame> frame;
  std::optional<ContactModel> model;
  std::optional<CauteryContact> cautery;
  std::optional<TearState> tear;
  std::optional<TopologyState> topology;
  std::optional<OpenCells> open_cells;
  std::optional<TemperaturePatch> patch;
  std::vector<ThermalEvent> events;
};

class CoupledNodes {
 public:
  /// Throws InputError when a node cannot be replayed.
  CoupledNodes(const std::vector<NodeId>& nodes, const NodeMaking& making);

  /// Makes the tick; inputs that come from one of the nodes are taken from it instead of from the recording.
  Outcome Step(const RecordedTick& tick);

 private:
  template <class T>
  void Replace(NodeId owner, std::vector<T>* inputs, const std::map<std::int64_t, T>& sent) const;
  [[nodiscard]] bool Has(NodeId node) const { return nodes_.count(node) != 0; }

  std::map<NodeId, std::unique_ptr<ReplayedNode>> nodes_;
  // By the stamp of the tick that sent them: the newest second or so.
  std::map<std::int64_t, ToolState> tools_;
  std::map<std::int64_t, ContactModel> models_;
  std::map<std::int64_t, CauteryContact> cautery_;
  std::deque<TopologyState> topology_;  ///< Not yet taken.
  std::deque<OpenCells> open_cells_;    ///< The same.
  std::deque<TearState> tears_;         ///< The same.
};

}  // namespace fulcrum::replay
