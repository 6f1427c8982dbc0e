// The nearest place of the deformed membrane to a point, followed from step to step.
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

/// Walks over the grid's triangles, those that a cut has switched off included: the sheet between the lips of a slit is
/// then the straight line from lip to lip, so a tool that stands in its own slit has a place in material coordinates
/// that moves on continuously. A node that is dead lies at its share of the way from
/// lip to lip.
class SheetWalk {
 public:
  SheetWalk(const SceneView& scene, const TissueModel* model, const ParticleStore* particles)
      : scene_(scene), model_(model), particles_(particles) {}

  /// Descends from a cell to the nearest place around it: a local minimum of the distance, not the global one.
  [[nodiscard]] SheetPlace Nearest(const Vec3f& p_W, Index start_cell) const;
  /// Distance of a point from the nearest living triangle within two cells of `cell`; infinity: there is none.
  [[nodiscard]] float DistanceToLiving(const Vec3f& p_W, Index cell) const;
  /// Where segment ab goes through one of the triangles within one cell of `cell`; none: not found().
  [[nodiscard]] SheetPlace Crossing(const Vec3f& a_W, const Vec3f& b_W, Index cell) const;
  /// The triangle around `material` within one cell of `cell`, or the nearest of these with the place clamped into it.
  [[nodiscard]] SheetPlace At(const Vec2f& material, Index cell) const;
  /// World place of a node; of a dead one its share of the way between the living ones on opposite sides of it, else
  /// the mean of its living neighbours, if it has any.
  [[nodiscard]] Vec3f NodePlace(Index node) const;

 private:
  template <class Visit>
  void ForTrianglesAround(Index cell, const Visit& visit) const;
  [[nodiscard]] Vec2f MaterialAt(const std::array<Index, 3>& nodes, const std::array<float, 3>& barycentric) const;

  SceneView scene_;
  const TissueModel* model_;
  const ParticleStore* particles_;
};

}  // namespace fulcrum::physics
