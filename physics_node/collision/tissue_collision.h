// Contact of tissue with tissue and with its surroundings: membrane nodes stay outside every solid, the surface of a
// solid outside the others, and all stay in front of the fixed surfaces of the scene that collide.
//
// Distances are amortised: a particle at distance d from contact is evaluated again only when it and the surface may
// together have moved by d. The solver reports movements by blocks of particles, so tissue at rest costs one comparison
// per block. Where a block may have moved far enough, the displacement of each of its particles is computed first; it
// is smaller than the movement of the fastest particle summed over the steps. Equations: tissue_gaps.cc.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "physics_node/collision/contact_row.h"
#include "physics_node/collision/kernels.h"
#include "physics_node/collision/triangle_tree.h"
#include "physics_node/simd/limits.h"
#include "physics_node/tissue/particle_store.h"
#include "physics_node/tissue/tissue_model.h"
#include "services/base/core/scene_view.h"

namespace fulcrum::physics {

class TissueCollision {
 public:
  /// Bit in ContactRow.source that marks the rows of this class.
  static constexpr std::uint32_t kSource = 0x80000000u;
  /// Bit in ContactRow.source that marks those of a solid's vertex, not of the membrane.
  static constexpr std::uint32_t kSolidSource = 0x40000000u;
  /// Most rows in a substep; memory for them is reserved at the start. Assumed.
  static constexpr std::size_t kMaxRows = 4096;

  TissueCollision(const TissueScene& scene, const TissueModel* model, const ParticleStore* particles,
                  const collision::Kernels& kernels = collision::KernelsFor());

  /// Once a step, before the solve. `moved`: upper bound of the movement of the particles of each block of the
  /// ParticleStore since the last call [m], [block_count()]; 0 for blocks at rest. Simulated time at begin and end of
  /// the step [s]: breathing surfaces move from one to the other.
  void FindPairs(std::span<const float> moved, double time0_s, double time1_s) {
    BeginPairs(moved, time0_s, time1_s);
    for (int task = 0; task < tasks(); ++task) FindPairsOf(task, moved);
  }
  // The same as tasks for any thread. Tasks of neighbouring blocks have neighbouring numbers.
  void BeginPairs(std::span<const float> moved, double time0_s, double time1_s);
  [[nodiscard]] int tasks() const { return kParts * (1 + static_cast<int>(fixed_.size())); }
  void FindPairsOf(int task, std::span<const float> moved);
  /// Appends the contacts of the substep from part u0 to u1 of the step; at most kMaxRows.
  void Rows(float u0, float u1, std::vector<ContactRow>* rows) {
    for (int part = 0; part < kParts; ++part) FindRows(part, u0, u1);
    JoinRows(rows);
  }
  // The same as parts [0, kParts) for any thread.
  static constexpr int kParts = 8;
  void FindRows(int part, float u0, float u1);
  void JoinRows(std::vector<ContactRow>* rows) const;

  /// A breathing surface is near live tissue in this step and will push it.
  [[nodiscard]] bool breath_near() const;
  /// Particles that can produce rows in this step.
  [[nodiscard]] std::size_t near_count() const;
  /// Gaps that the last FindPairs evaluated.
  [[nodiscard]] std::size_t evaluated_count() const;

