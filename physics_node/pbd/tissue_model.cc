#include "physics_node/pbd/tissue_model.h"

#include <algorithm>
#include <cmath>

#include "physics_node/pbd/constraints.h"
#include "services/core/error.h"

namespace fulcrum::physics {
namespace {

/// Part of a constraint's rest value of sum w |gradient|^2 below which it is not divided by. An element flattened to
/// a few per cent would otherwise be blown up in one step.
constexpr float kFloorPart = 1e-3f;
/// Part of a hinge triangle's rest |normal|^2 below which its angle has no usable gradient.
constexpr float kNormalFloorPart = 1e-4f;

/// A piece of at most so many nodes (about 2 cm^2 of the built-in sheet) that nothing holds is debris. The search for
/// an anchor looks no further, which keeps an edit cheap; larger pieces go on moving.
constexpr std::size_t kLargestDebris = 250;

[[noreturn]] void Refuse(const SceneView& scene, const std::string& what) {
  throw InputError(std::string("scene '") + scene.name + "': " + what);
}

/// Calls add(first, last) for each colour and refuses offsets that do not cover the constraints.
template <class Add>
void ForEachColour(const SceneView& scene, std::span<const Index> offsets, std::size_t count, const char* what,
                   const Add& add) {
  if (count == 0) {
    return;
  }
  if (offsets.size() < 2 || offsets.front() != 0 || offsets.back() != count) {
    Refuse(scene, std::string(what) + ": colour offsets do not cover the constraints");
  }
  for (std::size_t c = 0; c + 1 < offsets.size(); ++c) {
    if (offsets[c] > offsets[c + 1]) {
      Refuse(scene, std::string(what) + ": colour offsets are not sorted");
    }
    add(offsets[c], offsets[c + 1]);
  }
}

/// Refuses two constraints of one colour on one particle: eight of them are solved at once.
class ColourCheck {
 public:
  explicit ColourCheck(std::size_t particles) : last_(particles, kNoIndex) {}
  void Begin() { ++colour_; }
  [[nodiscard]] bool Add(Index particle) {
    if (particle >= last_.size() || last_[particle] == colour_) {
      return false;
    }
    last_[particle] = colour_;
    return true;
  }

