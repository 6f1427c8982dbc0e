#include "thermal_node/coupling/cut_meter.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <queue>
#include <utility>

namespace fulcrum::thermal {
namespace {

/// What lies nearer to the way than this belongs to the width of the slit; what lies farther is a branch [m].
constexpr float kSlitReach = 0.004f;

float Distance(const CutMeter::Mark& a, const CutMeter::Mark& b) { return std::hypot(a[0] - b[0], a[1] - b[1]); }

}  // namespace

void CutMeter::Update(HeatField* field, CellIndex low, CellIndex high) {
  const std::size_t before = marks_.size();
  for (int iy = low.iy; iy <= high.iy; ++iy) {
    for (int ix = low.ix; ix <= high.ix; ++ix) {
      const CellIndex cell{ix, iy};
      Tile* tile = field->sheet().Contains(cell) ? field->Find(ix / kTile, iy / kTile) : nullptr;
      if (tile == nullptr) continue;
      std::uint8_t& flags = tile->state.flags[(iy % kTile) * kTile + ix % kTile];
      if ((flags & (kRemoved | kCounted)) != kRemoved) continue;
      flags = static_cast<std::uint8_t>(flags | kCounted);
      const Vec2f place = field->sheet().CentreOf(cell);
      Add({place.x(), place.y()});
    }
  }
  if (marks_.size() != before) Measure();
}

void CutMeter::Add(const Mark& mark) {
  const auto near = [&](const Mark& other) { return Distance(mark, other) <= kMarkSpacing; };
  if (std::any_of(marks_.begin(), marks_.end(), near)) return;
  const auto self = static_cast<std::uint32_t>(marks_.size());
  links_.emplace_back();
  for (std::uint32_t other = 0; other < self; ++other) {
    const float length = Distance(mark, marks_[other]);
    if (length > 2.0f * kMarkSpacing) continue;
    links_[self].push_back({other, length});
    links_[other].push_back({self, length});
  }
  marks_.push_back(mark);
}

std::vector<float> CutMeter::DistanceFrom(const std::vector<std::uint32_t>& sources,
                                          std::vector<std::uint32_t>* previous) const {
  std::vector<float> distance(marks_.size(), -1.0f);
  previous->assign(marks_.size(), kNoIndex);
  using Entry = std::pair<float, std::uint32_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
  for (const std::uint32_t source : sources) {
    distance[source] = 0;
    open.push({0.0f, source});
  }
  while (!open.empty()) {
    const auto [reached, mark] = open.top();
    open.pop();
    if (reached > distance[mark]) continue;
    for (const Link& link : links_[mark]) {
      const float way = reached + link.length_m;
      if (distance[link.to] >= 0 && distance[link.to] <= way) continue;
      distance[link.to] = way;
      (*previous)[link.to] = mark;
      open.push({way, link.to});
    }
  }
  return distance;
}

void CutMeter::Measure() {
  length_m_ = 0;
  std::vector<std::uint32_t> previous;
  std::vector<bool> seen(marks_.size(), false);
  const auto farthest = [](const std::vector<float>& distance) {
    return static_cast<std::uint32_t>(std::max_element(distance.begin(), distance.end()) - distance.begin());
  };
  for (std::uint32_t start = 0; start < marks_.size(); ++start) {
    if (seen[start]) continue;
    // One hole: its longest way runs between the mark farthest from any, and the one farthest from that.
    const std::vector<float> around = DistanceFrom({start}, &previous);
    for (std::size_t i = 0; i < marks_.size(); ++i) seen[i] = seen[i] || around[i] >= 0;
    std::vector<float> distance = DistanceFrom({farthest(around)}, &previous);
    std::vector<std::uint32_t> way;
    std::uint32_t end = farthest(distance);
    float longest = distance[end];
    do {
      length_m_ += longest;
      for (std::uint32_t at = end; at != kNoIndex; at = previous[at]) way.push_back(at);
      distance = DistanceFrom(way, &previous);
      end = farthest(distance);
      longest = distance[end];
    } while (longest > kSlitReach);
  }
}

void CutMeter::Restore(const std::vector<Mark>& marks) {
  marks_.clear();
  links_.clear();
  for (const Mark& mark : marks) Add(mark);
  Measure();
}

}  // namespace fulcrum::thermal
