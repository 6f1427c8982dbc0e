// Which regions of the tissue are computed. The membrane is divided into bands of rows, the organ into runs of vertices
// (Partition, built once). A region that stays still for a while falls asleep; a moving one keeps its neighbours awake,
// so movement spreads by one region a substep, and to the regions awake a sleeping one is a body that does not yield.
// Contact, grasp, cuts and heat wake explicitly. Sleep within a body saves time only where little of it is awake: while
// more than kLargestAwakePart is, all its regions are computed.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "physics_node/tissue/particle_store.h"

namespace fulcrum::physics::implicit {

/// A unit of work: rows of the membrane or vertices of the organ, at most three regions long.
struct Task {
  bool sheet = true;
  int first = 0, end = 0;
};

/// A set of regions and the tasks that cover it.
struct RegionSet {
  std::vector<std::uint8_t> marked;  ///< By region.
  std::vector<std::uint8_t> near;    ///< By region: marked or next to one that is.
  std::vector<Task> tasks;           ///< In order: the membrane, then the organ.
  int sheet_tasks = 0;               ///< How many are of the membrane.
  std::vector<Task> patches;         ///< Vertices of the organ whose patches those need.
};

/// The division of the tissue into regions, and which of them forces join. Does not change.
class Partition {
 public:
  /// Rows of the membrane and vertices of the organ in a region. Assumed: small, so that local movement keeps little
  /// tissue awake; large against the cost of claiming a task.
  static constexpr int kRows = 8, kVertices = 64;

  /// `joined`: pairs of particles that forces join beyond rows and vertices next to each other. `solid`: of each vertex
  /// of the organ, ascending; a region has vertices of one only. `row_body`: of each row of the membrane.
  Partition(const ParticleStore& particles, std::span<const std::pair<ParticleRef, ParticleRef>> joined,
            std::span<const Index> solid, std::span<const Index> row_body);

  [[nodiscard]] int count() const { return static_cast<int>(neighbours_.size()); }
  [[nodiscard]] int Of(ParticleRef at) const;
  /// Of a row of the membrane or a vertex of the organ.
  [[nodiscard]] int At(bool sheet, int place) const {
    return sheet ? place / kRows : region_of_vertex_[static_cast<std::size_t>(place)];
  }
  /// The body of a region: 0 the membrane with the organ, to which it is bound, then the other solids with the sheets
  /// over them, then sheets over none.
  [[nodiscard]] int BodyOf(int region) const { return body_[static_cast<std::size_t>(region)]; }
  /// Blocks of ParticleStore with vertices of two solids: two regions share them.
  [[nodiscard]] std::span<const Index> split_blocks() const { return split_blocks_; }
  [[nodiscard]] int body_count() const { return body_count_; }
  /// Rows or vertices of a region.
  [[nodiscard]] Task Extent(int region) const;
  [[nodiscard]] std::span<const int> neighbours(int region) const {
    return neighbours_[static_cast<std::size_t>(region)];
  }
  /// Particles of a region, places beyond the last column left out; of all regions.
  [[nodiscard]] int ParticlesOf(int region) const;
  [[nodiscard]] int particle_count() const { return static_cast<int>(rows_ * cols_ + tube_count_); }

  /// An empty set with memory for all regions.
  [[nodiscard]] RegionSet MakeSet() const;
  /// set->near from set->marked.
  void MarkNear(RegionSet* set) const;
  /// near, tasks and patches of the marked regions.
  void FindTasks(RegionSet* set) const;

 private:
  void AddTasks(int first_region, int end_region, std::span<const std::uint8_t> wanted, std::vector<Task>* tasks) const;

  std::uint32_t tube_floats_, stride_, tube_count_, rows_, cols_;
  int sheet_regions_ = 0;
  std::vector<int> region_of_vertex_;
  std::vector<Index> split_blocks_;
  std::vector<int> first_vertex_;  ///< By region of the organ, and the number of vertices.
  std::vector<int> body_;          ///< By region.
  int body_count_ = 0;
  std::vector<std::vector<int>> neighbours_;  ///< By region.
};

/// Which regions are awake, and which are computed.
class Regions {
 public:
  /// A region that moves slower than this for so long falls asleep [m/s], [s]: 1 um in a step of 10 ms for 50 steps, as
  /// for the tissue as a whole (simulation/tissue_sleep.cc).
  static constexpr float kStillSpeed_m_s = 1e-4f, kStillTime_s = 0.5f;
  /// Of the particles of a body; with more awake all are computed. A large sheet is solved badly without coarse nodes,
  /// and these need whole bodies. Assumed.
  static constexpr float kLargestAwakePart = 0.35f;

  /// All awake. `partition` must outlive this.
  explicit Regions(const Partition& partition);

  [[nodiscard]] const Partition& partition() const { return partition_; }
  [[nodiscard]] bool computed(int region) const { return computed_.marked[static_cast<std::size_t>(region)] != 0; }
  [[nodiscard]] bool none_computed() const { return computed_.tasks.empty(); }
  [[nodiscard]] bool all_computed() const { return all_computed_; }
  /// By body: some of its regions are computed.
  [[nodiscard]] std::span<const std::uint8_t> computed_bodies() const { return computed_bodies_; }
  /// All regions of a body are computed.
  [[nodiscard]] bool whole(int body) const { return bodies_[static_cast<std::size_t>(body)].whole; }
  [[nodiscard]] const RegionSet& computed() const { return computed_; }
  /// Part of all particles that is awake, also while all are computed.
  [[nodiscard]] float awake_part() const;

  /// It was faster than kStillSpeed_m_s at the last UpdateSleep.
  [[nodiscard]] bool moving(int region) const { return moving_[static_cast<std::size_t>(region)] != 0; }

  /// Keeps awake, or wakes; in force after the next Rebuild.
  void Wake(int region);
  void WakeAll();
  /// All bodies but the membrane with the organ fall asleep: nothing has moved for a while.
  void SleepOthers();
  /// All bodies but the membrane with the organ whose regions are all still fall asleep.
  void SleepStill(const std::function<bool(int region)>& is_still);
  /// At the end of a substep of h: puts to sleep and wakes by the largest speed of each region [m/s].
  void UpdateSleep(std::span<const float> speed, float h);
  /// True when the computed regions have changed since the last call; then the tasks are new.
  bool Rebuild();
  /// Regions that the last Rebuild has removed.
  [[nodiscard]] std::span<const int> removed() const { return removed_; }

  /// Adds to set->marked all neighbours that are computed.
  void Widen(RegionSet* set) const;

 private:
  const Partition& partition_;
  std::vector<std::uint8_t> awake_, moving_;
  std::vector<float> still_s_;  ///< By region: since when it has been still [s].
  RegionSet computed_;
  std::vector<int> removed_;
  struct Body {
    int particles = 0, awake = 0;
    bool whole = false;
  };
  std::vector<Body> bodies_;
  std::vector<std::uint8_t> computed_bodies_;
  bool changed_ = true, all_computed_ = false;
};

}  // namespace fulcrum::physics::implicit
