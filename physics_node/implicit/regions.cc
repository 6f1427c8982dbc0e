#include "physics_node/implicit/regions.h"

#include <algorithm>

#include "physics_node/implicit/kernels.h"

namespace fulcrum::physics::implicit {
namespace {

/// With four, two threads had a task more or less than each other in each phase and took a tenth longer
/// (deploy/docs/measurements/physics).
constexpr int kRegionsPerTask = 3;

}  // namespace

Partition::Partition(const ParticleStore& particles, std::span<const std::pair<ParticleRef, ParticleRef>> joined,
                     std::span<const Index> solid, std::span<const Index> row_body)
    : tube_floats_(particles.tube_floats()),
      stride_(particles.layout().stride),
      tube_count_(particles.tube_count()),
      rows_(particles.layout().rows),
      cols_(particles.layout().cols) {
  sheet_regions_ = (static_cast<int>(rows_) + kRows - 1) / kRows;
  for (int region = 0; region < sheet_regions_; ++region) {
    body_.push_back(static_cast<int>(row_body[static_cast<std::size_t>(region * kRows)]));
  }
  for (std::uint32_t v = 0; v < tube_count_; ++v) {
    const int body = static_cast<int>(solid[v]);
    const bool new_solid = first_vertex_.empty() || body != body_.back();
    if (new_solid && v % ParticleStore::kBlockVertices != 0) split_blocks_.push_back(particles.BlockOf(v));
    if (new_solid || v % kVertices == 0) {
      first_vertex_.push_back(static_cast<int>(v));
      body_.push_back(body);
    }
    region_of_vertex_.push_back(sheet_regions_ + static_cast<int>(first_vertex_.size()) - 1);
  }
  first_vertex_.push_back(static_cast<int>(tube_count_));
  for (const int body : body_) body_count_ = std::max(body_count_, body + 1);
  neighbours_.resize(body_.size());
  const auto join = [&](int a, int b) {
    if (a != b) {
      neighbours_[static_cast<std::size_t>(a)].push_back(b);
      neighbours_[static_cast<std::size_t>(b)].push_back(a);
    }
  };
  for (int region = 0; region + 1 < sheet_regions_; ++region) {
    const auto at = static_cast<std::size_t>(region);
    if (body_[at] == body_[at + 1]) join(region, region + 1);
  }
  for (const auto& [a, b] : joined) {
    join(Of(a), Of(b));
  }
  for (std::vector<int>& list : neighbours_) {
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
  }
}

int Partition::Of(ParticleRef at) const {
  return at.base < tube_floats_ ? At(false, static_cast<int>(at.base / kVertexFloats))
                                : At(true, static_cast<int>((at.base - tube_floats_) / stride_));
}

Task Partition::Extent(int region) const {
  if (region < sheet_regions_) {
    return {true, region * kRows, std::min((region + 1) * kRows, static_cast<int>(rows_))};
  }
  const auto of_organ = static_cast<std::size_t>(region - sheet_regions_);
  return {false, first_vertex_[of_organ], first_vertex_[of_organ + 1]};
}

int Partition::ParticlesOf(int region) const {
  const Task extent = Extent(region);
  return (extent.end - extent.first) * (extent.sheet ? static_cast<int>(cols_) : 1);
}

RegionSet Partition::MakeSet() const {
  const auto size = static_cast<std::size_t>(count());
  RegionSet set;
  set.marked.assign(size, 0);
  set.near.assign(size, 0);
  set.tasks.reserve(size);
  set.patches.reserve(size);
  return set;
}

void Partition::MarkNear(RegionSet* set) const {
  std::fill(set->near.begin(), set->near.end(), std::uint8_t{0});
  for (std::size_t i = 0; i < set->marked.size(); ++i) {
    if (set->marked[i] != 0) {
      set->near[i] = 1;
      for (const int neighbour : neighbours_[i]) {
        set->near[static_cast<std::size_t>(neighbour)] = 1;
      }
    }
  }
}

void Partition::AddTasks(int first_region, int end_region, std::span<const std::uint8_t> wanted,
                         std::vector<Task>* tasks) const {
  int length = 0;
  for (int region = first_region; region < end_region; ++region) {
    if (wanted[static_cast<std::size_t>(region)] == 0) {
      length = 0;
      continue;
    }
    const Task extent = Extent(region);
    if (length > 0 && length < kRegionsPerTask) {
      tasks->back().end = extent.end;
      ++length;
    } else {
      tasks->push_back(extent);
      length = 1;
    }
  }
}

void Partition::FindTasks(RegionSet* set) const {
  set->tasks.clear();
  set->patches.clear();
  AddTasks(0, sheet_regions_, set->marked, &set->tasks);
  set->sheet_tasks = static_cast<int>(set->tasks.size());
  AddTasks(sheet_regions_, count(), set->marked, &set->tasks);
  MarkNear(set);
  AddTasks(sheet_regions_, count(), set->near, &set->patches);
}

Regions::Regions(const Partition& partition) : partition_(partition), computed_(partition.MakeSet()) {
  const auto size = static_cast<std::size_t>(partition.count());
  awake_.assign(size, 1);
  moving_.assign(size, 0);
  still_s_.assign(size, 0.0f);
  removed_.reserve(size);
  bodies_.resize(static_cast<std::size_t>(partition.body_count()));
  computed_bodies_.assign(bodies_.size(), 1);
  for (int region = 0; region < partition.count(); ++region) {
    bodies_[static_cast<std::size_t>(partition.BodyOf(region))].particles += partition.ParticlesOf(region);
  }
  (void)Rebuild();
}

void Regions::Wake(int region) {
  const auto i = static_cast<std::size_t>(region);
  still_s_[i] = 0;
  if (awake_[i] == 0) {
    awake_[i] = 1;
    changed_ = true;
  }
}

void Regions::WakeAll() {
  for (int region = 0; region < partition_.count(); ++region) {
    Wake(region);
  }
}

void Regions::SleepOthers() {
  SleepStill([](int) { return true; });
}

void Regions::SleepStill(const std::function<bool(int region)>& is_still) {
  if (bodies_.empty()) return;
  std::vector<std::uint8_t> still(bodies_.size(), 1);
  still[0] = 0;
  for (int region = 0; region < partition_.count(); ++region) {
    std::uint8_t& body = still[static_cast<std::size_t>(partition_.BodyOf(region))];
    body = body != 0 && is_still(region) ? 1 : 0;
  }
  for (int region = 0; region < partition_.count(); ++region) {
    std::uint8_t& awake = awake_[static_cast<std::size_t>(region)];
    if (still[static_cast<std::size_t>(partition_.BodyOf(region))] == 0 || awake == 0) continue;
    awake = 0;
    changed_ = true;
  }
}

void Regions::UpdateSleep(std::span<const float> speed, float h) {
  for (std::size_t i = 0; i < awake_.size(); ++i) {
    if (awake_[i] != 0) {
      still_s_[i] += h;
    }
  }
  for (std::size_t i = 0; i < awake_.size(); ++i) {
    moving_[i] = speed[i] >= kStillSpeed_m_s ? 1 : 0;
    if (moving_[i] != 0) {
      Wake(static_cast<int>(i));
      for (const int neighbour : partition_.neighbours(static_cast<int>(i))) {
        Wake(neighbour);
      }
    }
  }
  for (std::size_t i = 0; i < awake_.size(); ++i) {
    if (awake_[i] != 0 && still_s_[i] >= kStillTime_s) {
      awake_[i] = 0;
      changed_ = true;
    }
  }
}

float Regions::awake_part() const {
  int particles = 0;
  for (int region = 0; region < partition_.count(); ++region) {
    particles += awake_[static_cast<std::size_t>(region)] != 0 ? partition_.ParticlesOf(region) : 0;
  }
  return static_cast<float>(particles) / static_cast<float>(std::max(partition_.particle_count(), 1));
}

bool Regions::Rebuild() {
  if (!changed_) {
    return false;
  }
  changed_ = false;
  for (Body& body : bodies_) body.awake = 0;
  for (int region = 0; region < partition_.count(); ++region) {
    if (awake_[static_cast<std::size_t>(region)] == 0) continue;
    bodies_[static_cast<std::size_t>(partition_.BodyOf(region))].awake += partition_.ParticlesOf(region);
  }
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    Body& body = bodies_[i];
    computed_bodies_[i] = body.awake > 0 ? 1 : 0;
    body.whole = static_cast<float>(body.awake) > kLargestAwakePart * static_cast<float>(body.particles);
  }
  removed_.clear();
  bool differs = false;
  all_computed_ = true;
  for (int region = 0; region < partition_.count(); ++region) {
    const auto i = static_cast<std::size_t>(region);
    const bool now = awake_[i] != 0 || whole(partition_.BodyOf(region));
    if (computed_.marked[i] != 0 && !now) {
      removed_.push_back(region);
    }
    differs |= (computed_.marked[i] != 0) != now;
    all_computed_ &= now;
    computed_.marked[i] = now ? 1 : 0;
  }
  if (differs) partition_.FindTasks(&computed_);
  return differs;
}

void Regions::Widen(RegionSet* set) const {
  partition_.MarkNear(set);
  for (std::size_t i = 0; i < set->near.size(); ++i) {
    set->marked[i] = set->near[i] != 0 && computed_.marked[i] != 0 ? 1 : 0;
  }
}

}  // namespace fulcrum::physics::implicit
