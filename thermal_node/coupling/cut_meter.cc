#include "thermal_node/coupling/cut_meter.h"

#include <cmath>
#include <utility>

namespace fulcrum::thermal {
namespace {

constexpr float kLongestWait_s = 1.0f;
constexpr std::size_t kMostStretches = 4096;

std::uint8_t* FlagsOf(const HeatField& field, CellIndex cell) {
  if (!field.sheet().Contains(cell)) return nullptr;
  Tile* tile = field.Find(cell.ix / kTile, cell.iy / kTile);
  return tile != nullptr ? &tile->state.flags[(cell.iy % kTile) * kTile + cell.ix % kTile] : nullptr;
}

void MarkCounted(const HeatField& field, CellIndex centre, float radius_m) {
  const int reach = static_cast<int>(std::ceil(radius_m / field.material().cell_m));
  for (int dj = -reach; dj <= reach; ++dj) {
    for (int di = -reach; di <= reach; ++di) {
      if (di * di + dj * dj > reach * reach) continue;
      std::uint8_t* flags = FlagsOf(field, {centre.ix + di, centre.iy + dj});
      if (flags != nullptr) *flags = static_cast<std::uint8_t>(*flags | kCounted);
    }
  }
}

}  // namespace

void CutMeter::Walk(const HeatField& field, const TipPath& path) {
  const Sheet& sheet = field.sheet();
  const float step = 0.25f * field.material().cell_m;
  const float length = (path.to - path.from).norm();
  const int steps = static_cast<int>(std::ceil(length / step));
  for (int n = 1; n <= steps; ++n) {
    const Vec2f p = path.from + (path.to - path.from) * (static_cast<float>(n) / static_cast<float>(steps));
    const CellIndex cell = sheet.CellOf(p);
    walked_m_ += length / static_cast<float>(steps);
    if (!stretches_.empty() && stretches_.back().cell == cell) {
      stretches_.back().length_m += stretches_.back().counted == 0 ? std::exchange(walked_m_, 0.0f) : 0.0f;
      continue;
    }
    const std::uint8_t* flags = FlagsOf(field, cell);
    const bool old = flags != nullptr && (*flags & kCounted) != 0;
    const float share = std::exchange(walked_m_, 0.0f);
    if (flags == nullptr || old) continue;
    if (stretches_.size() >= kMostStretches) stretches_.pop_front();
    stretches_.push_back({cell, share, 0, path.radius_m, 0});
  }
  tip_ = path.to;
}

void CutMeter::Update(HeatField* field, float dt_s) {
  for (Stretch& stretch : stretches_) {
    stretch.age_s += dt_s;
    const std::uint8_t* flags = FlagsOf(*field, stretch.cell);
    if (stretch.counted != 0 || flags == nullptr || (*flags & kRemoved) == 0) continue;
    stretch.counted = 1;
    length_m_ += stretch.length_m;
  }
  const float cell = field->material().cell_m;
  while (!stretches_.empty()) {
    const Stretch& oldest = stretches_.front();
    const float away = (field->sheet().CentreOf(oldest.cell) - tip_).norm();
    const bool left_behind = away > 2.0f * oldest.radius_m + cell;
    if (oldest.age_s < kLongestWait_s && !(left_behind && oldest.counted != 0)) break;
    if (oldest.counted != 0) MarkCounted(*field, oldest.cell, oldest.radius_m);
    stretches_.pop_front();
  }
}

void CutMeter::Restore(const State& state, std::deque<Stretch> stretches) {
  length_m_ = state.length_m;
  tip_ = Vec2f(state.tip_s, state.tip_t);
  walked_m_ = state.walked_m;
  stretches_ = std::move(stretches);
}

}  // namespace fulcrum::thermal
