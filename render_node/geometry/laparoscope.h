// The laparoscope as a camera: view and projection, its light, its round field. Pure.
#pragma once

#include <vector>

#include "services/base/core/scene_view.h"

namespace fulcrum::render {

struct Laparoscope {
  Eigen::Matrix4f view;        ///< Frame W to camera (x right, y up, looking along -z).
  Eigen::Matrix4f projection;  ///< OpenGL clip coordinates.
  Vec3f light_position;        ///< Position of the light fibres beside the lens, camera frame [m].
  Vec3f light_axis;            ///< Camera frame, unit.
  Vec3f wall_direction;        ///< Camera frame, unit: towards the lit wall above the field.
  float light_power;           ///< Power for an irradiance of 1 at the target.
  Vec2f picture_centre;        ///< [pixels]
  float circle_radius;         ///< Of the round picture [pixels].
};

/// The line of sight goes from scope_tip_W to scope_target_W. With 30 degree optics the shaft lies 30 degrees above it
/// and the light's axis between the two; with 0 degrees shaft, light and line of sight coincide. fov_deg is the angle
/// over the height.
[[nodiscard]] Laparoscope MakeLaparoscope(const RenderParams& params);

/// Place of the lens, frame W [m].
[[nodiscard]] Vec3f EyeOf(const Laparoscope& scope);

/// The camera beside `camera`, `by_m` to the right in its picture [m], with a parallel line of sight.
[[nodiscard]] RenderParams BesideOf(const RenderParams& camera, float by_m);

/// The cameras of the picture: MakeLaparoscope(camera), or with stereo the left and the right eye of that scope. Their
/// lines of sight are parallel and their frusta asymmetric, so that a point at the convergence distance has the same
/// place in both pictures; a point at depth d [m] has the disparity (left minus right)
///   interocular * focal * (1 / d - 1 / convergence) [pixels], focal = height / (2 tan(fov / 2)).
/// Both have the scope's one light, because its fibres do not move with the eye.
[[nodiscard]] std::vector<Laparoscope> MakeEyes(const RenderParams& camera, const StereoParams& stereo);

/// A rectangle of a window [pixels]; (x, y) is its lower left corner.
struct PixelBox {
  int x = 0, y = 0, width = 0, height = 0;
  bool operator==(const PixelBox&) const = default;
};

/// The largest box with the scene's aspect in the middle of a window: the picture keeps its shape, bars remain beside
/// it. At least one pixel wide and high, at most as large as the picture of a scene may be.
[[nodiscard]] PixelBox FitPicture(const RenderParams& params, int window_width, int window_height);

}  // namespace fulcrum::render
