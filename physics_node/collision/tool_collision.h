// Tools against tissue. Tools are capsules moved from outside; the tissue gives way. Continuous in time: before the
// iterations each capsule is swept along its path of the step in pieces shorter than its radius, and every pair of
// capsule and triangle remembers on which side of the triangle the tool was, so that a fast or thin tool presses the
// membrane in front of itself instead of appearing behind it.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "physics_node/collision/closest.h"
#include "physics_node/collision/tool_shape.h"
#include "physics_node/pbd/pbd_solver.h"

namespace fulcrum::physics {

/// A capsule near a triangle in this step.
struct ContactPair {
  std::uint32_t capsule = 0;     ///< tool * kMaxCapsules + capsule of the tool.
  Index triangle = 0;            ///< Membrane triangle, or membrane triangle count + index in SceneView.tube_surface.
  Vec3f normal = Vec3f::Zero();  ///< Of the membrane around it, or of the organ's triangle.
  std::int8_t side = 0;          ///< Sign of the tool's height along the normal; 0 unknown.
  bool touching = false;         ///< The last projection moved the triangle.
  std::array<ParticleRef, 3> at;
  std::array<Index, 3> particle{};
  ClosestPoints closest;       ///< At the last projection, before its correction.
  Vec3f push = Vec3f::Zero();  ///< Unit direction in which the tool pushes the tissue.
};

/// The nearest piece of tissue surface.
struct SurfacePoint {
  bool found = false;
  bool on_membrane = true;
  Index triangle = 0;  ///< As in ContactPair.
  ClosestPoints closest;
  float gap = 0;  ///< Surface to surface; negative: overlapping [m].
};

class ToolCollision {
 public:
  ToolCollision(const SceneView& scene, const TissueModel* model, ParticleStore* particles, const PbdSolver* solver);

  struct ToolMotion {
    ToolShape from, to;
    bool hold = false;     ///< The jaws hold tissue: they do not collide, nor after letting go until they are clear.
    bool closing = false;  ///< The jaws close: nor then, for two of them pressing from both sides have no answer.
  };

  /// Finds the pairs of this step; cheap when no tool is near. `tissue_moved` false: since the last call it has not, so
  /// its bounds still hold.
  void FindPairs(const std::array<ToolMotion, kMaxTools>& tools, bool tissue_moved);
  /// Carries the tissue along with the tools from their last places to the present ones.
  void Sweep();
  /// Moves the tissue out of the tools in their places at the end of the step.
  void Project();
  /// After the step: tissue does not leave a tool faster than the tool pushed it. Overlaps that took more than that to
  /// undo would otherwise come back as speed.
  void Settle();

  [[nodiscard]] std::span<const ContactPair> pairs() const { return pairs_; }
  [[nodiscard]] bool any_touching() const;
  /// Particles that the tool touched in the last projection, each once, ascending.
  void TouchedParticles(std::uint32_t tool, std::vector<Index>* particles) const;
  /// Nearest live surface to a capsule's surface, at most `range` away.
  [[nodiscard]] SurfacePoint Nearest(const Capsule& capsule, float range) const;
  [[nodiscard]] Index membrane_triangle_count() const { return membrane_triangles_; }

 private:
  struct Motion {
    Capsule from, to;
    float travel = 0;  ///< Of its faster end [m].
    bool enabled = false;
  };
  struct Chunk {
    Index first = 0, last = 0;  ///< Of tube_order_.
    Vec3f centre = Vec3f::Zero();
    float radius = 0;
  };

  /// Jaws that do not collide for the time being.
  struct Yielding {
    int steps = 0;
    bool held = false;  ///< They held something: nothing at all must be near.
  };

  void UpdateBounds();
  void FindMembranePairs(std::uint32_t capsule, float range);
  void SettleSides(std::size_t first);
  void FindTubePairs(std::uint32_t capsule, float range);
  void AddPair(std::uint32_t capsule, Index triangle, const std::array<Index, 3>& particle,
               const std::array<ParticleRef, 3>& at, float range);
  /// Unit normal of the membrane around a triangle, now or before this step; zero where it has none.
  [[nodiscard]] Vec3f PatchNormal(Index triangle, bool previous) const;
  void ProjectPair(ContactPair* pair, const Capsule& capsule);
  /// visit(row, column, distance of the centre); may lower `range` as it goes.
  template <class Visit>
  void ForEachCellNear(const Vec3f& a, const Vec3f& b, const float& range, const Visit& visit) const;
  template <class Visit>
  void ForEachTubeTriangleNear(const Vec3f& a, const Vec3f& b, float range, const Visit& visit) const;

  SceneView scene_;
  const TissueModel* model_;
  ParticleStore* particles_;
  const PbdSolver* solver_;
  Index membrane_triangles_;
  std::uint32_t slot_blocks_, row_blocks_;
  std::array<std::vector<float>, 6> bound_storage_;
  BlockBounds bounds_{};
  Vec3f low_ = Vec3f::Zero(), high_ = Vec3f::Zero();  ///< Of everything.
  std::vector<Index> tube_order_;
  std::vector<Chunk> chunks_;
  std::array<Motion, kMaxTools * kMaxCapsules> motion_;
  std::array<Yielding, kMaxTools> yielding_;
  std::vector<ContactPair> pairs_, last_pairs_;
};

}  // namespace fulcrum::physics