 private:
  /// A particle and the surface in front of which it must stay. The members that most steps read fill the first cache
  /// line.
  struct alignas(kCacheLine) Watch {
    ParticleRef at;
    Index triangle = kNoIndex;         ///< The nearest one: of tube_surface, or of the tree.
    std::uint32_t updated_step = 0;    ///< Step in which path and displacement were last updated.
    Vec3f gap_place = Vec3f::Zero();   ///< Position at the last evaluation of the gap, see RelativePlace.
    Vec3f last_place = Vec3f::Zero();  ///< Position in step `updated_step`.
    float displacement = 0;            ///< |last_place - gap_place| [m].
    /// Path length in the step before `updated_step`, relative to the surface [m]; prediction for the next step.
    float step_path = 0;
    float gap = 0;             ///< Distance from contact at the last evaluation [m].
    float surface_travel = 0;  ///< Travel of the surface at that time [m].
    bool front = false;        ///< Has been in front of the surface and within kSearchRange of it since.
    bool blocks = true;        ///< The nearest triangle can stop the particle: it is in range and not past a rim.
    bool near = false;         ///< Can produce rows before the next evaluation.
    bool side_known = false;   ///< Fixed surfaces: `behind` and `clearance` are set.
    bool behind = false;       ///< Lies behind a fixed surface at rest: no contact with it.
    float clearance = 0;       ///< Distance to keep from the surface: less where the particle rests nearer [m].
    Index particle = 0;
    Vec3f point = Vec3f::Zero();   ///< Fixed surfaces: nearest point.
    Vec3f normal = Vec3f::Zero();  ///< Fixed surfaces: normal at it.
    /// Stores the result of an evaluation.
    void SetGap(float distance, const Vec3f& place, float travel_of_surface);
  };
  /// Next events of a watch, or the earliest ones of a group, as values of the group's travel [m].
  struct Times {
    float due = 0;         ///< The gap is evaluated again.
    float start = kNever;  ///< Contact is possible from here on, until the next evaluation; without the band.
  };
  static constexpr float kNever = kLargestFinite;
  /// Watches of one block. Most steps read only this.
  struct Group {
    float travel = 0;  ///< Of the block and the surface near it, summed since the start [m].
    Times times;
    Index block = 0;
  };
  /// Blocks of the organ that contain the triangles of a group, the last one repeated.
  static constexpr std::size_t kMaxOrganBlocks = 8;
  using OrganBlocks = std::array<Index, kMaxOrganBlocks>;
  /// A group with watches that may have to be evaluated in this step.
  struct Due {
    Index group = 0;
    float step = 0;                 ///< Movement of the block and the surface near it in this step [m].
    float travel = 0;               ///< Of the group, this step included [m].
    float start_limit = 0;          ///< Watches that start before this travel can produce rows [m].
    bool is_due = false;            ///< A watch is due by the group's travel; its own displacement can be smaller.
    bool changed_triangle = false;  ///< A watch is now nearest to another triangle.
  };
  struct Selected {
    Index watch = 0;
    Index due = 0;  ///< Index of its group in the list of due groups.
  };
  /// A watch that can produce rows in this step.
  struct Near {
    Index watch = 0;
    float band = 0;  ///< Rows are made within this distance of contact; in a substep within its share of it [m].
  };
  struct Signed {
    std::array<float, 3> barycentric{};
    Vec3f normal = Vec3f::Zero();  ///< Unit, from the surface to the side on which the particle belongs.
    float distance = 0;            ///< Negative: behind [m].
  };

  /// Results of a part of a surface's groups.
  struct Found {
    std::vector<Due> due;  ///< Memory for those of a step.
    std::vector<Selected> selected;
    std::vector<Near> near;        ///< In this step.
    std::size_t evaluated = 0;     ///< Gaps, in this step.
    std::vector<ContactRow> rows;  ///< In this substep.
  };
  /// All watches of one surface.
  struct Watches {
    std::vector<Watch> all;
    std::vector<Times> times;  ///< By watch, apart from the rest: most steps read nothing else.
    std::vector<Group> groups;
    std::vector<Index> first;               ///< First watch of each group, then the number of watches.
    std::vector<OrganBlocks> organ_blocks;  ///< By group; watches of the organ only.
    std::array<Found, kParts> found;
    void MakeGroups(const ParticleStore& particles);
  };

  /// Deeper behind a surface than this a particle has passed through it: a row would pull it back across the tissue
  /// that it has left, so there is none [m].
  static constexpr float kMaxBehind = 0.005f;
  /// Largest clearance as a share of the distance at rest: a particle that rests nearer to the surface than twice the
  /// margin must not be pushed at rest.
  static constexpr float kRestShare = 0.5f;
  /// Nearer than this to the surface a row acts along the triangle's normal: the direction to the nearest point is
  /// dominated by rounding [m].
  static constexpr float kTouching = 0.0003f;

