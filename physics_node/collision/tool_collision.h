// Tools against tissue. Tools are capsules moved from outside; the tissue gives way. Continuous in time, and every pair
// of capsule and triangle remembers on which side of the triangle the tool was, so that a fast or thin tool presses the
// membrane in front of itself instead of appearing behind it.
//
// Once a step FindPairs; then, by the kind of solver,
//   positions:  Sweep, Project after each iteration, Settle (tool_projection.cc)
//   implicit:   Rows for each substep, TakeForces after it (tool_rows.cc)
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "physics_node/collision/closest.h"
#include "physics_node/collision/contact_row.h"
#include "physics_node/collision/kernels.h"
#include "physics_node/collision/open_cells.h"
#include "physics_node/collision/surface_bounds.h"
#include "physics_node/collision/tool_shape.h"

namespace fulcrum::physics {

/// Squared distance of a pair that is not near enough to look at [m^2].
inline constexpr float kFarSq = 1.0f;

/// A capsule near a triangle in this step.
struct ContactPair {
  std::uint32_t capsule = 0;     ///< tool * kMaxCapsules + capsule of the tool.
  Index triangle = 0;            ///< Membrane triangle, or membrane triangle count + index in SceneView.tube_surface.
  Vec3f normal = Vec3f::Zero();  ///< Of the membrane around it, or of the organ's triangle.
  std::int8_t side = 0;          ///< Sign of the tool's height along the normal; 0 unknown.
  bool remembers = false;        ///< The side is that of the last step, in which they touched.
  bool touching = false;         ///< The last projection moved the triangle, or its row carried a force.
  std::array<ParticleRef, 3> at;
  std::array<Index, 3> particle{};
  ClosestPoints closest;       ///< At the last projection, before its correction, or when its row was made.
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
  /// Overlap is undone by at most this much in a projection or substep, not thrown out [m].
  static constexpr float kMaxPush = 0.001f;
  /// Most rows of one tool in a substep; the deepest are kept. A shaft in a tent of fine mesh makes 600: what is left
  /// out goes through the tool.
  static constexpr std::size_t kMaxRows = 1024;

  ToolCollision(const SceneView& scene, const TissueModel* model, ParticleStore* particles,
                const collision::Kernels& kernels = collision::KernelsFor());

  struct ToolMotion {
    ToolShape from, to;
    bool hold = false;     ///< The jaws hold tissue: they do not collide, nor after letting go until they are clear.
    bool closing = false;  ///< The jaws close: nor then, for two of them pressing from both sides have no answer.
  };

  /// Finds the pairs of this step; cheap when no tool is near. `tissue_moved` false: since the last call it has not, so
  /// its bounds still hold. `tissue_step`: about how far tissue will move in one substep (largest speed times its
  /// length; what is beyond kMaxReach is not looked for) [m].
  void FindPairs(const std::array<ToolMotion, kMaxTools>& tools, bool tissue_moved, float tissue_step = 0);
  /// The tissue has come to rest: until it moves, FindPairs finds what is near a tool wherever that goes. Its bounds
  /// are otherwise fitted only around the tools.
  void FitAtRest();
  /// Carries the tissue along with the tools from their last places to the present ones.
  void Sweep();
  /// Moves the tissue out of the tools in their places at the end of the step.
  void Project();
  /// After the step: tissue does not leave a tool faster than the tool pushed it. Overlaps that took more than that to
  /// undo would otherwise come back as speed.
  void Settle();

  /// Replaces `rows` by the contacts of the substep from part u0 to part u1 of the step, for tissue in its present
  /// places (those at the beginning of the substep). Each row keeps a point of a triangle clear of a capsule in its
  /// place at u1; it is made before they touch. Continuous: the direction is that of their first touch on the way. A
  /// row asks tissue to move at most kMaxPush more than the tool moves. Allocates nothing when `rows` has room for
  /// kMaxTools * kMaxRows.
  void Rows(float u0, float u1, std::vector<ContactRow>* rows);
  /// Forces of the last Rows as the solver has written them: those on the tools, and which pairs touch.
  void TakeForces(std::span<const ContactRow> rows);
  /// What is gone of triangles that still live, for the next Rows.
  void SetOpenCells(const OpenCells& cells) { open_ = cells; }
  /// Sum of normal and friction force of the tissue on a tool after TakeForces [N].
  [[nodiscard]] Vec3f force(std::uint32_t tool) const { return force_[tool]; }

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
    SegmentMotion segment{};  ///< Of its axis.
    [[nodiscard]] Capsule At(float u) const {
      return {from.a + u * (to.a - from.a), from.b + u * (to.b - from.b), to.radius, to.part};
    }
    /// Where the point at part t of the axis is at part u of the step.
    [[nodiscard]] Vec3f PointAt(float t, float u) const {
      const Vec3f p = from.a + t * (from.b - from.a);
      return p + u * (to.a + t * (to.b - to.a) - p);
    }
  };
  /// Jaws that do not collide for the time being.
  struct Yielding {
    int steps = 0;
    bool held = false;  ///< They held something: nothing at all must be near.
  };
  /// How the tool pushes a pair's tissue.
  struct Push {
    float depth =
        -3e38f;  ///< Tissue is to move at least so far along the direction; negative: that far from touch [m].
    Vec3f direction = Vec3f::Zero();
  };

