// Packs the constraints of a scene into the batches of the kernels.
#include <algorithm>
#include <cmath>
#include <utility>

#include "physics_node/tissue/constraints.h"
#include "physics_node/tissue/tissue_model.h"
#include "services/base/core/error.h"

namespace fulcrum::physics {
namespace {

/// Least divisor of a volume constraint, as a share of sum w |gradient|^2 at rest. Without it an element flattened to a
/// few per cent of its height, whose gradients vanish, would be blown up in one step.
constexpr float kFloorPart = 1e-3f;
/// Least divisor of |normal|^2 of a hinge triangle, as a share of its rest value: with less than a hundredth of its
/// area the angle has no usable gradient.
constexpr float kNormalFloorPart = 1e-4f;

[[noreturn]] void Refuse(const TissueScene& scene, const std::string& what) {
  throw InputError(std::string("scene '") + scene.name + "': " + what);
}

/// Appends room for `count` constraints of one colour; unused lanes hold `inert`.
template <class Batch>
void AddBatches(std::size_t count, const Batch& inert, std::vector<Batch>* batches) {
  const std::size_t full = kLanes * kBatchesAtOnce;
  batches->resize(batches->size() + (count + full - 1) / full * kBatchesAtOnce, inert);
}

/// Batch and lane of constraint i of the colour [first, last), whose batches are the last ones of `batches`.
template <class Batch>
std::pair<std::size_t, std::size_t> SlotOf(Index i, Index first, Index last, const std::vector<Batch>& batches) {
  const std::size_t full = kLanes * kBatchesAtOnce;
  const std::size_t start = batches.size() - (last - first + full - 1) / full * kBatchesAtOnce;
  return {start + (i - first) / kLanes, (i - first) % kLanes};
}

/// Calls add(first, last) for each colour; throws if the offsets do not cover the constraints.
template <class Add>
void ForEachColour(const TissueScene& scene, std::span<const Index> offsets, std::size_t count, const char* what,
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

/// Detects two constraints of one colour on one particle, which the kernels would project at the same time.
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

/// Compressed rows of the constraints of each node, from (node, constraint) pairs.
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

void TissueModel::PackTube(const TissueScene& scene, const ParticleStore& particles) {
  const Index padding = 4 * particles.padding_vertex();
  ColourCheck check(scene.tube_vertex_count);
  SpringBatch no_springs{};
  std::fill_n(no_springs.a, kLanes, padding);
  std::fill_n(no_springs.b, kLanes, padding);
  ForEachColour(scene, scene.tube_edge_colours, scene.tube_edges.size(), "tube edges", [&](Index first, Index last) {
    check.Begin();
    AddBatches(last - first, no_springs, &springs_);
    for (Index i = first; i < last; ++i) {
      const auto [at, lane] = SlotOf(i, first, last, springs_);
      const StretchConstraint& edge = scene.tube_edges[i];
      if (!check.Add(edge.a) || !check.Add(edge.b)) {
        Refuse(scene, "tube edges: two of one colour share a vertex, or a vertex is not the tube's");
      }
      SpringBatch& batch = springs_[at];
      batch.a[lane] = 4 * edge.a;
      batch.b[lane] = 4 * edge.b;
      batch.rest[lane] = edge.rest_length;
      ++counts_.stretch;
    }
  });
  TetBatch no_tets{};
  for (auto& v : no_tets.v) {
    std::fill_n(v, kLanes, padding);
  }
  std::fill_n(no_tets.floor, kLanes, 1.0f);
  ForEachColour(scene, scene.tet_colours, scene.tets.size(), "tetrahedra", [&](Index first, Index last) {
    check.Begin();
    AddBatches(last - first, no_tets, &tets_);
    for (Index i = first; i < last; ++i) {
      const auto [at, lane] = SlotOf(i, first, last, tets_);
      TetBatch& batch = tets_[at];
      slots_.tet.push_back(static_cast<Index>(at * kLanes + lane));
      std::array<V3<double>, 4> x;
      for (int j = 0; j < 4; ++j) {
        const Index v = scene.tets[i][j];
        if (!check.Add(v)) {
          Refuse(scene, "tetrahedra: two of one colour share a vertex, or a vertex is not the tube's");
        }
        batch.v[j][lane] = 4 * v;
        x[j] = scene.rest_position[v].cast<double>();
      }
      const auto rest = Volume<double>(x, 0.0);
      double sum = 0, heaviest = 0;
      for (int j = 0; j < 4; ++j) {
        const double w = scene.inverse_mass[scene.tets[i][j]];
        sum += w * rest.gradient[j].squaredNorm();
        heaviest = std::max(heaviest, rest.gradient[j].squaredNorm());
      }
      batch.rest_volume[lane] = static_cast<float>(6 * rest.value);
      // 36: the kernel uses six times the gradients. Four fixed vertices do not move; any positive floor will do.
      batch.floor[lane] = static_cast<float>(36 * kFloorPart * (sum > 0 ? sum : heaviest));
      ++counts_.volume;
    }
  });
}

void TissueModel::PackBending(const TissueScene& scene, const ParticleStore& particles) {
  ColourCheck check(scene.rest_position.size());
  std::vector<std::pair<Index, Index>> users;
  // Places in the compact copy of the particles that hinges use, in memory order; the last one is the padding.
  std::vector<Index> place(scene.rest_position.size(), kNoIndex);
  for (const BendingConstraint& constraint : scene.bending) {
    for (const Index p : constraint.v) {
      if (p < place.size()) {
        place[p] = 0;
      }
    }
  }
  for (Index p = 0; p < place.size(); ++p) {
    if (place[p] != kNoIndex) {
      place[p] = static_cast<Index>(hinge_particles_.size());
      hinge_particles_.push_back(particles.Ref(p));
    }
  }
  slots_.hinge.assign(scene.bending.size(), 0);
  BendingBatch no_hinges{};
  for (auto& v : no_hinges.v) {
    std::fill_n(v, kLanes, static_cast<Index>(4 * hinge_particles_.size()));
  }
  std::fill_n(no_hinges.floor, kLanes, 1.0f);
  hinge_particles_.push_back({4 * particles.padding_vertex(), 1});
  ForEachColour(scene, scene.bending_colours, scene.bending.size(), "bending", [&](Index first, Index last) {
    check.Begin();
    AddBatches(last - first, no_hinges, &bending_);
    bending_patch_.resize(bending_.size() * kLanes);
    for (Index i = first; i < last; ++i) {
      const auto [at, lane] = SlotOf(i, first, last, bending_);
      const BendingConstraint& constraint = scene.bending[i];
      BendingBatch& batch = bending_[at];
      const auto slot = static_cast<Index>(at * kLanes + lane);
      slots_.hinge[i] = slot;
      Patch patch{kNoIndex, 0, kNoIndex, 0};
      bool on_membrane = true;
      for (int j = 0; j < 4; ++j) {
        const Index p = constraint.v[j];
        if (!check.Add(p)) {
          Refuse(scene, "bending: two of one colour share a particle, or a particle does not exist");
        }
        batch.v[j][lane] = 4 * place[p];
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
  Compress(std::move(users), scene.membrane.node_count(), &node_bending_.start, &node_bending_.of);
}

void TissueModel::PackBindings(const TissueScene& scene, const ParticleStore& particles) {
  ColourCheck check(scene.rest_position.size());
  std::vector<std::pair<Index, Index>> users;
  BindingBatch no_bindings{};
  for (int j = 0; j < 4; ++j) {
    std::fill_n(no_bindings.base[j], kLanes, 4 * particles.padding_vertex());
    std::fill_n(no_bindings.step[j], kLanes, 1u);
  }
  ForEachColour(scene, scene.binding_colours, scene.bindings.size(), "bindings", [&](Index first, Index last) {
    check.Begin();
    AddBatches(last - first, no_bindings, &bindings_);
    for (Index i = first; i < last; ++i) {
      const auto [at, lane] = SlotOf(i, first, last, bindings_);
      const Binding& binding = scene.bindings[i];
      if (binding.membrane < scene.membrane.first || !check.Add(binding.membrane)) {
        Refuse(scene, "bindings: the bound particle is not a membrane node, or two of one colour share it");
      }
      const std::array<Index, 4> v{binding.membrane, binding.surface[0], binding.surface[1], binding.surface[2]};
      BindingBatch& batch = bindings_[at];
      for (int j = 0; j < 4; ++j) {
        if (j > 0 && (v[j] >= scene.tube_vertex_count || !check.Add(v[j]))) {
          Refuse(scene, "bindings: a surface vertex is not the tube's, or two of one colour share it");
        }
        const ParticleRef ref = particles.Ref(v[j]);
        batch.base[j][lane] = ref.base;
        batch.step[j][lane] = ref.step;
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
      slots_.binding.push_back(static_cast<Index>(at * kLanes + lane));
      users.emplace_back(binding.membrane - scene.membrane.first, slots_.binding.back());
      ++counts_.bindings;
    }
  });
  Compress(std::move(users), scene.membrane.node_count(), &node_bindings_.start, &node_bindings_.of);
}

}  // namespace fulcrum::physics
