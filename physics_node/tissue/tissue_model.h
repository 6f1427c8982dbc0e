// The constraints of a scene in the order and layout of the kernels, with the effects of cuts and shrinking.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "physics_node/tissue/batches.h"
#include "physics_node/tissue/particle_store.h"
#include "services/base/core/scene_view.h"

namespace fulcrum::physics {

/// A binding for code outside of the solvers.
struct BindingView {
  std::array<ParticleRef, 3> surface;
  std::array<float, 3> barycentric;
  float rest_length;  ///< [m]
};

struct ConstraintCounts {
  std::size_t vertices = 0, stretch = 0, volume = 0, bending = 0, bindings = 0;
};

class TissueModel {
 public:
  /// Throws InputError for a scene that violates the rules of the layout: membrane directly after the tube, no two
  /// constraints of a colour on one particle.
  TissueModel(const TissueScene& scene, ParticleStore* particles);

  /// Applies the difference between `topology` and the present state in place: O(edits) beyond one comparison of the
  /// bit fields. Returns the number of changed edges and nodes, or -1 if the sizes do not fit this scene.
  int Apply(const TopologyState& topology, ParticleStore* particles);

  /// Edges (3 * node + direction) that the last Apply has changed; an edge can occur more than once.
  [[nodiscard]] const std::vector<Index>& edited_edges() const { return edited_edges_; }

  [[nodiscard]] const std::vector<SpringBatch>& springs() const { return springs_; }
  [[nodiscard]] const std::vector<TetBatch>& tets() const { return tets_; }
  [[nodiscard]] const std::vector<BendingBatch>& bending() const { return bending_; }
  /// The particles that BendingBatch::v indexes; the last one pads.
  [[nodiscard]] const std::vector<ParticleRef>& hinge_particles() const { return hinge_particles_; }
  /// No edge or node of the patch of sheet under hinge `i` of the scene's bending is cut.
  [[nodiscard]] bool HingeWhole(Index i) const {
    return bending_[slots_.hinge[i] / kLanes].active[slots_.hinge[i] % kLanes] > 0.0f;
  }
  [[nodiscard]] const std::vector<BindingBatch>& bindings() const { return bindings_; }
  /// By constraint of the scene, its slot in the batches: batch * 8 + lane.
  [[nodiscard]] const std::vector<Index>& tet_slots() const { return slots_.tet; }
  [[nodiscard]] const std::vector<Index>& hinge_slots() const { return slots_.hinge; }
  [[nodiscard]] const std::vector<Index>& binding_slots() const { return slots_.binding; }
  /// Plane of rest lengths, laid out as the membrane is.
  [[nodiscard]] const float* rest(int direction) const { return rest_[direction].data(); }

  [[nodiscard]] std::uint64_t revision() const { return revision_; }
  [[nodiscard]] std::uint32_t rows() const { return scene_.membrane.rows; }
  [[nodiscard]] std::uint32_t cols() const { return scene_.membrane.cols; }
  [[nodiscard]] bool NodeAlive(Index node) const { return !TestBit(dead_nodes_, node); }
  /// Belongs to a small piece without an anchor, which is frozen in place and excluded from all computations, or to no
  /// sheet.
  [[nodiscard]] bool IsDebris(Index node) const { return debris_[node] != 0; }
  [[nodiscard]] bool IsAbsent(Index node) const { return debris_[node] == kAbsent; }
  /// The edge exists in the grid, and neither it nor one of its ends is cut.
  [[nodiscard]] bool EdgeAlive(Index node, int direction) const;
  /// Triangle 2 * cell + half: its nodes and edges are alive, and it is not debris.
  [[nodiscard]] bool TriangleAlive(Index triangle) const { return triangle_alive_[triangle] != 0; }
  /// Nodes of a membrane triangle (indices within the grid).
  [[nodiscard]] std::array<Index, 3> TriangleNodes(Index triangle) const;
  /// Inverse mass without grasps; 0 for a dead node and for debris.
  [[nodiscard]] float BaseInverseMass(Index particle) const;
  /// The first binding of a grid node; none for a dead node.
  [[nodiscard]] std::optional<BindingView> BindingOf(Index node) const;
  [[nodiscard]] ConstraintCounts counts() const { return counts_; }

 private:
  void PackTube(const TissueScene& scene, const ParticleStore& particles);
  void PackBending(const TissueScene& scene, const ParticleStore& particles);
  void PackBindings(const TissueScene& scene, const ParticleStore& particles);
  void RefreshEdge(Index node, int direction);
  void RefreshNode(Index node, ParticleStore* particles);
  void RefreshTriangles(Index node);
  void RefreshHinges(Index node, bool died);
  void RefreshTriangle(Index triangle);
  [[nodiscard]] bool HingeAlive(Index slot) const;
  [[nodiscard]] std::array<Index, 6> Neighbours(Index node) const;
  [[nodiscard]] bool IsAnchor(Index node) const;
  void FindDebris(const std::vector<Index>& changed, ParticleStore* particles);
  void ClearDebris(ParticleStore* particles);

  TissueScene scene_;
  GridLayout layout_;
  std::vector<SpringBatch> springs_;
  std::vector<TetBatch> tets_;
  std::vector<BendingBatch> bending_;
  std::vector<ParticleRef> hinge_particles_;
  /// By constraint of the scene: batch * 8 + lane.
  struct Slots {
    std::vector<Index> tet, hinge, binding;
  };
  Slots slots_;
  std::vector<BindingBatch> bindings_;
  std::array<FloatArray, 3> rest_;

  // Constraints of a node: compressed rows, entry = batch * 8 + lane. A hinge can span many cells; it belongs to all
  // nodes of the patch under it, so that a cut through the patch disables it.
  struct ConstraintsOfNodes {
    std::vector<Index> start, of;
  };
  ConstraintsOfNodes node_bending_, node_bindings_;
  struct Patch {
    Index row0 = 0, row1 = 0, col0 = 0, col1 = 0;  ///< Inclusive.
  };
  std::vector<Patch> bending_patch_;  ///< By batch * 8 + lane.

  std::vector<std::uint8_t> dead_nodes_, dead_edges_, shrink_, triangle_alive_;
  static constexpr std::uint8_t kDebris = 1, kAbsent = 2;
  std::vector<std::uint8_t> debris_;          ///< By node; 0: tissue.
  std::vector<Index> changed_nodes_, piece_;  ///< Scratch of Apply.
  std::vector<Index> edited_edges_;
  std::vector<std::uint32_t> visited_;  ///< Scratch: by node, the last search that reached it.
  std::uint32_t search_ = 0;
  std::uint64_t revision_ = 0;
  ConstraintCounts counts_;
};

/// Copies xyzw of the hinge particles from the pool into a compact array, and xyz back.
inline void CopyHingeParticles(const std::vector<ParticleRef>& refs, const float* pool, float* copy) {
  for (const ParticleRef at : refs) {
    for (std::size_t axis = 0; axis < 4; ++axis) {
      *copy++ = pool[at.base + axis * at.step];
    }
  }
}
inline void PutHingeParticles(const std::vector<ParticleRef>& refs, const float* copy, float* pool) {
  for (const ParticleRef at : refs) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      pool[at.base + axis * at.step] = copy[axis];
    }
    copy += 4;
  }
}

}  // namespace fulcrum::physics
