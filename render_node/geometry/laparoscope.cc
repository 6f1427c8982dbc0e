#include "render_node/geometry/laparoscope.h"

#include <algorithm>
#include <cmath>

#include "services/base/core/scope.h"

namespace fulcrum::render {
namespace {

constexpr float kNear = 0.004f;  // [m]
constexpr float kFar = 0.8f;     // [m]
// A 10 mm scope: fibres in a crescent, 4 mm from the lens.
constexpr float kFibreOffset = 0.004f;  // [m]
// Share of the optics' angle that remains between light and line of sight, because the slanted glass refracts the beam.
constexpr float kBeamTilt = 0.25f;
// Radius of the circle relative to the picture's height: it is cut by the edges, as with a zoomed camera head.
constexpr float kCircle = 0.70f;

// The widest picture that a scene can ask for; a wider one might exceed the largest texture.
constexpr int kWidest = 7680;  // [pixels]

}  // namespace

Laparoscope MakeLaparoscope(const RenderParams& params) {
  Laparoscope scope;
  const Vec3f sight = params.scope_target_W - params.scope_tip_W;
  const Vec3f back = -sight.normalized();
  const Vec3f up_hint = LevelUp(back);
  // The picture turns clockwise when the camera turns the other way.
  const Vec3f right = Eigen::AngleAxisf(RadiansOf(params.roll_deg), back) * up_hint.cross(back).normalized();
  const Vec3f up = back.cross(right);
  scope.view.setIdentity();
  scope.view.block<1, 3>(0, 0) = right.transpose();
  scope.view.block<1, 3>(1, 0) = up.transpose();
  scope.view.block<1, 3>(2, 0) = back.transpose();
  scope.view.block<3, 1>(0, 3) = -scope.view.block<3, 3>(0, 0) * params.scope_tip_W;

  const auto width = static_cast<float>(params.width), height = static_cast<float>(params.height);
  const float focal = 1 / std::tan(RadiansOf(params.fov_deg) / 2);
  scope.projection.setZero();
  scope.projection(0, 0) = focal * height / width;
  scope.projection(1, 1) = focal;
  scope.projection(2, 2) = (kFar + kNear) / (kNear - kFar);
  scope.projection(2, 3) = 2 * kFar * kNear / (kNear - kFar);
  scope.projection(3, 2) = -1;

  const float tilt = kBeamTilt * RadiansOf(params.scope_angle_deg);
  scope.light_position = Vec3f(0.6f * kFibreOffset, kFibreOffset, 0);
  scope.light_axis = Vec3f(0, -std::sin(tilt), -std::cos(tilt));
  scope.wall_direction = (scope.view.block<3, 3>(0, 0) * Vec3f(0.15f, 0.25f, 1.0f)).normalized();
  scope.light_power = sight.squaredNorm();
  scope.picture_centre = Vec2f(width / 2, height / 2);
  scope.circle_radius = kCircle * height;
  return scope;
}

Vec3f EyeOf(const Laparoscope& scope) {
  return -scope.view.block<3, 3>(0, 0).transpose() * scope.view.block<3, 1>(0, 3);
}

RenderParams BesideOf(const RenderParams& camera, float by_m) {
  const Vec3f right = MakeLaparoscope(camera).view.block<1, 3>(0, 0).transpose();
  RenderParams moved = camera;
  moved.scope_tip_W += by_m * right;
  moved.scope_target_W += by_m * right;
  return moved;
}

std::vector<Laparoscope> MakeEyes(const RenderParams& camera, const StereoParams& stereo) {
  if (stereo.layout == StereoLayout::kNone) return {MakeLaparoscope(camera)};
  const float convergence_m =
      stereo.convergence_m > 0 ? stereo.convergence_m : (camera.scope_target_W - camera.scope_tip_W).norm();
  std::vector<Laparoscope> eyes;
  for (const float by_m : {-0.5f * stereo.interocular_m, 0.5f * stereo.interocular_m}) {
    Laparoscope& eye = eyes.emplace_back(MakeLaparoscope(BesideOf(camera, by_m)));
    // x of the clip coordinates plus by_m * focal at the convergence distance, in proportion to the depth -z.
    eye.projection(0, 2) = -eye.projection(0, 0) * by_m / convergence_m;
    eye.light_position.x() -= by_m;
  }
  return eyes;
}

PixelBox FitPicture(const RenderParams& params, int window_width, int window_height) {
  const double aspect = static_cast<double>(params.width) / static_cast<double>(params.height);
  const double most = std::min(window_width, kWidest);
  const double width = std::min(most, std::min(window_height, kWidest) * aspect);
  PixelBox box{0, 0, std::max(1, static_cast<int>(std::lround(width))),
               std::max(1, static_cast<int>(std::lround(width / aspect)))};
  box.x = (window_width - box.width) / 2;
  box.y = (window_height - box.height) / 2;
  return box;
}

}  // namespace fulcrum::render
