#include "services/base/core/lens.h"

#include <algorithm>

namespace fulcrum {
namespace {

constexpr float kTouch_m = 0.003f;   // Distance at which the lens touches tissue,
constexpr float kSmear = 0.8f;       // and what that leaves on it.
constexpr float kSteam_m = 0.06f;    // Distance from the hook up to which steam reaches the lens.
constexpr float kFog_per_s = 0.08f;  // At the hook itself; less with the distance.
constexpr float kFogMost = 0.6f;
constexpr float kTrocar_m = 0.035f;  // Distance of the lens from the pivot below which it is wiped.
constexpr float kWipe_per_s = 1;
constexpr double kLongestGap_s = 0.1;  // A gap in the samples is no time at the lens.

}  // namespace

Lens::Lens(const SceneView& scene)
    : scene_(scene), scope_(FindTool(scene.tools, ToolKind::kScope)), hook_(FindTool(scene.tools, ToolKind::kHook)) {}

bool Lens::Touches(const Vec3f& lens_W) const {
  return std::any_of(scene_.rest_position.begin(), scene_.rest_position.end(),
                     [&](const Vec3f& p) { return (p - lens_W).squaredNorm() < kTouch_m * kTouch_m; });
}

void Lens::Step(double time_s, const ToolState& tools, bool delivers) {
  if (!scope_ || tools.tools[*scope_].kind != ToolKind::kScope || time_s <= last_s_) return;
  const auto dt_s = static_cast<float>(last_s_ < 0 ? 0 : std::min(time_s - last_s_, kLongestGap_s));
  last_s_ = time_s;
  const Vec3f& lens_W = tools.tools[*scope_].p_WT;
  if (delivers && hook_) {
    const float near = std::max(0.0f, 1 - (tools.tools[*hook_].p_WT - lens_W).norm() / kSteam_m);
    if (soil_ < kFogMost) soil_ = std::min(kFogMost, soil_ + dt_s * kFog_per_s * near);
  }
  if (Touches(lens_W)) soil_ = std::max(soil_, kSmear);
  if ((lens_W - scene_.tools[*scope_].p_WP).norm() < kTrocar_m) soil_ = std::max(0.0f, soil_ - dt_s * kWipe_per_s);
}

}  // namespace fulcrum
