#include "thermal_node/coupling/tool_path.h"

#include <algorithm>
#include <cmath>

namespace fulcrum::thermal {
namespace {

/// A new point nearer than this to an existing one is merged with it [m].
constexpr float kSame_m = 0.5f * kPathSpacing_m;
/// A piece that starts within this distance of the end of the path continues it; covers rounding on the bus [m].
constexpr float kJoint_m = 0.5f * kPathSpacing_m;
/// Longest piece: one spacing, plus half a spacing at each end that was merged with an existing point [m].
constexpr float kLongestJoin_m = 2.0f * kPathSpacing_m;

/// Largest plausible material coordinate, an order of magnitude above the largest sheet [m].
constexpr float kFarthest_m = 10.0f;

/// Index of the square that holds a coordinate. Squares are so large that a piece within kPathReach_m of a place ends
/// in one of the nine squares around it.
std::int32_t BucketOf(float x) { return static_cast<std::int32_t>(std::floor(x / (kPathReach_m + kLongestJoin_m))); }
std::uint64_t KeyOf(std::int32_t bx, std::int32_t by) {
  return static_cast<std::uint64_t>(static_cast<std::uint32_t>(bx)) << 32 | static_cast<std::uint32_t>(by);
}

/// Calls visit(index) for all points in the nine buckets around a place.
template <class Buckets, class Visit>
void ForNear(const Buckets& buckets, const Vec2f& at, const Visit& visit) {
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) {
      const auto bucket = buckets.find(KeyOf(BucketOf(at.x()) + dx, BucketOf(at.y()) + dy));
      if (bucket == buckets.end()) continue;
      for (const std::uint32_t n : bucket->second) visit(n);
    }
  }
}

}  // namespace

void ToolPath::Add(const Vec2f& from, const Vec2f& to) {
  if (points_.empty() || (from - end_.at()).norm() > kJoint_m) {
    const auto own = static_cast<std::uint32_t>(points_.size());
    end_.point = Put(from, own);
  }
  end_.s = to.x();
  end_.t = to.y();
  if (points_.empty()) return;
  for (;;) {
    const Vec2f last = points_[end_.point].at(), left = to - last;
    const float length = left.norm();
    if (length < kPathSpacing_m || points_.size() >= kPathCapacity) return;
    const std::uint32_t before = end_.point;
    end_.point = Put(last + left * (kPathSpacing_m / length), before);
    // Each step reduces the rest by at least half a spacing, even if its point was merged with an existing one. It
    // makes less progress only when the capacity is exhausted.
    if ((to - points_[end_.point].at()).norm() > length - 0.25f * kPathSpacing_m) return;
  }
}

std::uint32_t ToolPath::Put(const Vec2f& at, std::uint32_t previous) {
  std::uint32_t same = UINT32_MAX;
  ForNear(buckets_, at, [&](std::uint32_t n) {
    if ((points_[n].at() - at).norm() < kSame_m) same = std::min(same, n);
  });
  if (same != UINT32_MAX) return same;
  if (points_.size() >= kPathCapacity) return previous;
  points_.push_back({at.x(), at.y(), previous});
  Enter(static_cast<std::uint32_t>(points_.size()) - 1);
  return static_cast<std::uint32_t>(points_.size()) - 1;
}

void ToolPath::Enter(std::uint32_t n) { buckets_[KeyOf(BucketOf(points_[n].s), BucketOf(points_[n].t))].push_back(n); }

float ToolPath::DistanceToPiece(const Vec2f& at, std::size_t n) const {
  const Vec2f b = points_[n].at(), a = points_[points_[n].previous].at(), segment = b - a;
  const float length2 = segment.squaredNorm();
  const float part = length2 > 0.0f ? std::clamp((at - a).dot(segment) / length2, 0.0f, 1.0f) : 0.0f;
  return std::min((at - (a + part * segment)).norm(), kPathReach_m);
}

float ToolPath::Distance(const Vec2f& at) const {
  float nearest = kPathReach_m;
  ForNear(buckets_, at, [&](std::uint32_t n) { nearest = std::min(nearest, DistanceToPiece(at, n)); });
  return nearest;
}

bool ToolPath::Restore(std::span<const Point> points, const End& end) {
  Clear();
  const auto plausible = [&](std::size_t n) {
    const Point& p = points[n];
    return p.at().cwiseAbs().maxCoeff() <= kFarthest_m && p.previous <= n &&
           (points[p.previous].at() - p.at()).norm() <= kLongestJoin_m;
  };
  bool good = points.size() <= kPathCapacity && end.at().allFinite() && (points.empty() || end.point < points.size());
  for (std::size_t n = 0; good && n < points.size(); ++n) good = plausible(n);
  if (!good) return false;
  points_.assign(points.begin(), points.end());
  for (std::uint32_t n = 0; n < points_.size(); ++n) Enter(n);
  end_ = end;
  return true;
}

void ToolPath::Clear() {
  points_.clear();
  buckets_.clear();
  end_ = {};
}

}  // namespace fulcrum::thermal
