// Path of the contact's centre with current on, in material space: points every 0.2 mm, each joined to its predecessor.
// A path over existing points adds none, so memory is bounded by the sheet's area.
#pragma once

#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "services/base/core/types.h"

namespace fulcrum::thermal {

inline constexpr float kPathSpacing_m = 2e-4f;  ///< Distance of consecutive points [m]: two cells.
/// Distances from the path saturate at this value [m].
inline constexpr float kPathReach_m = 2e-3f;
/// Maximum number of points, about 3 m of path; a longer path is not extended further.
inline constexpr std::size_t kPathCapacity = 1u << 14;

class ToolPath {
 public:
  /// Material coordinates (s, t) [m]; copied byte by byte into checkpoints.
  struct Point {
    float s = 0, t = 0;
    std::uint32_t previous = 0;  ///< Predecessor; the point's own index at the start of a path.
    [[nodiscard]] Vec2f at() const { return {s, t}; }
  };
  /// Current end of the path and the index of the last point before it.
  struct End {
    float s = 0, t = 0;
    std::uint32_t point = 0;
    [[nodiscard]] Vec2f at() const { return {s, t}; }
  };

  /// Adds a straight piece. It continues the last path if that ended at `from`, otherwise it starts a new one.
  void Add(const Vec2f& from, const Vec2f& to);
  /// Distance of a place from the nearest piece of the path, at most kPathReach_m [m].
  [[nodiscard]] float Distance(const Vec2f& at) const;
  /// The same from the piece that ends at point n.
  [[nodiscard]] float DistanceToPiece(const Vec2f& at, std::size_t n) const;

  [[nodiscard]] std::span<const Point> points() const { return points_; }
  [[nodiscard]] const End& end() const { return end_; }
  /// Restores a checkpoint. Returns false, and leaves an empty path, if no path can have had these values.
  [[nodiscard]] bool Restore(std::span<const Point> points, const End& end);
  void Clear();

 private:
  /// Returns the index of the point at this place, appending it if there is none.
  std::uint32_t Put(const Vec2f& at, std::uint32_t previous);
  void Enter(std::uint32_t n);

  std::vector<Point> points_;
  /// Points by square of a grid; see BucketOf.
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> buckets_;
  End end_;
};

}  // namespace fulcrum::thermal