  struct Patch {
    Index cell = kNoIndex;
    Vec3f normal = Vec3f::Zero();
  };
  /// A triangle that may become a pair.
  struct Candidate {
    Index triangle = 0;
    std::array<Index, 3> particle{};
    std::array<ParticleRef, 3> at;
  };

  void FindMembranePairs(std::uint32_t capsule, float range);
  void SettleSides(std::size_t first);
  void SortPairs();
  void FindTubePairs(std::uint32_t capsule, float range);
  /// Candidates are looked at eight at a time: Flush looks at those that are left.
  void AddCandidate(const Candidate& candidate, std::uint32_t capsule, float range);
  void Flush(std::uint32_t capsule, float range);
  void FindSide(ContactPair* pair);
  void FollowYielding(std::uint32_t tool, const ToolMotion& moved, bool clear);
  /// Unit normal of the membrane around a cell, now or before this step; zero beside a cut or where it has none.
  [[nodiscard]] Vec3f PatchNormal(Index cell, bool previous) const;
  /// Of the membrane around it, or of the organ's triangle.
  [[nodiscard]] Vec3f NormalOf(const ContactPair& pair, bool previous);
  /// Closest points are told for tissue up to this far from touch: the arc of an electrode reaches so far [m].
  [[nodiscard]] static float Probed(const Capsule& capsule) { return capsule.part == ToolPart::kTip ? 0.0015f : 0.0f; }
  /// How far apart a pair is at least: bounding sphere against capsule axis.
  [[nodiscard]] static bool IsFar(const std::array<Vec3f, 3>& x, const Capsule& capsule, float range);
  /// The closest point is on the membrane's rim, at a hole or a slit: past it a tool gets to the other side.
  [[nodiscard]] bool OnRim(const ContactPair& pair) const;
  /// From pair->closest; `capsule` is where that was taken.
  [[nodiscard]] Push PushOf(const ContactPair& pair, const Capsule& capsule) const;
  void ProjectPair(ContactPair* pair, const Capsule& capsule);
  /// Fills lane `lane` with a triangle's corners.
  void LoadTriangle(const std::array<ParticleRef, 3>& at, std::size_t lane);
  /// What the last look has found in a lane; `now` is the capsule where that was.
  void TakeTouch(const Capsule& now, std::size_t lane, ClosestPoints* closest) const;
  /// Moves a pair's closest point off cells that are gone. False: within `range` nothing of the triangle is left.
  [[nodiscard]] bool KeepOffOpenCells(const Capsule& capsule, float range, ContactPair* pair) const;
  /// How much nearer than along the sheet's normal a tool comes to it along `direction` [m].
  [[nodiscard]] float RimGives(const ContactPair& pair, ToolPart part, const Vec3f& direction) const;
  /// Rows of at most eight pairs of one capsule.
  void AddRows(Index first, Index last, float u0, float u1, std::vector<ContactRow>* rows);
  void AddRow(Index index, const Push& push, const Vec3f& tool_step, std::vector<ContactRow>* rows) const;
  void DropRepeated(std::size_t first, std::vector<ContactRow>* rows);
  void DropShallow(std::size_t first, std::vector<ContactRow>* rows);
  void DropMarked(std::size_t first, std::vector<ContactRow>* rows);

  SceneView scene_;
  const TissueModel* model_;
  ParticleStore* particles_;
  const collision::Kernels& kernels_;
  Index membrane_triangles_;
  SurfaceBounds bounds_;
  std::vector<ParticleRef> column_;  ///< Of the first row.
  std::array<Motion, kMaxTools * kMaxCapsules> motion_;
  std::array<Yielding, kMaxTools> yielding_;
  std::vector<ContactPair> pairs_, last_pairs_;
  std::array<Candidate, kLanes> waiting_;
  std::size_t waiting_count_ = 0;
  TriangleBatch triangles_{};
  TouchBatch touch_{};
  OpenCells open_;              ///< What is gone around the hook.
  std::array<Patch, 2> patch_;  ///< The last one asked for, now and before this step.
  float band_ = 0;              ///< Rows are made for what is so near to touch [m].
  std::array<Vec3f, kMaxTools> force_{Vec3f::Zero(), Vec3f::Zero()};
  std::vector<std::pair<std::uint64_t, Index>> row_order_;  ///< Scratch, of pairs too.
};

}  // namespace fulcrum::physics
