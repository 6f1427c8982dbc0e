// Surfaces that follow the simulated particles: barycentric mapping, smooth normals, nearest points. Pure.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "services/base/core/scene_view.h"

namespace fulcrum::render {

/// Particle `i` of an interleaved x y z array [m].
inline Vec3f PositionOf(std::span<const float> xyz, Index i) {
  return {xyz[3 * std::size_t{i}], xyz[3 * std::size_t{i} + 1], xyz[3 * std::size_t{i} + 2]};
}

/// out[k] = sum_j barycentric[k][j] * x[tets[tetrahedron[k]][j]] [m]: a high-resolution surface carried by a coarse
/// tetrahedral mesh. `out` has one entry per embedded vertex.
void MapEmbedded(std::span<const Tetrahedron> tets, std::span<const EmbeddedVertex> embedded,
                 std::span<const float> xyz, std::span<Vec3f> out);

/// Unit vertex normals, triangles weighted by area; zero for a vertex without a triangle.
void ComputeNormals(std::span<const Vec3f> positions, std::span<const Triangle> triangles, std::span<Vec3f> normals);

/// A point on a triangle of the tube's surface, by its particles.
struct SurfacePoint {
  Triangle triangle;
  std::array<float, 3> barycentric;
  Index number = kNoIndex;  ///< Of the triangle, among those that were searched.
  [[nodiscard]] Vec3f At(std::span<const float> xyz) const {
    return barycentric[0] * PositionOf(xyz, triangle[0]) + barycentric[1] * PositionOf(xyz, triangle[1]) +
           barycentric[2] * PositionOf(xyz, triangle[2]);
  }
};

/// Nearest point of a set of triangles, by a uniform grid over the triangles' centres.
class NearestOnSurface {
 public:
  /// Keeps references: positions and triangles must outlive it.
  NearestOnSurface(std::span<const Vec3f> positions, std::span<const Triangle> triangles);
  /// Nearest point on the triangles whose centres lie in the 3x3x3 cells around the nearest occupied cell: exact for
  /// points close to the surface, otherwise with an error of up to a cell. @pre at least one triangle.
  [[nodiscard]] SurfacePoint Find(const Vec3f& point) const;

 private:
  [[nodiscard]] std::array<int, 3> CellOf(const Vec3f& point) const;
  [[nodiscard]] std::size_t CellIndex(int x, int y, int z) const;

  std::span<const Vec3f> positions_;
  std::span<const Triangle> triangles_;
  Vec3f origin_ = Vec3f::Zero();
  float cell_ = 1;
  std::array<int, 3> size_{1, 1, 1};
  std::vector<Index> start_;  // Triangles of cell c are order_[start_[c] .. start_[c + 1]).
  std::vector<Index> order_;
  struct Ball {
    Vec3f centre;
    float radius;
  };
  std::vector<Ball> balls_;  // Round each triangle, in the order of order_.
};

/// Barycentric coordinates of the point of triangle (a, b, c) nearest to p (Ericson, Real-Time Collision Detection,
/// section 5.1.5).
[[nodiscard]] std::array<float, 3> NearestBarycentric(const Vec3f& p, const Vec3f& a, const Vec3f& b, const Vec3f& c);

}  // namespace fulcrum::render
