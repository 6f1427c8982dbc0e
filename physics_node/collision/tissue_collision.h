// Tissue against tissue and against what surrounds it: membrane nodes stay outside the organ, membrane and organ stay
// in front of the fixed surfaces of the scene that collide.
//
// Amortised by distance: a particle that was d from contact is not looked at again before it and what it may touch have
// together moved that far; one that is near keeps its triangle for kKeep. Movements come from the solver by blocks of
// particles, so tissue at rest costs one comparison a block. Where a block has moved far enough, each of its particles
// is first asked for its own way, which is shorter than that of the fastest one added up over the steps.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "physics_node/collision/contact_row.h"
#include "physics_node/collision/kernels.h"
#include "physics_node/collision/triangle_tree.h"
#include "physics_node/tissue/particle_store.h"
#include "physics_node/tissue/tissue_model.h"
#include "services/base/core/scene_view.h"

namespace fulcrum::physics {

class TissueCollision {
 public:
  /// Set in ContactRow.source of our rows.
  static constexpr std::uint32_t kSource = 0x80000000u;
  static constexpr std::size_t kMaxRows = 4096;

  TissueCollision(const SceneView& scene, const TissueModel* model, const ParticleStore* particles,
                  const collision::Kernels& kernels = collision::KernelsFor());

  /// Once a step, before it. `moved`: at least how far any particle of each block of the ParticleStore has moved since
  /// the last call [m], [block_count()]; 0 for blocks at rest. Simulated time at the begin and the end of the step [s]:
  /// what breathes moves from one to the other.
  void FindPairs(std::span<const float> moved, double time0_s, double time1_s) {
    BeginPairs(moved, time0_s, time1_s);
    for (int task = 0; task < tasks(); ++task) FindPairsOf(task, moved);
  }
  // The same in pieces: tasks by any thread, those of rows close to one another next to one another.
  void BeginPairs(std::span<const float> moved, double time0_s, double time1_s);
  [[nodiscard]] int tasks() const { return kParts * (1 + static_cast<int>(fixed_.size())); }
  void FindPairsOf(int task, std::span<const float> moved);
  /// Appends the contacts of the substep from part u0 to u1 of the step; at most kMaxRows.
  void Rows(float u0, float u1, std::vector<ContactRow>* rows) {
    for (int part = 0; part < kParts; ++part) FindRows(part, u0, u1);
    JoinRows(rows);
  }
  // The same in pieces: parts [0, kParts) by any thread.
  static constexpr int kParts = 8;
  void FindRows(int part, float u0, float u1);
  void JoinRows(std::vector<ContactRow>* rows) const;

  /// Something that breathes is near live tissue in this step: it will push.
  [[nodiscard]] bool breath_near() const;
  /// Particles near something in this step.
  [[nodiscard]] std::size_t near_count() const;
  /// Particles looked at by the last FindPairs.
  [[nodiscard]] std::size_t looked_at() const;

 private:
  /// What a particle must stay in front of. What most steps ask for fills the first cache line.
  struct alignas(64) Watch {
    ParticleRef at;
    Index triangle = kNoIndex;   ///< Of tube_surface, or of the tree.
    std::uint32_t asked = 0;     ///< The step in which it was last asked for its way.
    Vec3f seen = Vec3f::Zero();  ///< Where it was when it was looked at: see Standpoint.
    Vec3f last = Vec3f::Zero();  ///< Where it was in step `asked`.
    float gone = 0;              ///< From `seen` to `last` [m].
    float way = 0;        ///< In the step before that one, with what it may touch: its next is about the same [m].
    float gap = 0;        ///< From contact when it was looked at [m].
    float others = 0;     ///< Travel of what it may touch at that time [m].
    bool front = false;   ///< Seen in front of the surface and not lost from sight since.
    bool blocks = true;   ///< What it was seen nearest to can hold it back: not out of sight, nor past a rim.
    bool near = false;    ///< Rows may come of it before it is looked at again.
    bool judged = false;  ///< Of a fixed surface: it is known where the particle lies at rest, as `behind` tells.
    bool behind = false;  ///< Behind a fixed surface: it is not the surface's business.
    float clearance = 0;  ///< Kept from the surface: less where it rests nearer [m].
    Index particle = 0;
    Vec3f point = Vec3f::Zero();   ///< Of a fixed surface: the nearest one …
    Vec3f normal = Vec3f::Zero();  ///< … and its normal.
    /// It was looked at.
    void SetGap(float from_contact, const Vec3f& where, float others_travel);
  };
  /// Of a watch, or the least of a group's: the travel that concerns it at which something is to be done [m].
  struct Times {
    float due = 0;         ///< It is looked at again.
    float start = kNever;  ///< Rows may come of it from here on, until it is looked at again; told without the band.
  };
  static constexpr float kNever = 3e38f;
  /// Watches of one block. Most steps read nothing else of them.
  struct Group {
    float travel = 0;  ///< Of it and of what it may touch, since the beginning [m].
    Times times;
    Index block = 0;
  };
  /// Blocks of the organ that a group's triangles are in, the last one repeated.
  static constexpr std::size_t kMostBeside = 8;
  using Beside = std::array<Index, kMostBeside>;
  /// A group of which a watch may have to be asked in this step.
  struct Due {
    Index group = 0;
    float step = 0;        ///< It and what it may touch move so far in this step [m].
    float travel = 0;      ///< Of the group, with this step [m].
    float from = 0;        ///< Rows may come of what starts before this travel [m].
    bool is_due = false;   ///< One of it is to be looked at, if its own way was as far.
    bool strayed = false;  ///< One was nearest to another triangle.
  };
  struct Asked {
    Index watch = 0;
    Index due = 0;  ///< Its group's place among those.
  };
  /// One that is near in this step.
  struct Near {
    Index watch = 0;
    float band = 0;  ///< Rows are made this far from contact, or as much less as they are for less than a step [m].
  };
  struct Signed {
    std::array<float, 3> barycentric{};
    Vec3f normal = Vec3f::Zero();  ///< Unit, from the surface to the particle's proper side.
    float distance = 0;            ///< Negative: behind [m].
  };

