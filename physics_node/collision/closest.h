// Closest points between the axis of a capsule and a triangle.
#pragma once

#include <algorithm>
#include <array>

#include "services/base/core/types.h"

namespace fulcrum::physics {

struct ClosestPoints {
  float distance_sq = 0;
  float t = 0;                         ///< On the segment, 0 at its first end.
  std::array<float, 3> barycentric{};  ///< On the triangle.
  Vec3f on_segment = Vec3f::Zero();
  Vec3f on_triangle = Vec3f::Zero();
  bool crosses = false;  ///< The segment passes through the triangle: distance 0.
};

/// Barycentric coordinates of the point of triangle abc closest to p (Ericson, Real-Time Collision Detection, 5.1.5).
[[nodiscard]] std::array<float, 3> ClosestOnTriangle(const Vec3f& p, const Vec3f& a, const Vec3f& b, const Vec3f& c);

/// Parameter in [0, 1] of the point of segment ab closest to p.
[[nodiscard]] inline float ClosestOnSegment(const Vec3f& p, const Vec3f& a, const Vec3f& b) {
  const Vec3f ab = b - a;
  const float length_sq = ab.squaredNorm();
  return length_sq > 0.0f ? std::clamp((p - a).dot(ab) / length_sq, 0.0f, 1.0f) : 0.0f;
}

/// Squared distance of p from segment ab.
[[nodiscard]] inline float DistanceSqToSegment(const Vec3f& p, const Vec3f& a, const Vec3f& b) {
  return (a + ClosestOnSegment(p, a, b) * (b - a) - p).squaredNorm();
}

/// Closest points of segment p0-p1 and triangle abc. Degenerate segments and triangles are allowed.
[[nodiscard]] ClosestPoints ClosestSegmentTriangle(const Vec3f& p0, const Vec3f& p1, const Vec3f& a, const Vec3f& b,
                                                   const Vec3f& c);

}  // namespace fulcrum::physics
