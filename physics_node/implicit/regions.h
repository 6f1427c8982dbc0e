// Which parts of the tissue are computed. The membrane is divided into bands of rows, the organ into runs of vertices.
// A region that stays still for a while falls asleep; what moves keeps its neighbours awake, so movement spreads a
// region a substep, and a sleeping region is to those awake a body that does not yield. Contact, grasp, cuts and heat
// wake explicitly. Sleep pays only where little is awake: as long as more than kLargestPart is, all is computed.
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "physics_node/tissue/particle_store.h"

namespace fulcrum::physics::implicit {

/// A stretch of work: rows of the membrane or vertices of the organ, at most three regions long.
struct Task {
  bool sheet = true;
  int first = 0, end = 0;
};

/// Regions in which something is computed.
struct Part {
  std::vector<std::uint8_t> marked;  ///< By region.
  std::vector<Task> tasks;           ///< In order: the membrane, then the organ.
  int sheet_tasks = 0;               ///< How many are of the membrane.
  std::vector<Task> patches;         ///< Vertices of the organ whose patches those need.
};

class Regions {
 public:
  static constexpr int kRows = 8;
  static constexpr int kVertices = 64;
  /// What moves slower than this for so long falls asleep [m/s], [s].
  static constexpr float kStillSpeed = 1e-4f;
  static constexpr float kStillTime = 0.5f;
  /// Of all particles.
  static constexpr float kLargestPart = 0.35f;

  /// All awake. `joined`: pairs of particles that forces join beyond rows and vertices next to each other.
  Regions(const ParticleStore& particles, std::span<const std::pair<ParticleRef, ParticleRef>> joined);

  [[nodiscard]] int count() const { return static_cast<int>(awake_.size()); }
  [[nodiscard]] int Of(ParticleRef at) const;
  /// Of a row of the membrane or a vertex of the organ.
  [[nodiscard]] int At(bool sheet, int place) const {
    return sheet ? place / kRows : sheet_regions_ + place / kVertices;
  }
  /// Rows or vertices of a region.
  [[nodiscard]] Task Extent(int region) const;
  [[nodiscard]] bool computed(int region) const { return part_.marked[static_cast<std::size_t>(region)] != 0; }
  [[nodiscard]] bool nothing() const { return part_.tasks.empty(); }
  [[nodiscard]] bool everything() const { return everything_; }
  /// Part of all particles that is awake, whether or not the rest is computed too.
  [[nodiscard]] float awake_part() const;

  /// Keeps awake, or wakes; in force after the next Rebuild.
  void Wake(int region);
  void WakeAll();
  /// At the end of a substep of h: puts to sleep and wakes by the largest speed of each region [m/s].
  void Settle(std::span<const float> speed, float h);
  /// True when what is computed has changed since the last call; then the tasks are new.
  bool Rebuild();

  /// What is computed.
  [[nodiscard]] const Part& part() const { return part_; }
  [[nodiscard]] Part MakePart() const;
  /// Adds to part->marked all neighbours that are computed.
  void Widen(Part* part);
  /// Tasks and patches of what is marked.
  void FindTasks(Part* part);
  /// Regions that the last Rebuild has taken out.
  [[nodiscard]] std::span<const int> taken_out() const { return taken_out_; }

 private:
  void AddTasks(int first_region, int end_region, std::span<const std::uint8_t> wanted, std::vector<Task>* tasks) const;
  /// near_ <- `marked` and the neighbours of those.
  void MarkNear(std::span<const std::uint8_t> marked);

  std::uint32_t tube_floats_, stride_, tube_count_, rows_, cols_;
  int sheet_regions_ = 0;
  std::vector<std::vector<int>> neighbours_;
  std::vector<std::uint8_t> awake_, near_;
  std::vector<float> still_s_;
  Part part_;
  std::vector<int> taken_out_;
  bool changed_ = true, everything_ = false;
};

}  // namespace fulcrum::physics::implicit
