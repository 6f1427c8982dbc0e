// The laparoscope as a held instrument (ToolKind::kScope): what it shows, from the pose of its tip. Frame T of a scope:
// z along the shaft, x to the right in the picture. With angled optics the line of sight lies below the shaft in the
// picture, so that a turn about the shaft turns horizon and direction of view together: the camera head is fixed to it.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

#include "services/base/core/scene_view.h"

namespace fulcrum {

/// The angle that a scope's handle reports is that of the zoom ring of its camera head: 0 wide, 60 degrees twice as
/// large.
inline constexpr float kZoomRing_rad = std::numbers::pi_v<float> / 3;
inline constexpr float kLargestZoom = 2;
[[nodiscard]] inline float ZoomAt(float ring_rad) {
  return 1 + (kLargestZoom - 1) * std::clamp(ring_rad / kZoomRing_rad, 0.0f, 1.0f);
}

[[nodiscard]] constexpr float RadiansOf(float degrees) { return degrees * std::numbers::pi_v<float> / 180; }

/// A line of sight, frame W, unit vectors.
struct Sight {
  Vec3f right = Vec3f::UnitX(), up = Vec3f::UnitZ(), forward = Vec3f::UnitY();
};

/// "Up" of a level picture: z of W, or cranial (+y) for a nearly vertical line of sight.
[[nodiscard]] inline Vec3f LevelUp(const Vec3f& forward) {
  constexpr float kNearlyVertical = 0.9f;
  return std::abs(forward.z()) > kNearlyVertical ? Vec3f::UnitY() : Vec3f::UnitZ();
}

/// Line of sight of a scope held at the orientation q_WT. @param optics_deg angle between shaft and line of sight.
[[nodiscard]] inline Sight SightOf(const Quatf& q_WT, float optics_deg) {
  const Mat3f turn = q_WT.normalized().toRotationMatrix();
  const float angle = RadiansOf(optics_deg);
  Sight sight;
  sight.right = turn.col(0);
  sight.forward = std::cos(angle) * turn.col(2) + std::sin(angle) * turn.col(1);
  sight.up = sight.right.cross(sight.forward);
  return sight;
}

/// Rotation of the picture from level [rad], positive clockwise: the camera has turned the other way.
/// @param up of the level picture.
[[nodiscard]] inline float RollOf(const Sight& sight, const Vec3f& up) {
  const Vec3f back = -sight.forward;
  const Vec3f level = up.cross(back).normalized();
  return std::atan2(back.dot(level.cross(sight.right)), level.dot(sight.right));
}

/// "Up" of the level picture of a scene, whatever its scope does.
[[nodiscard]] inline Vec3f LevelUp(const RenderParams& render) {
  return LevelUp(Vec3f((render.scope_target_W - render.scope_tip_W).normalized()));
}

/// Direction of the shaft of a level scope that shows what `render` describes.
[[nodiscard]] inline Vec3f ShaftOf(const RenderParams& render) {
  const Vec3f forward = (render.scope_target_W - render.scope_tip_W).normalized();
  const Vec3f up = forward.cross(LevelUp(forward)).cross(forward).normalized();
  const float angle = RadiansOf(render.scope_angle_deg);
  return std::cos(angle) * forward + std::sin(angle) * up;
}

/// Tip of a level scope in a trocar at p_WP from which the middle of its picture is x_W, at this distance.
[[nodiscard]] inline Vec3f TipLookingAt(const Vec3f& x_W, float distance_m, const Vec3f& p_WP,
                                        const RenderParams& render) {
  constexpr int kRounds = 40;  // The angle between shaft and line of sight is constant: each halves the error at least.
  const float angle = RadiansOf(render.scope_angle_deg);
  const Vec3f up = LevelUp(render);
  Vec3f forward = (x_W - p_WP).normalized();
  for (int i = 0; i < kRounds; ++i) {
    const Vec3f shaft = (x_W - distance_m * forward - p_WP).normalized();
    const Vec3f right = shaft.cross(up).normalized(), down = shaft.cross(right);
    forward = (std::cos(angle) * shaft + std::sin(angle) * down).normalized();
  }
  return x_W - distance_m * forward;
}

}  // namespace fulcrum
