// The place of the deformed membrane nearest to a point, followed from step to step by descent over the grid.
//
//   place      argmin over the triangles of |p - sum_i b_i x_i|,   b_i >= 0,  sum_i b_i = 1
//   dead node  x = sum_l w_l (b_l x_a + a_l x_b) / (a_l + b_l) / sum_l w_l,   w_l = 1 / (a_l + b_l)
//
//   l          lines of the grid through the node: row, column and both diagonals
//   x_a, x_b   nearest living nodes to either side on a line, a_l and b_l steps away, both at most kLipReach
//
// Stencil of a step of the descent: the triangles of a cell and of the eight cells around it.
#pragma once

#include <array>

#include "physics_node/tissue/tissue_model.h"
#include "services/base/core/scene_view.h"

namespace fulcrum::physics {

/// A place on the membrane, cut or whole.
struct SheetPlace {
  Index triangle = kNoIndex;  ///< 2 * cell + half; kNoIndex: none.
  std::array<float, 3> barycentric{};
  Vec2f material = Vec2f::Zero();  ///< (s, t) [m].
  float distance_m = 0;            ///< Of the point from the triangle.
  [[nodiscard]] bool found() const { return triangle != kNoIndex; }
  [[nodiscard]] Index cell() const { return triangle / 2; }
};

/// Descent over the triangles of the grid, including those disabled by a cut: between the lips of a slit the sheet is
/// the straight line from lip to lip, so the material coordinates of a tool in its own slit are continuous. A dead node
/// is interpolated linearly between the lips.
class SheetWalk {
 public:
  SheetWalk(const TissueScene& scene, const TissueModel* model, const ParticleStore* particles)
      : scene_(scene), model_(model), particles_(particles) {}

  /// Descends from a cell to a local minimum of the distance, which may not be the global one.
  [[nodiscard]] SheetPlace Nearest(const Vec3f& p_W, Index start_cell) const;
  /// Distance of a point from the nearest living triangle within two cells of `cell`; infinite without one.
  [[nodiscard]] float DistanceToLiving(const Vec3f& p_W, Index cell) const;
  /// Intersection of segment ab with a triangle within one cell of `cell`; without one: not found().
  [[nodiscard]] SheetPlace Crossing(const Vec3f& a_W, const Vec3f& b_W, Index cell) const;
  /// The triangle around `material` within one cell of `cell`, or the nearest of these with the place clamped into it.
  [[nodiscard]] SheetPlace At(const Vec2f& material, Index cell) const;
  /// Position of a node in frame W. Of a dead node: interpolated between the living nodes on opposite sides of it, else
  /// the mean of its living neighbours, else its last position.
  [[nodiscard]] Vec3f NodePlace(Index node) const;

 private:
  template <class Visit>
  void ForTrianglesAround(Index cell, const Visit& visit) const;
  [[nodiscard]] Vec2f MaterialAt(const std::array<Index, 3>& nodes, const std::array<float, 3>& barycentric) const;

  TissueScene scene_;
  const TissueModel* model_;
  const ParticleStore* particles_;
};

}  // namespace fulcrum::physics
