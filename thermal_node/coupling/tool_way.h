// Where the contact's centre went with current on, in material space: points every 0.2 mm, each joined to the one
// before it. A way over old points adds none, so memory is bounded by the sheet's area.
#pragma once

#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "services/base/core/types.h"

namespace fulcrum::thermal {

inline constexpr float kWaySpacing_m = 2e-4f;
/// Farther from the way than this is as far as this [m].
inline constexpr float kWayReach_m = 2e-3f;
/// Points that are kept, 3 m of way; what comes later is left out.
inline constexpr std::size_t kWayCapacity = 1u << 14;

class ToolWay {
 public:
  /// Material coordinates (s, t) [m]; copied byte by byte into checkpoints.
  struct Point {
    float s = 0, t = 0;
    std::uint32_t previous = 0;  ///< Its own index where a way begins.
    [[nodiscard]] Vec2f at() const { return {s, t}; }
  };
  /// Where the way has arrived, and its last point.
  struct End {
    float s = 0, t = 0;
    std::uint32_t point = 0;
    [[nodiscard]] Vec2f at() const { return {s, t}; }
  };

  /// Straight from `from` to `to`. Joined to the last way where that ended at `from`.
  void Add(const Vec2f& from, const Vec2f& to);
  /// From the nearest piece of the way, at most kWayReach_m.
  [[nodiscard]] float Distance(const Vec2f& at) const;
  /// The same from point n and the piece that leads to it.
  [[nodiscard]] float DistanceToPiece(const Vec2f& at, std::size_t n) const;

  [[nodiscard]] std::span<const Point> points() const { return points_; }
  [[nodiscard]] const End& end() const { return end_; }
  /// False, and an empty way, when these cannot have come from a way.
  [[nodiscard]] bool Restore(std::span<const Point> points, const End& end);
  void Clear();

 private:
  /// Appends a point, or finds the one that is there; its index.
  std::uint32_t Put(const Vec2f& at, std::uint32_t previous);
  void Enter(std::uint32_t n);

  std::vector<Point> points_;
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> buckets_;  ///< By square; see BucketOf.
  End end_;
};

}  // namespace fulcrum::thermal
