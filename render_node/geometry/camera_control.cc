#include "render_node/geometry/camera_control.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "render_node/geometry/laparoscope.h"

namespace fulcrum::render {
namespace {

constexpr float kTurn = 3 * std::numbers::pi_v<float> / 180;
constexpr float kStep = 0.95f;
constexpr float kRoll_deg = 5;
constexpr float kNearest_m = 0.02f, kFarthest_m = 0.3f;
constexpr float kSteepest = 0.97f;  // Limit of the cosine to the vertical, where the horizon is undefined.

Vec3f ForwardOf(const RenderParams& camera) { return (camera.scope_target_W - camera.scope_tip_W).normalized(); }

}  // namespace

float CarriedRoll_deg(const RenderParams& before, const RenderParams& moved, const Quatf& turn) {
  const Vec3f forward = ForwardOf(moved), up = LevelUp(forward);
  if (up == LevelUp(ForwardOf(before)) && up == Vec3f::UnitZ()) return before.roll_deg;
  const Eigen::Matrix4f view = MakeLaparoscope(before).view;
  const Vec3f right = turn * Vec3f(view.block<1, 3>(0, 0).transpose());
  return RollOf({right, right.cross(forward), forward}, up) * 180 / std::numbers::pi_v<float>;
}

void CameraControl::Press(CameraKey key) {
  if (held_) return;
  const Vec3f out = now_.scope_tip_W - now_.scope_target_W;
  const Vec3f side = Vec3f::UnitZ().cross(out).normalized();
  const auto turn = [&](float angle, const Vec3f& axis) {
    const Vec3f turned = Eigen::AngleAxisf(angle, axis) * out;
    if (std::abs(turned.normalized().z()) < kSteepest) {
      const RenderParams before = now_;
      now_.scope_tip_W = now_.scope_target_W + turned;
      now_.roll_deg = CarriedRoll_deg(before, now_, Quatf(Eigen::AngleAxisf(angle, axis)));
    }
  };
  const auto move = [&](float factor) {
    now_.scope_tip_W =
        now_.scope_target_W + std::clamp(factor * out.norm(), kNearest_m, kFarthest_m) * out.normalized();
  };
  switch (key) {
    case CameraKey::kLeft:
      return turn(-kTurn, Vec3f::UnitZ());
    case CameraKey::kRight:
      return turn(kTurn, Vec3f::UnitZ());
    case CameraKey::kUp:
      return turn(-kTurn, side);
    case CameraKey::kDown:
      return turn(kTurn, side);
    case CameraKey::kNearer:
      return move(kStep);
    case CameraKey::kFarther:
      return move(1 / kStep);
    case CameraKey::kRollLeft:
      now_.roll_deg -= kRoll_deg;
      return;
    case CameraKey::kRollRight:
      now_.roll_deg += kRoll_deg;
      return;
    case CameraKey::kReset:
      now_ = scene_;
      return;
  }
}

void CameraControl::Hold(const Vec3f& eye, const Sight& sight, float zoom) {
  held_ = true;
  now_ = scene_;
  now_.scope_tip_W = eye;
  // The light is set for the tissue in the middle of the scene's own view, as by a camera's automatic exposure.
  const float distance_m = std::clamp((scene_.scope_target_W - eye).norm(), kNearest_m, kFarthest_m);
  now_.scope_target_W = eye + distance_m * sight.forward;
  now_.roll_deg = RollOf(sight, LevelUp(sight.forward)) * 180 / std::numbers::pi_v<float>;
  const float half = std::tan(RadiansOf(scene_.fov_deg) / 2);
  now_.fov_deg = 2 * std::atan(half / zoom) * 180 / std::numbers::pi_v<float>;
}

void CameraControl::Follow(const Vec3f& p_W) {
  if (held_) return;
  now_.scope_tip_W += p_W - now_.scope_target_W;
  now_.scope_target_W = p_W;
}

}  // namespace fulcrum::render
