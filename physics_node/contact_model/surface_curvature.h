// Principal curvatures of the surface at a contact: a quadric through the vertices around it by least squares,
//
//   z = c + b_u u + b_v v + (c_uu u^2 + 2 c_uv u v + c_vv v^2) / 2     over the tangent plane (u, v),
//
// weighted by (1 - d^2 / r^2)^2, so that it changes smoothly as vertices come and go; the curvatures are the
// eigenvalues of the quadric's shape operator, positive where the surface is convex. Plain sums in fixed order: the
// same bits everywhere.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "physics_node/collision/tool_collision.h"

namespace fulcrum::physics {

struct PrincipalCurvatures {
  Vec3f n = Vec3f::UnitZ();      ///< Unit outward normal.
  Vec3f e1 = Vec3f::UnitX();     ///< Unit tangent: the direction of kappa1.
  float kappa1 = 0, kappa2 = 0;  ///< The one of larger size first; both 0 where the fit says nothing [1/m].
};

/// No curvature is larger: that of a ball of half a millimetre [1/m].
inline constexpr float kMaxCurvature = 2000.0f;

/// Curvatures at the origin of a surface through about `points`, those within `radius` of the origin [m].
/// @param normal about the unit outward normal there.
[[nodiscard]] PrincipalCurvatures FitCurvatures(std::span<const Vec3f> points, float radius, const Vec3f& normal);

/// The same of the surface that the centre of a ball of radius `ball` sees while it rolls over it [m]; positive
/// outside.
[[nodiscard]] PrincipalCurvatures RolledOver(PrincipalCurvatures surface, float ball);

/// Of membrane and organ alike.
class SurfaceCurvature {
 public:
  SurfaceCurvature(const SceneView& scene, const TissueModel* model, const ParticleStore* particles);

  /// Curvatures at a point of the surface, of the present shape or of the shape at rest, turned so that its normal is
  /// `n` (unit, outward as the tool is). What a cut has parted does not count. None where `n` is no normal of the
  /// surface, as at a rim. Allocates nothing.
  [[nodiscard]] PrincipalCurvatures At(const SurfacePoint& at, bool at_rest, const Vec3f& n);

 private:
  static constexpr std::size_t kMostVertices = 320;

  [[nodiscard]] Vec3f Place(Index particle, bool at_rest) const;
  void Visit(Index particle);
  void VisitNeighbours(Index particle);

  SceneView scene_;
  const TissueModel* model_;
  const ParticleStore* particles_;
  std::vector<Index> first_neighbour_, neighbours_;  ///< Of the organ's vertices along its surface: compressed rows.
  std::vector<std::uint32_t> visited_;               ///< By particle: the search that saw it last.
  std::uint32_t search_ = 0;
  std::vector<Index> found_;
  std::vector<Vec3f> points_;
};

}  // namespace fulcrum::physics
