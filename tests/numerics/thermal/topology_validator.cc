#include "tests/numerics/thermal/topology_validator.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "services/base/core/sheets.h"

namespace fulcrum::thermal {
namespace {

std::size_t CountBits(const std::vector<std::uint8_t>& bits) {
  std::size_t count = 0;
  for (const std::uint8_t byte : bits) count += static_cast<std::size_t>(std::popcount(byte));
  return count;
}

}  // namespace

bool IsRemoved(const HeatField& field, CellIndex cell) {
  const Tile* tile = field.sheet().Contains(cell) ? field.Find(cell.ix / kTile, cell.iy / kTile) : nullptr;
  return tile != nullptr && (tile->state.flags[(cell.iy % kTile) * kTile + cell.ix % kTile] & kRemoved) != 0;
}

TopologyValidator::TopologyValidator(const SceneView& scene, const Sheet& sheet)
    : nodes_(scene.membrane_material.size()), absent_(AbsentNodes(scene)) {
  const Vec2f origin(static_cast<float>(sheet.origin_x), static_cast<float>(sheet.origin_y));
  for (const Vec2f& p : scene.membrane_material) node_.push_back(p / sheet.cell_m - origin);
  const Index cols = scene.membrane.cols;
  for (std::size_t e = 0; e < scene.membrane_rest_length.size(); ++e) {
    if (scene.membrane_rest_length[e] <= 0.0f) continue;
    const auto a = static_cast<Index>(e / 3);
    edges_.push_back({e, a, e % 3 == 0 ? a + 1 : (e % 3 == 1 ? a + cols : a + cols + 1)});
  }
}

CellIndex TopologyValidator::CellOfNode(Index node, const Sheet& sheet) const {
  return {std::clamp(static_cast<int>(std::floor(node_[node].x())), 0, sheet.nx - 1),
          std::clamp(static_cast<int>(std::floor(node_[node].y())), 0, sheet.ny - 1)};
}

void TopologyValidator::FindHoles(const HeatField& field) {
  const auto removed = [](std::uint8_t flags) { return (flags & kRemoved) != 0; };
  hole_.assign(field.sheet().tile_count(), false);
  for (const Tile* tile : field.Existing()) {
    hole_[tile->index] = std::any_of(tile->state.flags.begin(), tile->state.flags.end(), removed);
  }
}

bool TopologyValidator::NearHole(const Edge& edge, const Sheet& sheet) const {
  const Vec2f a = node_[edge.a], b = node_[edge.b];
  const float reach = 2.0f + kBandHalfWidth * (b - a).norm();
  const Vec2f low = a.cwiseMin(b).array() - reach, high = a.cwiseMax(b).array() + reach;
  const auto tile = [](float cell, int tiles) { return std::clamp(static_cast<int>(cell) / kTile, 0, tiles - 1); };
  for (int ty = tile(low.y(), sheet.tiles_y); ty <= tile(high.y(), sheet.tiles_y); ++ty) {
    for (int tx = tile(low.x(), sheet.tiles_x); tx <= tile(high.x(), sheet.tiles_x); ++tx) {
      if (hole_[ty * sheet.tiles_x + tx]) return true;
    }
  }
  return false;
}

bool TopologyValidator::Joined(const Edge& edge, const HeatField& field, bool holes, bool outside) const {
  const Sheet& sheet = field.sheet();
  const Vec2f a = node_[edge.a], along = node_[edge.b] - a;
  const float band = std::max(1.0f, kBandHalfWidth * along.norm());
  const CellIndex start = CellOfNode(edge.a, sheet), goal = CellOfNode(edge.b, sheet);
  const auto open = [&](CellIndex cell) {
    if (!sheet.Contains(cell) || (holes && IsRemoved(field, cell))) return false;
    if (cell == start || cell == goal) return true;
    if (!outside && sheet.IsOutside(cell.ix, cell.iy)) return false;
    const Vec2f p(static_cast<float>(cell.ix) + 0.5f, static_cast<float>(cell.iy) + 0.5f);
    const float u = std::clamp((p - a).dot(along) / along.squaredNorm(), 0.0f, 1.0f);
    return (p - a - u * along).squaredNorm() <= band * band;
  };
  if (!open(start) || !open(goal)) return false;
  // Depth first over faces; the strand is a few hundred cells.
  const int reach = static_cast<int>(band + along.norm()) + 4, width = 2 * reach + 1;
  std::vector<bool> seen(static_cast<std::size_t>(width) * width, false);
  std::vector<CellIndex> stack{start};
  while (!stack.empty()) {
    const CellIndex at = stack.back();
    stack.pop_back();
    if (at == goal) return true;
    for (const CellIndex next : {CellIndex{at.ix + 1, at.iy}, CellIndex{at.ix - 1, at.iy}, CellIndex{at.ix, at.iy + 1},
                                 CellIndex{at.ix, at.iy - 1}}) {
      if (!open(next)) continue;
      const int slot = (next.iy - start.iy + reach) * width + next.ix - start.ix + reach;
      if (seen[slot]) continue;
      seen[slot] = true;
      stack.push_back(next);
    }
  }
  return false;
}

std::string TopologyValidator::CheckEdge(const Edge& edge, const TopologyBits& bits, const HeatField& field) const {
  const std::string name = "edge " + std::to_string(edge.index);
  const bool dead = TestBit(bits.dead_edges, edge.index);
  if (edge.b >= nodes_) return name + " leads beyond the mesh";
  if (!dead && (TestBit(bits.dead_nodes, edge.a) || TestBit(bits.dead_nodes, edge.b))) {
    return name + " lives and ends at a dead node";
  }
  bool severed = false;
  if (NearHole(edge, field.sheet()) && !Joined(edge, field, true, false)) {
    severed = Joined(edge, field, false, false) || !Joined(edge, field, true, true);
  }
  if (severed != dead) return name + (dead ? " is dead, its strand is whole" : " lives, its strand is severed");
  return {};
}

std::string TopologyValidator::CheckNode(Index node, bool attached, const TopologyBits& bits,
                                         const HeatField& field) const {
  const bool gone = IsRemoved(field, CellOfNode(node, field.sheet()));
  if (TestBit(bits.dead_nodes, node) == (gone || !attached)) return {};
  return "node " + std::to_string(node) + (TestBit(bits.dead_nodes, node) ? " is dead" : " lives") +
         (gone ? ", its cell is removed" : ", its cell is whole") + (attached ? ", it has edges" : ", it has no edge");
}

std::string TopologyValidator::CheckHistory(const MeshTopology& topology) const {
  const TopologyBits& bits = topology.committed();
  if (topology.revision() < last_revision_) return "revision went back";
  for (std::size_t i = 0; i < last_.dead_nodes.size(); ++i) {
    if ((last_.dead_nodes[i] & ~bits.dead_nodes[i]) != 0) return "a node came back to life";
  }
  for (std::size_t i = 0; i < last_.dead_edges.size(); ++i) {
    if ((last_.dead_edges[i] & ~bits.dead_edges[i]) != 0) return "an edge came back to life";
  }
  for (std::size_t i = 0; i < last_.shrink.size(); ++i) {
    if (bits.shrink[i] < last_.shrink[i]) return "edge " + std::to_string(i) + " lost shrink";
  }
  const bool same =
      last_.dead_nodes == bits.dead_nodes && last_.dead_edges == bits.dead_edges && last_.shrink == bits.shrink;
  if (!last_.shrink.empty() && topology.revision() == last_revision_ && !same) return "changed without a new revision";
  return {};
}

std::string TopologyValidator::Check(const MeshTopology& topology, const HeatField& field) {
  const TopologyBits& bits = topology.committed();
  if (bits.dead_nodes.size() != (nodes_ + 7) / 8 || bits.dead_edges.size() != (3 * nodes_ + 7) / 8 ||
      bits.shrink.size() != 3 * nodes_) {
    return "wrong sizes";
  }
  if (CountBits(bits.dead_nodes) != topology.dead_node_count()) return "wrong count of dead nodes";
  if (CountBits(bits.dead_edges) != topology.dead_edge_count()) return "wrong count of dead edges";
  for (std::size_t n = nodes_; n < 8 * bits.dead_nodes.size(); ++n) {
    if (TestBit(bits.dead_nodes, n)) return "a node beyond the mesh is dead";
  }
  FindHoles(field);
  std::vector<bool> attached(nodes_, false);
  std::size_t next = 0;
  for (std::size_t e = 0; e < 8 * bits.dead_edges.size(); ++e) {
    if (next == edges_.size() || edges_[next].index != e) {
      if (TestBit(bits.dead_edges, e)) return "edge " + std::to_string(e) + " is dead and does not exist";
      if (e < bits.shrink.size() && bits.shrink[e] != 0)
        return "edge " + std::to_string(e) + " shrinks and does not exist";
      continue;
    }
    const Edge& edge = edges_[next++];
    if (std::string fault = CheckEdge(edge, bits, field); !fault.empty()) return fault;
    if (!TestBit(bits.dead_edges, e)) attached[edge.a] = attached[edge.b] = true;
  }
  for (Index node = 0; node < nodes_; ++node) {
    if (absent_[node] != 0) continue;
    if (std::string fault = CheckNode(node, attached[node], bits, field); !fault.empty()) return fault;
  }
  std::string fault = CheckHistory(topology);
  last_ = bits;
  last_revision_ = topology.revision();
  return fault;
}

}  // namespace fulcrum::thermal
