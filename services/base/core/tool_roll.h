// The roll of a tool about its shaft: where its x axis points without roll, and how far it is turned from there.
#pragma once

#include <cmath>
#include <numbers>

#include "services/base/core/messages.h"
#include "services/base/core/scene_view.h"

namespace fulcrum {

/// Middle of the tissue at rest, frame W [m]; the origin of W for a scene without any.
[[nodiscard]] inline Vec3f FieldCentre(const SceneView& scene) {
  Vec3f sum = Vec3f::Zero();
  for (const Vec3f& place : scene.rest_position) sum += place;
  return scene.rest_position.empty() ? sum : Vec3f(sum / static_cast<float>(scene.rest_position.size()));
}

/// Unit vector, frame W, that decides where the x axis of a tool points without roll: world X, or Y where the direction
/// from trocar to tissue is within 18 degrees of X. The roll of a tool is arbitrary, but it must not jump during a
/// motion or at a restart. For a scope `level_up`, of the scene's line of sight.
[[nodiscard]] inline Vec3d RollReference(const ToolDescription& tool, const Vec3f& field_centre,
                                         const Vec3f& level_up) {
  constexpr float kNearlyAlong = 0.95f;
  if (tool.kind == ToolKind::kScope) return level_up.cast<double>();
  return std::abs((field_centre - tool.p_WP).normalized().x()) > kNearlyAlong ? Vec3d::UnitY() : Vec3d::UnitX();
}

/// Orientation of the tool frame without roll: z along the shaft, x the projection of `x_reference` on the plane normal
/// to it. @pre x_reference is a unit vector; for a shaft parallel to it x is arbitrary.
[[nodiscard]] inline Eigen::Quaterniond ToolOrientation(const Vec3d& d_W, const Vec3d& x_reference) noexcept {
  Vec3d x = x_reference - x_reference.dot(d_W) * d_W;
  const double norm = x.norm();
  x = norm > 0.0 ? Vec3d(x / norm) : d_W.unitOrthogonal();
  Eigen::Matrix3d R;
  R << x, d_W.cross(x), d_W;
  return Eigen::Quaterniond(R);
}

/// The same for a kind of tool and its RollReference: a scope's x axis shows to the right in the picture, so that the
/// picture is level without roll.
[[nodiscard]] inline Eigen::Quaterniond LevelOrientation(ToolKind kind, const Vec3d& d_W,
                                                         const Vec3d& reference) noexcept {
  return ToolOrientation(d_W, kind == ToolKind::kScope ? Vec3d(d_W.cross(reference).normalized()) : reference);
}

/// Roll of a tool [rad], -pi to pi, clockwise as seen from the handle. @param reference its RollReference.
[[nodiscard]] inline float ToolRoll(ToolKind kind, const Quatf& q_WT, const Vec3d& reference) {
  const Eigen::Quaterniond q = q_WT.cast<double>().normalized();
  const Eigen::Quaterniond turn = LevelOrientation(kind, q * Vec3d::UnitZ(), reference).conjugate() * q;
  return static_cast<float>(std::remainder(2 * std::atan2(turn.z(), turn.w()), 2 * std::numbers::pi));
}

}  // namespace fulcrum
