// Small geometric functions shared by the stages of the scene build. Double precision, metres.
#pragma once

#include <array>
#include <vector>

#include "services/base/core/types.h"

namespace fulcrum::scene {

/// Positive when (b-a)x(c-a).(d-a) > 0 [m^3].
double SignedVolume(const Vec3d& a, const Vec3d& b, const Vec3d& c, const Vec3d& d);

/// Point of the smooth curve through p1 and p2 at fraction f between them; p0 and p3 are the points before and after
/// (Catmull and Rom 1974).
template <class Point>
Point CatmullRom(const Point& p0, const Point& p1, const Point& p2, const Point& p3, typename Point::Scalar f) {
  constexpr auto kHalf = static_cast<typename Point::Scalar>(0.5);
  return kHalf *
         (2 * p1 + f * (p2 - p0) + f * f * (2 * p0 - 5 * p1 + 4 * p2 - p3) + f * f * f * (3 * p1 - p0 - 3 * p2 + p3));
}

/// The six angles between a tetrahedron's faces; 70.5 degrees each in a regular one.
struct DihedralRange {
  double least_deg, largest_deg;
};
DihedralRange DihedralAngles(const std::array<Vec3d, 4>& corners);

struct ClosestPoint {
  std::array<double, 3> barycentric;
  Vec3d point;
  double distance;
};
/// Closest point of triangle abc to p (Ericson, Real-Time Collision Detection, 5.1.5).
ClosestPoint ClosestOnTriangle(const Vec3d& p, const Vec3d& a, const Vec3d& b, const Vec3d& c);

/// Signed dihedral angle of a BendingConstraint [rad]: see its definition in scene_view.h.
double DihedralAngle(const Vec3d& x0, const Vec3d& x1, const Vec3d& x2, const Vec3d& x3);

/// `rows` x `cols` points, row by row, as a triangulated grid; the normal is (column direction) x (row direction).
std::vector<Triangle> GridTriangles(int rows, int cols);

/// Triangles that belong to one tetrahedron only, seen counter-clockwise from outside.
std::vector<Triangle> BoundaryOf(const std::vector<Tetrahedron>& tets);

/// Each edge once, smaller index first, in ascending order.
std::vector<std::array<Index, 2>> EdgesOf(const std::vector<Tetrahedron>& tets);

/// Closest triangle by a uniform grid; built once for many queries.
class TriangleLocator {
 public:
  TriangleLocator(const std::vector<Vec3d>& vertices, const std::vector<Triangle>& triangles);

  struct Hit {
    Index triangle = kNoIndex;
    ClosestPoint closest{{0, 0, 0}, Vec3d::Zero(), 0};
  };
  /// Closest point within `reach`; triangle == kNoIndex when there is none. Ties go to the lower triangle index.
  [[nodiscard]] Hit Closest(const Vec3d& p, double reach) const;

 private:
  [[nodiscard]] std::array<int, 3> CellOf(const Vec3d& p) const;
  [[nodiscard]] std::size_t Flat(int x, int y, int z) const;

  const std::vector<Vec3d>& vertices_;
  const std::vector<Triangle>& triangles_;
  Vec3d low_ = Vec3d::Zero();
  double cell_ = 1;
  std::array<int, 3> size_{1, 1, 1};
  std::vector<std::vector<Index>> cells_;
};

/// Position of each point in a tetrahedral mesh: the tetrahedron that contains it or, outside the mesh, the one that
/// needs the least extrapolation (its most negative coordinate is the largest).
struct Embedding {
  Index tetrahedron;
  std::array<double, 4> barycentric;
};
std::vector<Embedding> EmbedPoints(const std::vector<Vec3d>& vertices, const std::vector<Tetrahedron>& tets,
                                   const std::vector<Vec3d>& points);

}  // namespace fulcrum::scene
