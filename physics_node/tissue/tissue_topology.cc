// Cuts and shrinking, applied in place to the constraints that an edit affects.
#include <algorithm>

#include "physics_node/tissue/tissue_model.h"

namespace fulcrum::physics {

void TissueModel::RefreshEdge(Index node, int direction) {
  const Index edge = 3 * node + direction;
  const float rest = scene_.membrane_rest_length[edge];
  const std::uint32_t at = layout_.Offset(node / scene_.membrane.cols, node % scene_.membrane.cols);
  rest_[direction][at] = rest > 0.0f && EdgeAlive(node, direction)
                             ? rest * (1.0f - kShrinkUnit * static_cast<float>(shrink_[edge]))
                             : 0.0f;
  edited_edges_.push_back(edge);
}

void TissueModel::RefreshTriangle(Index triangle) {
  const auto [a, b, c] = TriangleNodes(triangle);
  // Half 0 is (n00, n01, n11): edges along the row, down the next column, diagonal. Half 1 is (n00, n11, n10).
  const bool alive = triangle % 2 == 0 ? EdgeAlive(a, 0) && EdgeAlive(b, 1) && EdgeAlive(a, 2)
                                       : EdgeAlive(a, 2) && EdgeAlive(c, 0) && EdgeAlive(a, 1);
  triangle_alive_[triangle] = alive && !IsDebris(a) ? 1 : 0;
}

bool TissueModel::HingeAlive(Index slot) const {
  const Patch& patch = bending_patch_[slot];
  for (Index row = patch.row0; row <= patch.row1; ++row) {
    for (Index col = patch.col0; col <= patch.col1; ++col) {
      const Index node = row * cols() + col;
      const bool right = col < patch.col1, down = row < patch.row1;
      if (!NodeAlive(node) || (right && !EdgeAlive(node, 0)) || (down && !EdgeAlive(node, 1)) ||
          (right && down && !EdgeAlive(node, 2))) {
        return false;
      }
    }
  }
  return true;
}

/// Refreshes the triangles of the four cells around a node.
void TissueModel::RefreshTriangles(Index node) {
  const Index row = node / cols(), col = node % cols();
  for (Index r = row > 0 ? row - 1 : 0; r < std::min(row + 1, rows() - 1); ++r) {
    for (Index c = col > 0 ? col - 1 : 0; c < std::min(col + 1, cols() - 1); ++c) {
      RefreshTriangle(2 * (r * (cols() - 1) + c));
      RefreshTriangle(2 * (r * (cols() - 1) + c) + 1);
    }
  }
}

void TissueModel::RefreshHinges(Index node, bool died) {
  for (Index i = node_bending_.start[node]; i < node_bending_.start[node + 1]; ++i) {
    const Index slot = node_bending_.of[i];
    bending_[slot / kLanes].active[slot % kLanes] = !died && HingeAlive(slot) ? 1.0f : 0.0f;
  }
}

void TissueModel::RefreshNode(Index node, ParticleStore* particles) {
  const Index row = node / cols(), col = node % cols();
  for (int d = 0; d < 3; ++d) {
    RefreshEdge(node, d);
  }
  if (col > 0) {
    RefreshEdge(node - 1, 0);
  }
  if (row > 0) {
    RefreshEdge(node - cols(), 1);
  }
  if (row > 0 && col > 0) {
    RefreshEdge(node - cols() - 1, 2);
  }
  RefreshTriangles(node);
  RefreshHinges(node, !NodeAlive(node));
  for (Index i = node_bindings_.start[node]; i < node_bindings_.start[node + 1]; ++i) {
    const Index slot = node_bindings_.of[i];
    bindings_[slot / kLanes].active[slot % kLanes] = NodeAlive(node) ? 1.0f : 0.0f;
  }
  const Index particle = scene_.membrane.first + node;
  particles->SetInverseMass(particles->Ref(particle), BaseInverseMass(particle));
}

int TissueModel::Apply(const TopologyState& topology, ParticleStore* particles) {
  if (topology.rows != rows() || topology.cols != cols() || topology.dead_nodes.size() != dead_nodes_.size() ||
      topology.dead_edges.size() != dead_edges_.size() || topology.shrink.size() != shrink_.size()) {
    return -1;
  }
  int edits = 0;
  bool revived = false;
  changed_nodes_.clear();
  edited_edges_.clear();
  const Index nodes = scene_.membrane.node_count();
  const auto mark = [&](Index node) {
    for (const Index neighbour : Neighbours(node)) {
      if (neighbour != kNoIndex) {
        changed_nodes_.push_back(neighbour);
      }
    }
    changed_nodes_.push_back(node);
  };
  for (std::size_t byte = 0; byte < dead_nodes_.size(); ++byte) {
    for (std::uint8_t changed = dead_nodes_[byte] ^ topology.dead_nodes[byte]; changed != 0;
         changed = static_cast<std::uint8_t>(changed & (changed - 1))) {
      const auto node = static_cast<Index>(8 * byte + static_cast<unsigned>(__builtin_ctz(changed)));
      if (node < nodes && NodeAlive(node)) {
        mark(node);  // Its neighbours lose an edge each.
      }
      dead_nodes_[byte] = static_cast<std::uint8_t>(dead_nodes_[byte] ^ (1u << (node % 8)));
      if (node < nodes) {
        RefreshNode(node, particles);
        revived |= NodeAlive(node);
        ++edits;
      }
    }
  }
  const auto refresh_edge = [&](Index edge, bool cut) {
    if (edge < 3 * nodes && scene_.membrane_rest_length[edge] > 0.0f) {
      const Index node = edge / 3, other = node + std::array<Index, 3>{1, cols(), cols() + 1}[edge % 3];
      RefreshEdge(node, static_cast<int>(edge % 3));
      if (cut) {
        RefreshTriangles(node);
        RefreshHinges(node, TestBit(dead_edges_, edge));
        revived |= !TestBit(dead_edges_, edge);
        changed_nodes_.push_back(node);
        changed_nodes_.push_back(other);
      }
      ++edits;
    }
  };
  for (std::size_t byte = 0; byte < dead_edges_.size(); ++byte) {
    for (std::uint8_t changed = dead_edges_[byte] ^ topology.dead_edges[byte]; changed != 0;
         changed = static_cast<std::uint8_t>(changed & (changed - 1))) {
      const auto edge = static_cast<Index>(8 * byte + static_cast<unsigned>(__builtin_ctz(changed)));
      dead_edges_[byte] = static_cast<std::uint8_t>(dead_edges_[byte] ^ (1u << (edge % 8)));
      refresh_edge(edge, true);
    }
  }
  // Bytes that are compared at a time: most of them have not changed, and std::equal compares whole vectors.
  constexpr std::size_t kChunk = 256;
  for (std::size_t at = 0; at < shrink_.size(); at += kChunk) {
    const std::size_t end = std::min(at + kChunk, shrink_.size());
    if (std::equal(shrink_.begin() + static_cast<std::ptrdiff_t>(at),
                   shrink_.begin() + static_cast<std::ptrdiff_t>(end),
                   topology.shrink.begin() + static_cast<std::ptrdiff_t>(at))) {
      continue;
    }
    for (std::size_t edge = at; edge < end; ++edge) {
      if (shrink_[edge] != topology.shrink[edge]) {
        shrink_[edge] = topology.shrink[edge];
        refresh_edge(static_cast<Index>(edge), false);
      }
    }
  }
  if (revived) {
    // A revived node or edge can connect debris to an anchor. Rare: thermal_node was restarted without its state.
    ClearDebris(particles);
    changed_nodes_.clear();
    for (Index node = 0; node < nodes; ++node) {
      changed_nodes_.push_back(node);
    }
  }
  FindDebris(changed_nodes_, particles);
  revision_ = topology.revision;
  return edits;
}

}  // namespace fulcrum::physics
