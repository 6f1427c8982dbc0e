// The constraints of a scene in the order and layout of the kernels, and what cutting and shrinking have done to them.
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

/// A binding as others than the solver see it.
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
  /// Throws InputError when the scene breaks the rules that the layout rests on (membrane directly after the tube,
  /// no two constraints of a colour on one particle).
  TissueModel(const SceneView& scene, ParticleStore* particles);

  /// Applies the difference between `topology` and what is in force, in place: O(edits) beyond one comparison of the
  /// bit fields. Returns the number of edges and nodes changed, or -1 when the sizes do not fit this scene.
  int Apply(const TopologyState& topology, ParticleStore* particles);

  /// Edges (3 * node + direction) that the last Apply has changed, some more than once.
  [[nodiscard]] const std::vector<Index>& edited_edges() const { return edited_edges_; }

  [[nodiscard]] const std::vector<SpringBatch>& springs() const { return springs_; }
  [[nodiscard]] const std::vector<TetBatch>& tets() const { return tets_; }
  [[nodiscard]] const std::vector<BendingBatch>& bending() const { return bending_; }
  /// The particles that BendingBatch::v indexes; the last one pads.
  [[nodiscard]] const std::vector<ParticleRef>& hinge_particles() const { return hinge_particles_; }
  /// Of constraint `i` of the scene's bending: the sheet it spans is whole.
  [[nodiscard]] bool HingeWhole(Index i) const {
    return bending_[hinge_slot_[i] / kLanes].active[hinge_slot_[i] % kLanes] > 0.0f;
  }
  [[nodiscard]] const std::vector<BindingBatch>& bindings() const { return bindings_; }
  /// Where a constraint of the scene stands in its batches: batch * 8 + lane.
  [[nodiscard]] const std::vector<Index>& tet_slots() const { return tet_slot_; }
  [[nodiscard]] const std::vector<Index>& hinge_slots() const { return hinge_slot_; }
  [[nodiscard]] const std::vector<Index>& binding_slots() const { return binding_slot_; }
  /// Plane of rest lengths, laid out as the membrane is.
  [[nodiscard]] const float* rest(int direction) const { return rest_[direction].data(); }

  [[nodiscard]] std::uint64_t revision() const { return revision_; }
  [[nodiscard]] std::uint32_t rows() const { return scene_.membrane.rows; }
  [[nodiscard]] std::uint32_t cols() const { return scene_.membrane.cols; }
  [[nodiscard]] bool NodeAlive(Index node) const { return !TestBit(dead_nodes_, node); }
  /// Belongs to a small piece that hangs on nothing any more: it stays where it is and takes part in nothing.
  [[nodiscard]] bool IsDebris(Index node) const { return debris_[node] != 0; }
  /// Exists in the grid, is not cut, and neither is an end of it.
  [[nodiscard]] bool EdgeAlive(Index node, int direction) const;
  /// Triangle 2 * cell + half: all its nodes and edges are alive, and it is not debris.
  [[nodiscard]] bool TriangleAlive(Index triangle) const { return triangle_alive_[triangle] != 0; }
  /// Nodes of a membrane triangle (indices within the grid).
  [[nodiscard]] std::array<Index, 3> TriangleNodes(Index triangle) const;
  /// Inverse mass without grasps; 0 for a dead node and for debris.
  [[nodiscard]] float BaseInverseMass(Index particle) const;
  /// The first binding of a grid node, if it has one and is alive.
  [[nodiscard]] std::optional<BindingView> BindingOf(Index node) const;
  [[nodiscard]] ConstraintCounts counts() const { return counts_; }

 private:
  void PackTube(const SceneView& scene, const ParticleStore& particles);
  void PackBending(const SceneView& scene, const ParticleStore& particles);
  void PackBindings(const SceneView& scene, const ParticleStore& particles);
  void RefreshEdge(Index node, int direction);
  void RefreshNode(Index node, ParticleStore* particles);
  void RefreshTriangles(Index node);
  void RefreshHinges(Index node, bool died);
  void RefreshTriangle(Index triangle);
  [[nodiscard]] bool HingeAlive(Index slot) const;
  [[nodiscard]] std::array<Index, 6> Neighbours(Index node) const;
  [[nodiscard]] bool IsAnchor(Index node) const;
  void FindDebris(const std::vector<Index>& changed, ParticleStore* particles);
  void ForgetDebris(ParticleStore* particles);

  SceneView scene_;
  GridLayout layout_;
  std::vector<SpringBatch> springs_;
  std::vector<TetBatch> tets_;
  std::vector<BendingBatch> bending_;
  std::vector<ParticleRef> hinge_particles_;
  std::vector<Index> tet_slot_, hinge_slot_, binding_slot_;  ///< By constraint of the scene: batch * 8 + lane.
  std::vector<BindingBatch> bindings_;
  std::array<FloatArray, 3> rest_;

  // Who uses a node: compressed rows, entry = batch * 8 + lane. A hinge may span many
  // cells; it uses all nodes of the patch it spans, so that a cut through the patch switches it off.
  std::vector<Index> bending_start_, bending_of_;
  std::vector<Index> binding_start_, binding_of_;
  struct Patch {
    Index row0 = 0, row1 = 0, col0 = 0, col1 = 0;  ///< Inclusive.
  };
  std::vector<Patch> bending_patch_;  ///< By batch * 8 + lane.

  std::vector<std::uint8_t> dead_nodes_, dead_edges_, shrink_, triangle_alive_, debris_;
  std::vector<Index> changed_nodes_, piece_;  ///< Scratch of Apply.
  std::vector<Index> edited_edges_;
  std::vector<std::uint32_t> visited_;  ///< Scratch: by node, the search that saw it last.
  std::uint32_t search_ = 0;
  std::uint64_t revision_ = 0;
  ConstraintCounts counts_;
};

/// The hinge particles' xyzw from the pool into a compact copy, and their xyz back.
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
