#include "thermal_node/topology/line_graph.h"

#include <algorithm>
#include <cmath>

namespace fulcrum::thermal {
namespace {

/// Threshold of a spur's protrusion from the hole's border: so many half widths plus this length [m]. A branch
/// protrudes by more than the width of the hole beside it; a protrusion wider than long is a bay of the border.
constexpr float kSpurPart = 2.0f, kSpur_m = 2e-4f;
/// A spur above the threshold counts with this factor times its excess, at most with its whole length. So its length
/// enters the sum continuously, without a jump.
constexpr float kSpurSlope = 4.0f;
/// Half width of the moving average [m].
constexpr float kSmooth_m = 5e-4f;
/// The direction of the line at a free end is that of its last millimetre [m].
constexpr float kDirection_m = 1e-3f;
/// Bound of the extension at a free end: a factor of the half width (1 at a round end, 1.41 at the corner of a square
/// one) plus the length that thinning removed [m].
constexpr float kEndPart = 1.5f, kEnd_m = 3e-4f;
/// Mean length of straight and diagonal steps of a digitised line (Vossepoel and Smeulders 1982, two parameters).
constexpr float kStraight = 0.948f, kDiagonal = 1.343f;
constexpr float kMarch = 0.25f;  ///< Step along a ray through the hole [cells].

Vec2f Centre(CellIndex c) { return {static_cast<float>(c.ix), static_cast<float>(c.iy)}; }

/// Length of the hole from `from` along the unit vector `direction`, at most `most` [cells].
float March(const HeatField& field, const Vec2f& from, const Vec2f& direction, float most) {
  float reached = 0;
  while (reached < most) {
    const Vec2f at = from + (reached + kMarch) * direction;
    if (!IsHole(field, {static_cast<int>(std::lround(at.x())), static_cast<int>(std::lround(at.y()))})) break;
    reached += kMarch;
  }
  return std::min(reached, most);
}

}  // namespace

float LineGraph::Measure(const HeatField& field, std::span<const LineCell> cells) {
  cells_ = cells;
  cell_m_ = field.sheet().cell_m;
  weights_.assign(cells.size(), 0.0f);
  Link();
  do {
    Trace();
  } while (Prune());
  for (Stretch& stretch : stretches_) stretch.length = LengthOf(field, stretch);
  // Of the n stretches at a fork the n - 2 shortest are branches; they count by their excess.
  spurs_.clear();
  double length = 0;
  for (std::uint32_t s = 0; s < stretches_.size(); ++s) {
    IsSpur(stretches_[s]) ? spurs_.push_back(s) : void(length += static_cast<double>(stretches_[s].length));
  }
  const auto fork_of = [&](std::uint32_t s) {
    const std::uint32_t front = trail_[stretches_[s].begin];
    return IsFree(front) ? trail_[stretches_[s].end - 1] : front;
  };
  std::sort(spurs_.begin(), spurs_.end(), [&](std::uint32_t a, std::uint32_t b) {
    if (fork_of(a) != fork_of(b)) return fork_of(a) < fork_of(b);
    return stretches_[a].length != stretches_[b].length ? stretches_[a].length < stretches_[b].length : a < b;
  });
  int rank = 0;
  for (std::size_t n = 0; n < spurs_.size(); ++n) {
    const std::uint32_t fork = fork_of(spurs_[n]);
    rank = n > 0 && fork_of(spurs_[n - 1]) == fork ? rank + 1 : 0;
    const Stretch& spur = stretches_[spurs_[n]];
    const bool branch = rank < nodes_[fork].count - 2;
    const float most = branch ? kSpurSlope * std::max(Excess(spur, fork), 0.0f) : spur.length;
    length += static_cast<double>(std::min(spur.length, most));
  }
  return static_cast<float>(length) * cell_m_;
}

/// Links cells that touch. Cells that touch at a corner are linked only if neither of the two cells beside that corner
/// belongs to the line: otherwise the line passes through that cell.
void LineGraph::Link() {
  nodes_.assign(cells_.size(), Node{});
  const auto join = [&](std::size_t a, std::size_t b) {
    nodes_[a].to[nodes_[a].count++] = static_cast<std::uint32_t>(b);
    nodes_[b].to[nodes_[b].count++] = static_cast<std::uint32_t>(a);
  };
  std::size_t below = 0;
  for (std::size_t n = 0; n < cells_.size(); ++n) {
    const CellIndex c = cells_[n].at;
    const auto is = [&](std::size_t k, int ix, int iy) {
      return k < cells_.size() && cells_[k].at == CellIndex{ix, iy};
    };
    const bool left = n > 0 && is(n - 1, c.ix - 1, c.iy), right = is(n + 1, c.ix + 1, c.iy);
    if (right) join(n, n + 1);
    const auto before = [&](const LineCell& cell) {
      return cell.at.iy < c.iy + 1 || (cell.at.iy == c.iy + 1 && cell.at.ix < c.ix - 1);
    };
    while (below < cells_.size() && before(cells_[below])) ++below;
    const bool low_left = is(below, c.ix - 1, c.iy + 1);
    const std::size_t middle = below + (low_left ? 1 : 0);
    const bool low = is(middle, c.ix, c.iy + 1);
    const std::size_t last = middle + (low ? 1 : 0);
    if (low) join(n, middle);
    if (low_left && !low && !left) join(n, below);
    if (is(last, c.ix + 1, c.iy + 1) && !low && !right) join(n, last);
  }
}

void LineGraph::Trace() {
  trail_.clear();
  stretches_.clear();
  for (Node& node : nodes_) node.walked = 0;
  for (const bool rings : {false, true}) {
    for (std::uint32_t n = 0; n < nodes_.size(); ++n) {
      if (nodes_[n].pruned || (nodes_[n].count == 2) != rings) continue;
      if (nodes_[n].count == 0) {
        stretches_.push_back(
            {static_cast<std::uint32_t>(trail_.size()), static_cast<std::uint32_t>(trail_.size()) + 1, 0, 0});
        trail_.push_back(n);
      }
      // A ring is traced once, in one direction.
      for (unsigned link = 0; link < nodes_[n].count && !(rings && nodes_[n].walked != 0); ++link) Walk(n, link);
    }
  }
}

void LineGraph::Walk(std::uint32_t from, unsigned link) {
  if ((nodes_[from].walked >> link & 1u) != 0) return;
  const auto begin = static_cast<std::uint32_t>(trail_.size());
  float length = 0;
  trail_.push_back(from);
  for (std::uint32_t here = from;;) {
    Node& node = nodes_[here];
    node.walked = static_cast<std::uint8_t>(node.walked | 1u << link);
    const std::uint32_t next = node.to[link];
    Node& other = nodes_[next];
    const CellIndex a = cells_[here].at, b = cells_[next].at;
    length += a.ix != b.ix && a.iy != b.iy ? kDiagonal : kStraight;
    trail_.push_back(next);
    const auto back =
        static_cast<unsigned>(std::find(other.to.begin(), other.to.begin() + other.count, here) - other.to.begin());
    other.walked = static_cast<std::uint8_t>(other.walked | 1u << back);
    if (other.count != 2 || next == from) break;
    here = next;
    link = 1 - back;
  }
  const auto end = static_cast<std::uint32_t>(trail_.size());
  for (const std::uint32_t cell : {trail_[begin], trail_[end - 1]}) length += IsFree(cell) ? Radius(cell) : 0.0f;
  stretches_.push_back({begin, end, length, 0});
}

bool LineGraph::Prune() {
  spurs_.clear();
  for (std::uint32_t s = 0; s < stretches_.size(); ++s) {
    if (IsSpur(stretches_[s])) spurs_.push_back(s);
  }
  std::sort(spurs_.begin(), spurs_.end(), [&](std::uint32_t a, std::uint32_t b) {
    return stretches_[a].reach != stretches_[b].reach ? stretches_[a].reach < stretches_[b].reach : a < b;
  });
  bool any = false;
  for (const std::uint32_t s : spurs_) {
    const Stretch& spur = stretches_[s];
    const std::uint32_t front = trail_[spur.begin], fork = IsFree(front) ? trail_[spur.end - 1] : front;
    // A fork without branches has become part of a longer stretch, which is evaluated after the next Trace.
    if (nodes_[fork].count < 3 || Excess(spur, fork) > 0.0f) continue;
    CutOff(spur);
    any = true;
  }
  return any;
}

void LineGraph::CutOff(const Stretch& spur) {
  std::uint32_t first = spur.begin, last = spur.end - 1;
  if (!IsFree(trail_[first])) {
    Unlink(trail_[first], trail_[first + 1]);
    ++first;
  } else {
    Unlink(trail_[last], trail_[last - 1]);
    --last;
  }
  for (std::uint32_t n = first; n <= last; ++n) nodes_[trail_[n]].pruned = true;
}

void LineGraph::Unlink(std::uint32_t from, std::uint32_t to) {
  Node& node = nodes_[from];
  auto* end = node.to.begin() + node.count;
  std::remove(node.to.begin(), end, to);
  --node.count;
}

float LineGraph::Radius(std::uint32_t cell) const {
  // Tissue begins half a cell before the centre of its cell.
  return std::sqrt(static_cast<float>(cells_[cell].distance2)) - 0.5f;
}

float LineGraph::Excess(const Stretch& spur, std::uint32_t fork) const {
  return spur.reach - (1.0f + kSpurPart) * Radius(fork) - kSpur_m / cell_m_;
}

/// Moving average. The window shrinks towards the ends of a stretch, which stay fixed; on a ring it wraps around.
void LineGraph::Smooth(const Stretch& stretch) {
  const auto count = static_cast<int>(stretch.end - stretch.begin);
  const auto at = [&](int n) { return Centre(cells_[trail_[stretch.begin + static_cast<std::uint32_t>(n)]].at); };
  const bool ring = count > 3 && trail_[stretch.begin] == trail_[stretch.end - 1];
  const int widest = static_cast<int>(std::lround(kSmooth_m / cell_m_));
  smooth_.resize(static_cast<std::size_t>(count));
  if (ring) {
    const int period = count - 1, half = std::min(widest, period / 4);
    for (int n = 0; n < count; ++n) {
      Vec2f sum = Vec2f::Zero();
      for (int k = -half; k <= half; ++k) sum += at((n + k + period) % period);
      smooth_[static_cast<std::size_t>(n)] = sum / static_cast<float>(2 * half + 1);
    }
    return;
  }
  // Sums of small integers are exact in any order.
  Vec2f sum = at(0);
  int half = 0;
  smooth_[0] = sum;
  for (int n = 1; n < count; ++n) {
    const int next = std::min({widest, n, count - 1 - n});
    if (next > half) {
      sum += at(n + next) + at(n + next - 1);
    } else if (next == half) {
      sum += at(n + next) - at(n - 1 - half);
    } else {
      sum -= at(n - 1 - half) + at(n - half);
    }
    half = next;
    smooth_[static_cast<std::size_t>(n)] = sum / static_cast<float>(2 * half + 1);
  }
}

float LineGraph::Extension(const HeatField& field, std::uint32_t cell, bool at_front) const {
  const float radius = Radius(cell), most = kEndPart * radius + kEnd_m / cell_m_;
  const auto count = smooth_.size();
  const auto back = std::min(count - 1, static_cast<std::size_t>(std::lround(kDirection_m / cell_m_)));
  const Vec2f end = at_front ? smooth_.front() : smooth_.back();
  const Vec2f along = end - smooth_[at_front ? back : count - 1 - back];
  if (along.squaredNorm() < 1.0f) return radius;
  return std::max(March(field, end, along.normalized(), most), radius);
}

float LineGraph::LongestChord(const HeatField& field, std::uint32_t cell) const {
  const float most = 3.0f * Radius(cell) + 1.0f;
  float longest = 0;
  for (int n = 0; n < 8; ++n) {
    const float angle = 0.392699f * static_cast<float>(n);
    const Vec2f direction(std::cos(angle), std::sin(angle)), from = Centre(cells_[cell].at);
    longest = std::max(longest, March(field, from, direction, most) + March(field, from, -direction, most));
  }
  return longest;
}

float LineGraph::LengthOf(const HeatField& field, const Stretch& stretch) {
  const std::uint32_t front = trail_[stretch.begin], back = trail_[stretch.end - 1];
  const std::uint32_t middle = trail_[stretch.begin + (stretch.end - stretch.begin) / 2];
  if (nodes_[front].count == 0) {
    weights_[front] = 1.0f;
    return LongestChord(field, front);
  }
  Smooth(stretch);
  double line = 0;
  for (std::size_t n = 1; n < smooth_.size(); ++n) {
    const float step = (smooth_[n] - smooth_[n - 1]).norm();
    weights_[trail_[stretch.begin + n - 1]] += 0.5f * step;
    weights_[trail_[stretch.begin + n]] += 0.5f * step;
    line += static_cast<double>(step);
  }
  auto length = static_cast<float>(line);
  for (const bool at_front : {true, false}) {
    const std::uint32_t cell = at_front ? front : back;
    if (IsFree(cell)) length += Extension(field, cell, at_front);
  }
  const bool blob = IsFree(front) && IsFree(back) && line < static_cast<double>(2.0f * Radius(middle));
  return blob ? std::max(length, LongestChord(field, middle)) : length;
}

}  // namespace fulcrum::thermal
