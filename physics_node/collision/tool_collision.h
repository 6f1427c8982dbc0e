// Contact of tools with tissue. Tools are capsules with prescribed motion; only the tissue is moved. Detection is
// continuous in time, and each pair of capsule and triangle stores the side of the triangle on which the tool was, so
// that a fast or thin tool presses the membrane in front of itself instead of appearing behind it.
//
// Use: FindPairs once a step; then, by the kind of solver,
//   positions:  Sweep, Project after each iteration, Settle (tool_projection.cc)
//   rows:       Rows for each substep, TakeForces after it (tool_rows.cc)
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
#include "physics_node/simd/limits.h"

namespace fulcrum::physics {

/// Squared distance of a pair that is too far apart to be evaluated [m^2]: 1 m, beyond every contact.
inline constexpr float kFarSq = 1.0f;

/// A capsule near a triangle in this step.
struct ContactPair {
  std::uint32_t capsule = 0;     ///< tool * kMaxCapsules + capsule of the tool.
  Index triangle = 0;            ///< Membrane triangle, or membrane triangle count + index in TissueScene.tube_surface.
  Vec3f normal = Vec3f::Zero();  ///< Of the membrane around the triangle, or of the organ's triangle.
  std::int8_t side = 0;          ///< Sign of the tool's height along the normal; 0 unknown.
  bool side_kept = false;        ///< The side is that of the last step, in which the pair touched.
  bool touching = false;         ///< The last projection moved the triangle, or its row carried a force.
  std::array<ParticleRef, 3> at;
  std::array<Index, 3> particle{};
  ClosestPoints closest;       ///< Before the correction of the last projection, or when the row was made.
  Vec3f push = Vec3f::Zero();  ///< Unit direction in which the tool pushes the tissue.
};

/// The nearest point of the tissue's surface.
struct SurfacePoint {
  bool found = false;
  bool on_membrane = true;
  Index triangle = 0;  ///< As in ContactPair.
  ClosestPoints closest;
  float gap = 0;  ///< From surface to surface; negative: overlap [m].
};

class ToolCollision {
 public:
  /// Largest reduction of an overlap in a projection or substep [m]: a larger one would be an impulse.
  static constexpr float kMaxPush = 0.001f;
  /// Most rows of one tool in a substep; the deepest are kept. A shaft under a tent of fine mesh makes 600; tissue
  /// whose row is dropped passes through the tool.
  static constexpr std::size_t kMaxRows = 1024;

  ToolCollision(const TissueScene& scene, const TissueModel* model, ParticleStore* particles,
                const collision::Kernels& kernels = collision::KernelsFor());

  struct ToolMotion {
    ToolShape from, to;
    bool hold = false;     ///< The jaws hold tissue: they do not collide until they have released it and are clear.
    bool closing = false;  ///< The jaws close: they do not collide, since tissue pressed from both sides cannot yield.
  };

  /// Finds the pairs of this step; cheap without a tool near tissue. `tissue_moved` false: the tissue has not moved
  /// since the last call, and its bounds are still valid. `tissue_step`: estimated movement of tissue in a substep,
  /// largest speed times its length; at most kMaxReach of it is used [m].
  void FindPairs(const std::array<ToolMotion, kMaxTools>& tools, bool tissue_moved, float tissue_step = 0);
  /// When the tissue comes to rest: fits the bounds of all tissue, not only of that near the tools, so that they stay
  /// valid for any tool position until the tissue moves.
  void FitAtRest();
  /// After positions have been restored: the next FindPairs looks for tissue everywhere.
  void Restart() { bounds_.Invalidate(); }
  /// Projects the tissue along the motion of the tools in this step.
  void Sweep();
  /// Projects the tissue out of the tools at their positions at the end of the step.
  void Project();
  /// After the step: limits the velocity of touched tissue along the push to that of the tool. Otherwise the correction
  /// of an overlap would become velocity.
  void Settle();

  /// Replaces `rows` by the contacts of the substep from part u0 to part u1 of the step, for the present positions of
  /// the tissue, those at the beginning of the substep. Each row keeps a point of a triangle clear of a capsule at its
  /// position at u1 and exists before they touch. Its direction is that of their first touch in the substep. A row
  /// moves tissue by at most kMaxPush more than the tool. No allocation if `rows` has room for kMaxTools * kMaxRows.
  void Rows(float u0, float u1, std::vector<ContactRow>* rows);
  /// Reads the forces that the solver has written to the last Rows: forces on the tools, and which pairs touch.
  void TakeForces(std::span<const ContactRow> rows);
  /// Removed cells of living triangles, for the next Rows.
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
  /// ContactMargin at a triangle, of a sheet by its own thickness [m]; kNoIndex: by that of `thermal`.
  [[nodiscard]] float MarginAt(Index triangle, ToolPart part) const;