  /// A fixed surface of the scene that collides. Particles that lie behind it at rest, such as the organ under the
  /// peritoneum, do not collide with it.
  struct Fixed {
    TriangleTree tree;
    bool breathes = false;
    Watches watches;
  };

  void WatchOrgan();
  void WatchFixed(const StaticSurface& surface);
  /// Distance from contact with a fixed surface of a particle at p; updates the watch.
  float EvaluateFixedGap(const TriangleTree& tree, const Vec3f& p, Watch* watch) const;
  [[nodiscard]] std::array<Vec3f, 3> OrganCorners(Index triangle) const;
  /// Walks over the organ's surface from the last nearest triangle to the present one.
  void Walk(Watch* watch, const Vec3f& p) const;
  [[nodiscard]] static Signed SignedDistance(const Vec3f& p, const std::array<Vec3f, 3>& corners);
  /// With the barycentric coordinates of the closest point.
  [[nodiscard]] static Signed SignedDistance(const Vec3f& p, const std::array<Vec3f, 3>& corners,
                                             const std::array<float, 3>& barycentric);
  /// Position of a particle relative to the centroid of its organ triangle: only relative movement changes the gap.
  [[nodiscard]] Vec3f RelativePlace(const Watch& watch) const {
    const auto x = OrganCorners(watch.triangle);
    return particles_->At(watch.at) - (x[0] + x[1] + x[2]) / 3.0f;
  }
  /// Updates displacement and step_path once a step; `fallback` is the path of a watch that was not updated in the last
  /// step.
  template <class Place>
  void UpdatePath(Watch* watch, float surface_moved, float fallback, const Place& place) const;
  /// Upper bounds over the whole surface: its travel and its movement in this step. surface_step(group): bound of the
  /// movement in this step of the part of the surface near a group. place(watch): position as in Watch::gap_place.
  /// evaluate(watch): distance from contact.
  template <class SurfaceStep, class Place, class Evaluate>
  void EvaluateDue(Watches* watches, int part, std::span<const float> moved, float surface_travel, float surface_moved,
                   const SurfaceStep& surface_step, const Place& place, const Evaluate& evaluate);
  template <class SurfaceStep>
  static std::span<Due> FindDue(Watches* watches, int part, std::span<const float> moved,
                                const SurfaceStep& surface_step, std::vector<Due>* found);
  template <class Condition>
  static void Select(const Watches& watches, std::span<const Due> due, const Condition& condition,
                     std::vector<Selected>* selected);
  template <class Body>
  void ForSelected(Watches* watches, std::span<const Selected> selected, const Body& body) const;
  void FindOrganBlocks(Index group);
  void AddOrganRow(const Near& near, const Signed& now, std::vector<ContactRow>* rows) const;
  void EvaluateOrgan(int part, std::span<const float> moved);
  void EvaluateFixed(Fixed* fixed, int part, std::span<const float> moved);
  [[nodiscard]] bool Collides(Index particle) const;
  void FindOrganRows(Found* found, float u0, float u1) const;
  void FindFixedRows(const Fixed& fixed, Found* found, float u0, float u1) const;
  /// body(found) for each part: those of the organ, then those of each fixed surface.
  template <class Body>
  void ForFound(const Body& body) const;

  TissueScene scene_;
  const TissueModel* model_;
  const ParticleStore* particles_;
  const collision::Kernels& kernels_;

  /// By organ triangle: itself, then the triangles that share a corner with it; compressed rows.
  std::vector<Index> ring_start_, ring_;
  Watches organ_;
  std::vector<Fixed> fixed_;

  /// Bounds of the movement of the organ, summed and in this step, and of the breathing surfaces, summed [m].
  float organ_travel_ = 0, organ_moved_ = 0, breath_travel_ = 0;
  std::vector<float> organ_moved_of_;  ///< In this step, by block of the organ; then the largest [m].
  Vec3f breath0_ = Vec3f::Zero(), breath1_ = Vec3f::Zero();  ///< Breathing offset at begin and end of the step [m].
  std::uint32_t step_ = 1;                                   ///< Calls of FindPairs.
};

}  // namespace fulcrum::physics