 private:
  std::vector<Index> last_;
  Index colour_ = kNoIndex;
};

/// Compressed rows of "who uses a node" from (node, user) pairs.
void Compress(std::vector<std::pair<Index, Index>> pairs, std::size_t nodes, std::vector<Index>* start,
              std::vector<Index>* users) {
  std::sort(pairs.begin(), pairs.end());
  start->assign(nodes + 1, 0);
  users->clear();
  for (const auto& [node, user] : pairs) {
    ++(*start)[node + 1];
    users->push_back(user);
  }
  for (std::size_t i = 0; i < nodes; ++i) {
    (*start)[i + 1] += (*start)[i];
  }
}

}  // namespace

TissueModel::TissueModel(const SceneView& scene, ParticleStore* particles)
    : scene_(scene), layout_(scene.membrane.rows, scene.membrane.cols) {
  const std::size_t nodes = scene.membrane.node_count();
  if (scene.membrane.first != scene.tube_vertex_count ||
      scene.rest_position.size() != scene.tube_vertex_count + nodes ||
      scene.inverse_mass.size() != scene.rest_position.size() || scene.membrane_rest_length.size() != 3 * nodes) {
    Refuse(scene, "the particles must be the tube's vertices followed by the membrane's grid");
  }
  dead_nodes_.assign((nodes + 7) / 8, 0);
  dead_edges_.assign((3 * nodes + 7) / 8, 0);
  shrink_.assign(3 * nodes, 0);
  debris_.assign(nodes, 0);
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

void TissueModel::PackTube(const SceneView& scene, const ParticleStore& particles) {
  const Index padding = particles.padding_vertex();
  ColourCheck check(scene.tube_vertex_count);
  ForEachColour(scene, scene.tube_edge_colours, scene.tube_edges.size(), "tube edges", [&](Index first, Index last) {
    check.Begin();
    for (Index i = first; i < last; ++i) {
      const Index lane = (i - first) % kLanes;
      if (lane == 0) {
        SpringBatch& fresh = springs_.emplace_back();
        std::fill_n(fresh.a, kLanes, padding);
        std::fill_n(fresh.b, kLanes, padding);
        std::fill_n(fresh.rest, kLanes, 0.0f);
      }
      const StretchConstraint& edge = scene.tube_edges[i];
      if (!check.Add(edge.a) || !check.Add(edge.b)) {
        Refuse(scene, "tube edges: two of one colour share a vertex, or a vertex is not the tube's");
      }
      SpringBatch& batch = springs_.back();
      batch.a[lane] = edge.a;
      batch.b[lane] = edge.b;
      batch.rest[lane] = edge.rest_length;
      ++counts_.stretch;
    }
  });
  ForEachColour(scene, scene.tet_colours, scene.tets.size(), "tetrahedra", [&](Index first, Index last) {
    check.Begin();
    for (Index i = first; i < last; ++i) {
      const Index lane = (i - first) % kLanes;
      if (lane == 0) {
        TetBatch& fresh = tets_.emplace_back();
        for (auto& v : fresh.v) {
          std::fill_n(v, kLanes, padding);
        }
        std::fill_n(fresh.rest_volume, kLanes, 0.0f);
        std::fill_n(fresh.floor, kLanes, 1.0f);
      }
      TetBatch& batch = tets_.back();
      std::array<V3<double>, 4> x;
      for (int j = 0; j < 4; ++j) {
        const Index v = scene.tets[i][j];
        if (!check.Add(v)) {
          Refuse(scene, "tetrahedra: two of one colour share a vertex, or a vertex is not the tube's");
        }
        batch.v[j][lane] = v;
        x[j] = scene.rest_position[v].cast<double>();
      }
      const auto rest = Volume<double>(x, 0.0);
      double sum = 0, heaviest = 0;
      for (int j = 0; j < 4; ++j) {
        const double w = scene.inverse_mass[scene.tets[i][j]];
        sum += w * rest.gradient[j].squaredNorm();
        heaviest = std::max(heaviest, rest.gradient[j].squaredNorm());
      }
      batch.rest_volume[lane] = static_cast<float>(rest.value);
      // With all four vertices fixed there is nothing to move; any positive floor does.
      batch.floor[lane] = static_cast<float>(kFloorPart * (sum > 0 ? sum : heaviest));
      ++counts_.volume;
    }
  });
}

void TissueModel::PackBending(const SceneView& scene, const ParticleStore& particles) {
  ColourCheck check(scene.rest_position.size());
  std::vector<std::pair<Index, Index>> users;
  const ParticleRef padding{4 * particles.padding_vertex(), 1};
  ForEachColour(scene, scene.bending_colours, scene.bending.size(), "bending", [&](Index first, Index last) {
    check.Begin();
    for (Index i = first; i < last; ++i) {
      const Index lane = (i - first) % kLanes;
      if (lane == 0) {
        BendingBatch& fresh = bending_.emplace_back();
        for (int j = 0; j < 4; ++j) {
          std::fill_n(fresh.base[j], kLanes, padding.base);
          std::fill_n(fresh.step[j], kLanes, padding.step);
        }
        std::fill_n(fresh.rest_angle, kLanes, 0.0f);
        std::fill_n(fresh.floor, kLanes, 1.0f);
        std::fill_n(fresh.active, kLanes, 0.0f);
        bending_patch_.resize(bending_.size() * kLanes);
      }
      const BendingConstraint& constraint = scene.bending[i];
      BendingBatch& batch = bending_.back();
      const auto slot = static_cast<Index>((bending_.size() - 1) * kLanes + lane);
      Patch patch{kNoIndex, 0, kNoIndex, 0};
      bool on_membrane = true;
      for (int j = 0; j < 4; ++j) {
        const Index p = constraint.v[j];
        if (!check.Add(p)) {
          Refuse(scene, "bending: two of one colour share a particle, or a particle does not exist");
        }
        const ParticleRef at = particles.Ref(p);
        batch.base[j][lane] = at.base;
        batch.step[j][lane] = at.step;
        on_membrane = on_membrane && p >= scene.membrane.first;
        if (on_membrane) {
          const Index row = (p - scene.membrane.first) / cols(), col = (p - scene.membrane.first) % cols();
          patch = {std::min(patch.row0, row), std::max(patch.row1, row), std::min(patch.col0, col),
                   std::max(patch.col1, col)};
        }
      }
      if (on_membrane) {
        bending_patch_[slot] = patch;
        for (Index row = patch.row0; row <= patch.row1; ++row) {
          for (Index col = patch.col0; col <= patch.col1; ++col) {
            users.emplace_back(row * cols() + col, slot);
          }
        }
      }
      const auto& x = scene.rest_position;
      const Vec3f &x0 = x[constraint.v[0]], &x1 = x[constraint.v[1]];
      const float n1 = (x0 - x[constraint.v[2]]).cross(x1 - x[constraint.v[2]]).squaredNorm();
      const float n2 = (x0 - x[constraint.v[3]]).cross(x1 - x[constraint.v[3]]).squaredNorm();
      batch.rest_angle[lane] = constraint.rest_angle;
      batch.floor[lane] = kNormalFloorPart * std::min(n1, n2);
      batch.active[lane] = 1.0f;
      ++counts_.bending;
    }
  });
  Compress(std::move(users), scene.membrane.node_count(), &bending_start_, &bending_of_);
}

void TissueModel::PackBindings(const SceneView& scene, const ParticleStore& particles) {
  ColourCheck check(scene.rest_position.size());
  std::vector<std::pair<Index, Index>> users;
  ForEachColour(scene, scene.binding_colours, scene.bindings.size(), "bindings", [&](Index first, Index last) {
    check.Begin();
    for (Index i = first; i < last; ++i) {
      const Index lane = (i - first) % kLanes;
      if (lane == 0) {
        BindingBatch fresh{};
        for (auto& base : fresh.base) {
          std::fill_n(base, kLanes, 4 * particles.padding_vertex());
        }
        for (auto& step : fresh.step) {
          std::fill_n(step, kLanes, 1u);
        }
        bindings_.push_back(fresh);
      }
      const Binding& binding = scene.bindings[i];
      if (binding.membrane < scene.membrane.first || !check.Add(binding.membrane)) {
        Refuse(scene, "bindings: the bound particle is not a membrane node, or two of one colour share it");
      }
      const std::array<Index, 4> v{binding.membrane, binding.surface[0], binding.surface[1], binding.surface[2]};
      BindingBatch& batch = bindings_.back();
      for (int j = 0; j < 4; ++j) {
        if (j > 0 && (v[j] >= scene.tube_vertex_count || !check.Add(v[j]))) {
          Refuse(scene, "bindings: a surface vertex is not the tube's, or two of one colour share it");
        }
        const ParticleRef at = particles.Ref(v[j]);
        batch.base[j][lane] = at.base;
        batch.step[j][lane] = at.step;
      }
      const auto& x = scene.rest_position;
      Vec3f foot = Vec3f::Zero();
      for (int j = 0; j < 3; ++j) {
        batch.barycentric[j][lane] = binding.barycentric[j];
        foot += binding.barycentric[j] * x[v[j + 1]];
      }
      const Vec3f normal = (x[v[2]] - x[v[1]]).cross(x[v[3]] - x[v[1]]).normalized();
      batch.rest_length[lane] = binding.rest_length;
      batch.rest_height[lane] = std::max(0.0f, normal.dot(x[v[0]] - foot));
      batch.active[lane] = 1.0f;
      users.emplace_back(binding.membrane - scene.membrane.first,
                         static_cast<Index>((bindings_.size() - 1) * kLanes + lane));
      ++counts_.bindings;
    }
  });
  Compress(std::move(users), scene.membrane.node_count(), &binding_start_, &binding_of_);
}

std::array<Index, 3> TissueModel::TriangleNodes(Index triangle) const {
  const Index cell = triangle / 2, cells = scene_.membrane.cols - 1;
  const Index n00 = cell / cells * scene_.membrane.cols + cell % cells;
  const Index n11 = n00 + scene_.membrane.cols + 1;
  return triangle % 2 == 0 ? std::array<Index, 3>{n00, n00 + 1, n11}
                           : std::array<Index, 3>{n00, n11, n00 + scene_.membrane.cols};
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
  if (binding_start_[node] == binding_start_[node + 1] || !NodeAlive(node)) {
    return std::nullopt;
  }
  const Index slot = binding_of_[binding_start_[node]], lane = slot % kLanes;
  const BindingBatch& batch = bindings_[slot / kLanes];
  BindingView view{{}, {}, batch.rest_length[lane]};
  for (std::size_t j = 0; j < 3; ++j) {
    view.surface[j] = {batch.base[j + 1][lane], batch.step[j + 1][lane]};
    view.barycentric[j] = batch.barycentric[j][lane];
  }
  return view;
}

void TissueModel::RefreshEdge(Index node, int direction) {
  const Index edge = 3 * node + direction;
  const float rest = scene_.membrane_rest_length[edge];
  const std::uint32_t at = layout_.Offset(node / scene_.membrane.cols, node % scene_.membrane.cols);
  rest_[direction][at] = rest > 0.0f && EdgeAlive(node, direction)
                             ? rest * (1.0f - kShrinkUnit * static_cast<float>(shrink_[edge]))
                             : 0.0f;
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

/// Triangles of the four cells around a node.
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
  for (Index i = bending_start_[node]; i < bending_start_[node + 1]; ++i) {
    const Index slot = bending_of_[i];
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
  for (Index i = binding_start_[node]; i < binding_start_[node + 1]; ++i) {
    const Index slot = binding_of_[i];
    bindings_[slot / kLanes].active[slot % kLanes] = NodeAlive(node) ? 1.0f : 0.0f;
  }
  const Index particle = scene_.membrane.first + node;
  particles->SetInverseMass(particles->Ref(particle), BaseInverseMass(particle));
}

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

/// Holds a piece of membrane in its place: the rim, or a binding to the organ.
bool TissueModel::IsAnchor(Index node) const {
  return scene_.inverse_mass[scene_.membrane.first + node] == 0.0f || binding_start_[node] < binding_start_[node + 1];
}

/// From each changed node, looks for an anchor among what it still hangs together with.
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
          held = held || IsAnchor(next) || piece_.size() > kLargestDebris;
        }
      }
    }
    if (held) {
      continue;
    }
    for (const Index node : piece_) {
      debris_[node] = 1;
      particles->SetInverseMass(particles->Ref(scene_.membrane.first + node), 0.0f);
    }
    for (const Index node : piece_) {
      RefreshTriangles(node);
    }
  }
}

void TissueModel::ForgetDebris(ParticleStore* particles) {
  for (Index node = 0; node < debris_.size(); ++node) {
    if (debris_[node] != 0) {
      debris_[node] = 0;
      particles->SetInverseMass(particles->Ref(scene_.membrane.first + node),
                                BaseInverseMass(scene_.membrane.first + node));
      RefreshTriangles(node);
    }
  }
}

int TissueModel::Apply(const TopologyState& topology, ParticleStore* particles) {
  if (topology.rows != rows() || topology.cols != cols() || topology.dead_nodes.size() != dead_nodes_.size() ||
      topology.dead_edges.size() != dead_edges_.size() || topology.shrink.size() != shrink_.size()) {
    return -1;
  }
  int edits = 0;
  bool revived = false;
  changed_nodes_.clear();
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
        mark(node);  // Its neighbours lose a hold.
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
  constexpr std::size_t kChunk = 256;  // Most chunks are equal: compare them whole.
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
    // What was debris may hang on something again. Rare: only when the heat has lost its state.
    ForgetDebris(particles);
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