 private:
  struct Motion {
    Capsule from, to;
    float travel = 0;  ///< Path of the faster end [m].
    bool enabled = false;
    SegmentMotion segment{};  ///< Of the axis.
    [[nodiscard]] Capsule At(float u) const {
      return {from.a + u * (to.a - from.a), from.b + u * (to.b - from.b), to.radius, to.part};
    }
    /// Position at part u of the step of the point at part t of the axis.
    [[nodiscard]] Vec3f PointAt(float t, float u) const {
      const Vec3f p = from.a + t * (from.b - from.a);
      return p + u * (to.a + t * (to.b - to.a) - p);
    }
  };
  /// Jaws that are excluded from collision until they are clear of tissue.
  struct Exclusion {
    int steps = 0;      ///< Steps without tissue in the way until they collide again.
    bool held = false;  ///< They held tissue: clear only without any tissue near.
  };
  /// Correction of a pair's tissue.
  struct Push {
    float depth = -kLargestFinite;  ///< Required movement along the direction; negative: distance from touch [m].
    Vec3f direction = Vec3f::Zero();
  };

  /// Cached PatchNormal.
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
  void UnifySides(std::size_t first);
  static void UnifySidesOfSheet(std::span<ContactPair> pairs);
  void SortPairs();
  void FindTubePairs(std::uint32_t capsule, float range);
  /// Collects candidates in batches of eight for the kernel; Flush processes an incomplete batch.
  void AddCandidate(const Candidate& candidate, std::uint32_t capsule, float range);
  void Flush(std::uint32_t capsule, float range);
  void FindSide(ContactPair* pair);
  void UpdateExclusion(std::uint32_t tool, const ToolMotion& moved, bool clear);
  /// Unit normal of the membrane around a cell, now or before this step; zero beside a cut or without area.
  [[nodiscard]] Vec3f PatchNormal(Index cell, bool previous) const;
  /// Normal of the membrane around the pair's triangle, or of the organ's triangle.
  [[nodiscard]] Vec3f NormalOf(const ContactPair& pair, bool previous);
  /// Distance from touch up to which closest points are computed [m]. For an electrode beyond the reach of its arc; the
  /// cautery probe reads them.
  static constexpr float kElectrodeRange = 0.0015f;
  [[nodiscard]] static float ProbeRange(const Capsule& capsule) {
    return capsule.part == ToolPart::kTip ? kElectrodeRange : 0.0f;
  }
  /// The bounding sphere of the triangle is further than `range` from the axis of the capsule.
  [[nodiscard]] static bool IsFar(const std::array<Vec3f, 3>& x, const Capsule& capsule, float range);
  /// The closest point is on a rim of the membrane, at a hole or a slit, around which a tool can reach the other side.
  [[nodiscard]] bool OnRim(const ContactPair& pair) const;
  /// Correction from pair.closest, which was evaluated at `capsule`.
  [[nodiscard]] Push PushOf(const ContactPair& pair, const Capsule& capsule) const;
  void ProjectPair(ContactPair* pair, const Capsule& capsule);
  /// Loads the corners of a triangle into lane `lane`.
  void LoadTriangle(const std::array<ParticleRef, 3>& at, std::size_t lane);
  /// Reads the closest points of a lane from touch_; `now`: the capsule at which they were evaluated.
  void TakeTouch(const Capsule& now, std::size_t lane, ClosestPoints* closest) const;
  /// Moves the closest point of a pair off removed cells. False: no cell of the triangle remains within `range`.
  [[nodiscard]] bool MoveOffOpenCells(const Capsule& capsule, float range, ContactPair* pair) const;
  /// Reduction of the contact margin for a push along `direction` instead of the sheet's normal [m].
  [[nodiscard]] float MarginReduction(const ContactPair& pair, ToolPart part, const Vec3f& direction) const;
  /// Rows of at most eight pairs of one capsule.
  void AddRows(Index first, Index last, float u0, float u1, std::vector<ContactRow>* rows);
  void AddRow(Index index, const Push& push, const Vec3f& tool_step, std::vector<ContactRow>* rows) const;
  void DropRepeated(std::size_t first, std::vector<ContactRow>* rows);
  void DropShallow(std::size_t first, std::vector<ContactRow>* rows);
  void DropMarked(std::size_t first, std::vector<ContactRow>* rows);

  TissueScene scene_;
  const TissueModel* model_;
  ParticleStore* particles_;
  const collision::Kernels& kernels_;
  Index membrane_triangles_;
  std::vector<std::size_t> sheet_of_;  ///< By row of the grid.
  std::vector<float> thickness_;       ///< Of the sheet, by row of the grid [m]; empty: everywhere that of `thermal`.
  float thickest_m_;                   ///< Of all sheets and `thermal`.
  SurfaceBounds bounds_;
  std::vector<ParticleRef> column_;  ///< Nodes of the first row.
  std::array<Motion, kMaxTools * kMaxCapsules> motion_;
  std::array<Exclusion, kMaxTools> excluded_;
  std::vector<ContactPair> pairs_, last_pairs_;
  std::array<Candidate, kLanes> batch_;
  std::size_t batch_count_ = 0;
  TriangleBatch triangles_{};
  TouchBatch touch_{};
  OpenCells open_;              ///< Removed cells around the hook.
  std::array<Patch, 2> patch_;  ///< Cache: the last normal now, and before this step.
  float band_ = 0;              ///< Rows are made for tissue this near to touch [m].
  std::array<Vec3f, kMaxTools> force_ = AtOrigin();
  std::vector<std::pair<std::uint64_t, Index>> row_order_;  ///< Scratch for rows and pairs.
};

}  // namespace fulcrum::physics
