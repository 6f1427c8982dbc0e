#include "physics_node/implicit/regions.h"

#include <algorithm>

namespace fulcrum::physics::implicit {
namespace {

constexpr int kRegionsPerTask = 3;

}  // namespace

Regions::Regions(const ParticleStore& particles, std::span<const std::pair<ParticleRef, ParticleRef>> joined)
    : tube_floats_(particles.tube_floats()),
      stride_(particles.layout().stride),
      tube_count_(particles.tube_count()),
      rows_(particles.layout().rows),
      cols_(particles.layout().cols) {
  const auto regions = [](std::uint32_t count, int of) { return (static_cast<int>(count) + of - 1) / of; };
  sheet_regions_ = regions(rows_, kRows);
  const int all = sheet_regions_ + regions(tube_count_, kVertices);
  neighbours_.resize(static_cast<std::size_t>(all));
  const auto join = [&](int a, int b) {
    if (a != b) {
      neighbours_[static_cast<std::size_t>(a)].push_back(b);
      neighbours_[static_cast<std::size_t>(b)].push_back(a);
    }
  };
  for (int region = 0; region + 1 < sheet_regions_; ++region) {
    join(region, region + 1);
  }
  for (const auto& [a, b] : joined) {
    join(Of(a), Of(b));
  }
  for (std::vector<int>& list : neighbours_) {
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
  }
  const auto size = static_cast<std::size_t>(all);
  awake_.assign(size, 1);
  near_.assign(size, 1);
  still_s_.assign(size, 0.0f);
  part_ = MakePart();
  taken_out_.reserve(size);
  (void)Rebuild();
}

int Regions::Of(ParticleRef at) const {
  return at.base < tube_floats_ ? At(false, static_cast<int>(at.base / 4))
                                : At(true, static_cast<int>((at.base - tube_floats_) / stride_));
}

Task Regions::Extent(int region) const {
  if (region < sheet_regions_) {
    return {true, region * kRows, std::min((region + 1) * kRows, static_cast<int>(rows_))};
  }
  const int first = (region - sheet_regions_) * kVertices;
  return {false, first, std::min(first + kVertices, static_cast<int>(tube_count_))};
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
  for (int region = 0; region < count(); ++region) {
    Wake(region);
  }
}

void Regions::Settle(std::span<const float> speed, float h) {
  for (std::size_t i = 0; i < awake_.size(); ++i) {
    if (awake_[i] != 0) {
      still_s_[i] += h;
    }
  }
  for (std::size_t i = 0; i < awake_.size(); ++i) {
    if (speed[i] >= kStillSpeed) {
      Wake(static_cast<int>(i));
      for (const int neighbour : neighbours_[i]) {
        Wake(neighbour);
      }
    }
  }
  for (std::size_t i = 0; i < awake_.size(); ++i) {
    if (awake_[i] != 0 && still_s_[i] >= kStillTime) {
      awake_[i] = 0;
      changed_ = true;
    }
  }
}

void Regions::AddTasks(int first_region, int end_region, std::span<const std::uint8_t> wanted,
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

float Regions::awake_part() const {
  int particles = 0;
  for (int region = 0; region < count(); ++region) {
    const Task extent = Extent(region);
    const int size = (extent.end - extent.first) * (extent.sheet ? static_cast<int>(cols_) : 1);
    particles += awake_[static_cast<std::size_t>(region)] != 0 ? size : 0;
  }
  return static_cast<float>(particles) / static_cast<float>(std::max(rows_ * cols_ + tube_count_, 1u));
}

bool Regions::Rebuild() {
  if (!changed_) {
    return false;
  }
  changed_ = false;
  const bool everything = awake_part() > kLargestPart;
  if (everything && everything_) {
    return false;
  }
  everything_ = everything;
  taken_out_.clear();
  for (int region = 0; region < count(); ++region) {
    const auto i = static_cast<std::size_t>(region);
    const bool now = everything || awake_[i] != 0;
    if (part_.marked[i] != 0 && !now) {
      taken_out_.push_back(region);
    }
    part_.marked[i] = now ? 1 : 0;
  }
  FindTasks(&part_);
  return true;
}

Part Regions::MakePart() const {
  const auto size = static_cast<std::size_t>(count());
  Part part;
  part.marked.assign(size, 0);
  part.tasks.reserve(size);
  part.patches.reserve(size);
  return part;
}

void Regions::MarkNear(std::span<const std::uint8_t> marked) {
  std::fill(near_.begin(), near_.end(), std::uint8_t{0});
  for (std::size_t i = 0; i < marked.size(); ++i) {
    if (marked[i] != 0) {
      near_[i] = 1;
      for (const int neighbour : neighbours_[i]) {
        near_[static_cast<std::size_t>(neighbour)] = 1;
      }
    }
  }
}

void Regions::Widen(Part* part) {
  MarkNear(part->marked);
  for (std::size_t i = 0; i < near_.size(); ++i) {
    part->marked[i] = near_[i] != 0 && part_.marked[i] != 0 ? 1 : 0;
  }
}

void Regions::FindTasks(Part* part) {
  part->tasks.clear();
  part->patches.clear();
  AddTasks(0, sheet_regions_, part->marked, &part->tasks);
  part->sheet_tasks = static_cast<int>(part->tasks.size());
  AddTasks(sheet_regions_, count(), part->marked, &part->tasks);
  MarkNear(part->marked);
  AddTasks(sheet_regions_, count(), near_, &part->patches);
}

}  // namespace fulcrum::physics::implicit
