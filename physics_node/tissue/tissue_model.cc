#include "physics_node/tissue/tissue_model.h"

#include "services/base/core/error.h"
#include "services/base/core/sheets.h"
#include "services/base/core/slit_sheet.h"

namespace fulcrum::physics {

TissueModel::TissueModel(const TissueScene& scene, ParticleStore* particles)
    : scene_(scene), layout_(scene.membrane.rows, scene.membrane.cols) {
  const std::size_t nodes = scene.membrane.node_count();
  if (scene.membrane.first != scene.tube_vertex_count ||
      scene.rest_position.size() != scene.tube_vertex_count + nodes ||
      scene.inverse_mass.size() != scene.rest_position.size() || scene.membrane_rest_length.size() != 3 * nodes) {
    throw InputError(std::string("scene '") + scene.name +
                     "': the particles must be the tube's vertices followed by the membrane's grid");
  }
  dead_nodes_.assign((nodes + 7) / 8, 0);
  dead_edges_.assign((3 * nodes + 7) / 8, 0);
  shrink_.assign(3 * nodes, 0);
  debris_ = AbsentNodes(scene);
  for (std::uint8_t& node : debris_) node = node != 0 ? kAbsent : 0;
  visited_.assign(nodes, 0);
  triangle_alive_.assign(scene.membrane.triangle_count(), 1);
  for (int d = 0; d < 3; ++d) {
    rest_[d] = FloatArray(layout_.plane());
  }
  counts_.vertices = scene.rest_position.size();
  for (Index node = 0; node < nodes; ++node) {
    for (int d = 0; d < 3; ++d) {
      RefreshEdge(node, d);
      counts_.stretch += scene.membrane_rest_length[3 * node + d] > 0.0f;
    }
  }
  for (Index t = 0; t < triangle_alive_.size(); ++t) {
    RefreshTriangle(t);
  }
  PackTube(scene, *particles);
  PackBending(scene, *particles);
  PackBindings(scene, *particles);
}

std::array<Index, 3> TissueModel::TriangleNodes(Index triangle) const {
  return MembraneTriangleAt(scene_.membrane.cols, triangle).nodes;
}

bool TissueModel::EdgeAlive(Index node, int direction) const {
  const Index other = node + std::array<Index, 3>{1, scene_.membrane.cols, scene_.membrane.cols + 1}[direction];
  return scene_.membrane_rest_length[3 * node + direction] > 0.0f && !TestBit(dead_edges_, 3 * node + direction) &&
         NodeAlive(node) && NodeAlive(other);
}

float TissueModel::BaseInverseMass(Index particle) const {
  if (particle >= scene_.membrane.first) {
    const Index node = particle - scene_.membrane.first;
    if (!NodeAlive(node) || IsDebris(node)) {
      return 0.0f;
    }
  }
  return scene_.inverse_mass[particle];
}

std::optional<BindingView> TissueModel::BindingOf(Index node) const {
  if (node_bindings_.start[node] == node_bindings_.start[node + 1] || !NodeAlive(node)) {
    return std::nullopt;
  }
  const Index slot = node_bindings_.of[node_bindings_.start[node]], lane = slot % kLanes;
  const BindingBatch& batch = bindings_[slot / kLanes];
  BindingView view{{}, {}, batch.rest_length[lane]};
  for (std::size_t j = 0; j < 3; ++j) {
    view.surface[j] = {batch.base[j + 1][lane], batch.step[j + 1][lane]};
    view.barycentric[j] = batch.barycentric[j][lane];
  }
  return view;
}

}  // namespace fulcrum::physics
