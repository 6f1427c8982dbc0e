// The topology of a scene's sheets without a cut.
#pragma once

#include "services/base/core/scene_view.h"

namespace fulcrum {

inline TopologyState WholeTopology(const SheetScene& scene) {
  TopologyState topology;
  const std::size_t nodes = scene.membrane.node_count();
  topology.scene_hash = scene.hash;
  topology.rows = scene.membrane.rows;
  topology.cols = scene.membrane.cols;
  topology.dead_nodes.assign((nodes + 7) / 8, 0);
  topology.dead_edges.assign((3 * nodes + 7) / 8, 0);
  topology.shrink.assign(3 * nodes, 0);
  return topology;
}

}  // namespace fulcrum
