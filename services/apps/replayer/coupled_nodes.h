// Replayed nodes that receive each other's outputs.
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

/// Decoded outputs of a tick, as far as other nodes or a comparison need them.
struct Outcome {
  std::uint64_t state_hash = 0;
  std::optional<ToolState> tools;  ///< Of a tick of haptics; the newest that it has published.
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
  /// Makes the nodes. Throws InputError when one cannot be replayed.
  CoupledNodes(const std::vector<NodeId>& nodes, const NodeMaking& making);

  /// Computes a tick. Inputs that one of the nodes publishes are taken from that node instead of from the recording.
  Outcome Step(const RecordedTick& tick);

 private:
  template <class T>
  void Replace(NodeId owner, std::vector<T>* inputs, const std::map<std::int64_t, T>& sent) const;
  /// A tool stays where it is until the next sample.
  void ReplaceTools(std::vector<ToolState>* inputs) const;
  /// Sent samples on their way to one reader, of which only the newest counts.
  template <class T>
  struct Way {
    std::deque<T> sent;         ///< Not consumed by any tick yet.
    std::optional<T> consumed;  ///< The newest that a tick has consumed.
  };
  /// Replaces the inputs by what has arrived until the tick. A reader that has just started gets the newest sample
  /// again, like any late joiner.
  template <class T>
  static void Deliver(const Tick& tick, bool starts, Way<T>* way, std::vector<T>* inputs);
  [[nodiscard]] bool Has(NodeId node) const { return nodes_.count(node) != 0; }

  std::map<NodeId, std::unique_ptr<ReplayedNode>> nodes_;
  // By the stamp of the sending tick; about the newest second is kept.
  std::map<std::int64_t, ToolState> tools_;
  std::map<std::int64_t, ContactModel> models_;
  std::map<std::int64_t, CauteryContact> cautery_;
  Way<TopologyState> topology_;
  Way<OpenCells> open_cells_;
  Way<TearState> tears_;
  std::map<NodeId, std::uint64_t> epochs_;  ///< Of each node's last tick.
};

}  // namespace fulcrum::replay
