// Debris: pieces of membrane without connection to an anchor.
#include "physics_node/tissue/tissue_model.h"
#include "services/base/core/slit_sheet.h"

namespace fulcrum::physics {

/// Ends of the live edges of a node; kNoIndex where there is none.
std::array<Index, 6> TissueModel::Neighbours(Index node) const {
  const std::array<Index, 3> apart{1, cols(), cols() + 1};
  std::array<Index, 6> ends;
  ends.fill(kNoIndex);
  const Index row = node / cols(), col = node % cols();
  for (int d = 0; d < 3; ++d) {
    const auto i = static_cast<std::size_t>(d);
    if (EdgeAlive(node, d)) {
      ends[i] = node + apart[i];
    }
    const bool inside = (d == 1 || col > 0) && (d == 0 || row > 0);
    if (inside && EdgeAlive(node - apart[i], d)) {
      ends[i + 3] = node - apart[i];
    }
  }
  return ends;
}

/// An anchor holds a piece of membrane: a fixed node of the rim, or a node with a binding to the organ.
bool TissueModel::IsAnchor(Index node) const {
  return scene_.inverse_mass[scene_.membrane.first + node] == 0.0f ||
         node_bindings_.start[node] < node_bindings_.start[node + 1];
}

/// Searches an anchor among the nodes that are connected to each changed node; a crumb without one becomes debris.
/// Larger pieces stay in the simulation.
void TissueModel::FindDebris(const std::vector<Index>& changed, ParticleStore* particles) {
  for (const Index start : changed) {
    if (!NodeAlive(start) || IsDebris(start)) {
      continue;
    }
    ++search_;
    piece_.assign(1, start);
    visited_[start] = search_;
    bool held = IsAnchor(start);
    for (std::size_t i = 0; i < piece_.size() && !held; ++i) {
      for (const Index next : Neighbours(piece_[i])) {
        if (next != kNoIndex && visited_[next] != search_) {
          visited_[next] = search_;
          piece_.push_back(next);
          held = held || IsAnchor(next) || piece_.size() >= kCrumbNodes;
        }
      }
    }
    if (held) {
      continue;
    }
    for (const Index node : piece_) {
      debris_[node] = kDebris;
      particles->SetInverseMass(particles->Ref(scene_.membrane.first + node), 0.0f);
    }
    for (const Index node : piece_) {
      RefreshTriangles(node);
    }
  }
}

void TissueModel::ClearDebris(ParticleStore* particles) {
  for (Index node = 0; node < debris_.size(); ++node) {
    if (debris_[node] == kDebris) {
      debris_[node] = 0;
      particles->SetInverseMass(particles->Ref(scene_.membrane.first + node),
                                BaseInverseMass(scene_.membrane.first + node));
      RefreshTriangles(node);
    }
  }
}

}  // namespace fulcrum::physics
