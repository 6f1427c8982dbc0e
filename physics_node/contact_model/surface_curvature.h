// Principal curvatures of the surface at a contact: a quadric through the vertices around it by least squares,
//
//   z = c + b_u u + b_v v + (c_uu u^2 + 2 c_uv u v + c_vv v^2) / 2     over the tangent plane (u, v),
//
// with the weights (1 - d^2 / r^2)^2, so that it changes continuously when vertices enter or leave the radius r. The
// curvatures are the eigenvalues of its shape operator, positive where the surface is convex:
//
//   S = -1 / sqrt(1 + b_u^2 + b_v^2) (c_uu, c_uv; c_uv, c_vv),   kappa = mean +- sqrt(half^2 + S_uv^2)
//   mean = (S_uu + S_vv) / 2,   half = (S_uu - S_vv) / 2
//
//   z, u, v, d, r, c  [m]      b  slopes      c_uu, c_uv, c_vv, S, kappa  [1/m]
//
// Sums are taken in a fixed order: the same bits on any number of threads.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "physics_node/collision/tool_collision.h"

namespace fulcrum::physics {

struct PrincipalCurvatures {
  Vec3f n = Vec3f::UnitZ();      ///< Unit outward normal.
  Vec3f e1 = Vec3f::UnitX();     ///< Unit tangent: the direction of kappa1.
  float kappa1 = 0, kappa2 = 0;  ///< That of larger magnitude first; both 0 where the fit is ill-conditioned [1/m].
};

/// Largest curvature [1/m]: that of a ball of half a millimetre radius.
inline constexpr float kMaxCurvature = 2000.0f;

/// Curvatures at the origin of the surface fitted to the `points` within `radius` of the origin [m].
/// @param normal approximate unit outward normal there.
[[nodiscard]] PrincipalCurvatures FitCurvatures(std::span<const Vec3f> points, float radius, const Vec3f& normal);

/// Curvatures of the offset surface on which the centre of a ball of radius `ball` [m] rolls: kappa / (1 + kappa ball).
/// Positive radius: outside.
[[nodiscard]] PrincipalCurvatures RolledOver(PrincipalCurvatures surface, float ball);

/// Curvatures of membrane and organ.
class SurfaceCurvature {
 public:
  SurfaceCurvature(const TissueScene& scene, const TissueModel* model, const ParticleStore* particles);

  /// Curvatures at a point of the surface, of the present shape or of the shape at rest, rotated so that its normal is
  /// `n` (unit, towards the tool). The fit does not extend across cuts. None where `n` is no normal of the surface, as
  /// at a rim. Allocates nothing.
  [[nodiscard]] PrincipalCurvatures At(const SurfacePoint& at, bool at_rest, const Vec3f& n);

 private:
  /// Most vertices of a fit; bounds its cost. Assumed.
  static constexpr std::size_t kMaxVertices = 320;

  [[nodiscard]] Vec3f Place(Index particle, bool at_rest) const;
  void Visit(Index particle);
  void VisitNeighbours(Index particle);

  TissueScene scene_;
  const TissueModel* model_;
  const ParticleStore* particles_;
  std::vector<Index> first_neighbour_, neighbours_;  ///< Of the organ's vertices along its surface: compressed rows.
  std::vector<std::uint32_t> visited_;               ///< By particle: the last search that reached it.
  std::uint32_t search_ = 0;
  std::vector<Index> found_;
  std::vector<Vec3f> points_;
};

}  // namespace fulcrum::physics
