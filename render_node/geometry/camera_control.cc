#include "render_node/geometry/camera_control.h"

#include <algorithm>
#include <numbers>

namespace fulcrum::render {
namespace {

constexpr float kTurn = 3 * std::numbers::pi_v<float> / 180;
constexpr float kStep = 0.95f;
constexpr float kRoll_deg = 5;
constexpr float kNearest_m = 0.02f, kFarthest_m = 0.3f;
constexpr float kSteepest = 0.97f;  // Limit of the cosine to the vertical, where the horizon is undefined.

}  // namespace

void CameraControl::Press(CameraKey key) {
  const Vec3f out = now_.scope_tip_W - now_.scope_target_W;
  const Vec3f side = Vec3f::UnitZ().cross(out).normalized();
  const auto turn = [&](float angle, const Vec3f& axis) {
    const Vec3f turned = Eigen::AngleAxisf(angle, axis) * out;
    if (std::abs(turned.normalized().z()) < kSteepest) {
      now_.scope_tip_W = now_.scope_target_W + turned;
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

void CameraControl::Follow(const Vec3f& p_W) {
  now_.scope_tip_W += p_W - now_.scope_target_W;
  now_.scope_target_W = p_W;
}

}  // namespace fulcrum::render