  /// Found in a part of a surface's groups.
  struct Found {
    std::vector<Due> due;          ///< Room for those of a step.
    std::vector<Asked> asked;      ///< Of them, in this step.
    std::vector<Near> near;        ///< In this step.
    std::size_t looked_at = 0;     ///< In this step.
    std::vector<ContactRow> rows;  ///< In this substep.
  };
  /// All that watches one surface.
  struct Watches {
    std::vector<Watch> all;
    std::vector<Times> times;  ///< Of each, apart from the rest: most steps read nothing else.
    std::vector<Group> groups;
    std::vector<Index> first;    ///< Watch of each group, and how many there are in all.
    std::vector<Beside> beside;  ///< By group, of what watches the organ.
    std::array<Found, kParts> found;
    void MakeGroups(const ParticleStore& particles);
  };

  /// A fixed surface of the scene that collides. What lies behind it at rest, such as the organ under the peritoneum,
  /// is not its business.
  struct Fixed {
    TriangleTree tree;
    bool breathes = false;
    Watches watches;
  };

  void WatchOrgan();
  void WatchFixed(const StaticSurface& surface);
  float See(const TriangleTree& tree, const Vec3f& p, Watch* watch) const;
  [[nodiscard]] std::array<Vec3f, 3> OrganCorners(Index triangle) const;
  /// Walks to the nearest triangle of the organ from the one known.
  void Walk(Watch* watch, const Vec3f& p) const;
  [[nodiscard]] static Signed SignedDistance(const Vec3f& p, const std::array<Vec3f, 3>& corners);
  /// With the closest point known.
  [[nodiscard]] static Signed SignedDistance(const Vec3f& p, const std::array<Vec3f, 3>& corners,
                                             const std::array<float, 3>& barycentric);
  /// Whose movement concerns a particle that watches the organ: its own against the middle of its triangle.
  [[nodiscard]] Vec3f Standpoint(const Watch& watch) const {
    const auto x = OrganCorners(watch.triangle);
    return particles_->At(watch.at) - (x[0] + x[1] + x[2]) / 3.0f;
  }
  /// Fills watch->gone and way; `unknown` is the way of one that was not asked in the last step.
  template <class Stand>
  void AskWay(Watch* watch, float others_moved, float unknown, const Stand& stand) const;
  /// A surface, in whole, has travelled and moved in this step by `others_travel` and `others_moved` at most; what a
  /// group may touch of it has moved by around(index of the group).
  template <class Around, class Stand, class Look>
  void LookAtDue(Watches* watches, int part, std::span<const float> moved, float others_travel, float others_moved,
                 const Around& around, const Stand& stand, const Look& look);
  template <class Around>
  static std::span<Due> FindDue(Watches* watches, int part, std::span<const float> moved, const Around& around,
                                std::vector<Due>* found);
  template <class Wanted>
  static void FindAsked(const Watches& watches, std::span<const Due> due, const Wanted& wanted,
                        std::vector<Asked>* asked);
  template <class Body>
  void ForAsked(Watches* watches, std::span<const Asked> asked, const Body& body) const;
  void FindBeside(Index group);
  void AddOrganRow(const Near& near, const Signed& now, std::vector<ContactRow>* rows) const;
  void LookAtOrgan(int part, std::span<const float> moved);
  void LookAtFixed(Fixed* fixed, int part, std::span<const float> moved);
  [[nodiscard]] bool Touches(Index particle) const;
  void FindOrganRows(Found* found, float u0, float u1) const;
  void FindFixedRows(const Fixed& fixed, Found* found, float u0, float u1) const;
  /// body(part) for all that was found: the organ's parts, then those of each fixed surface.
  template <class Body>
  void ForFound(const Body& body) const;

  SceneView scene_;
  const TissueModel* model_;
  const ParticleStore* particles_;
  const collision::Kernels& kernels_;

  std::vector<Index> ring_start_, ring_;  ///< Organ triangles that share a corner with each.
  Watches organ_;
  std::vector<Fixed> fixed_;

  float organ_travel_ = 0, organ_moved_ = 0, breath_travel_ = 0;
  std::vector<float> organ_moved_of_;  ///< By block of the organ; then the largest.
  Vec3f breath0_ = Vec3f::Zero(), breath1_ = Vec3f::Zero();
  std::uint32_t step_ = 1;  ///< Calls of FindPairs.
};

}  // namespace fulcrum::physics
