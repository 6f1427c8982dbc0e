#include "services/apps/replayer/variation.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "render_node/geometry/camera_control.h"
#include "services/apps/replayer/report_format.h"

namespace fulcrum::replay {
namespace {

constexpr float kTarget_m = 0.004f, kTurn_rad = std::numbers::pi_v<float> / 18, kRoll_deg = 12;
constexpr float kDistance = 0.10f, kField = 0.10f;  // Shares.
constexpr float kDarkest = 0.6f, kBrightest = 1.5f;
constexpr float kWhite = 0.12f, kTint = 0.15f;               // Shares.
constexpr float kLeastField_deg = 10, kMostField_deg = 150;  // As of a scene.

/// The standard fixes the sequence of std::mt19937 but not those of its distributions.
class Draw {
 public:
  Draw(std::uint32_t seed, std::uint32_t index) {
    std::seed_seq both{seed, index};
    engine_.seed(both);
  }
  float Between(float low, float high) { return low + (high - low) * static_cast<float>(engine_() >> 8) * 0x1p-24f; }
  float Around(float reach) { return Between(-reach, reach); }
  std::uint32_t Number() { return static_cast<std::uint32_t>(engine_() >> 1) + 1; }

 private:
  std::mt19937 engine_;
};

}  // namespace

Variation VariationOf(const SceneView& scene, std::uint32_t seed, std::uint32_t index) {
  const RenderParams& camera = scene.render;
  Draw draw(seed, index);
  Variation variation{{}, camera, !FindTool(scene.tools, ToolKind::kScope)};
  const float strength = std::exp(draw.Between(std::log(kDarkest), std::log(kBrightest)));
  const float red = 1 + draw.Around(kWhite), blue = 1 + draw.Around(kWhite);
  variation.look.light = strength * Vec3f(red, 1, blue);
  for (int k = 0; k < 3; ++k) variation.look.tissue[k] = 1 + draw.Around(kTint);
  variation.look.patterns = draw.Number();

  RenderParams& moved = variation.camera;
  moved.fov_deg = std::clamp(camera.fov_deg * (1 + draw.Around(kField)), kLeastField_deg, kMostField_deg);
  if (!variation.scope_varies) return variation;
  for (int k = 0; k < 3; ++k) moved.scope_target_W[k] += draw.Around(kTarget_m);
  const Vec3f back = camera.scope_tip_W - camera.scope_target_W;
  const float sideways = draw.Around(kTurn_rad), upward = draw.Around(kTurn_rad);
  const Vec3f across = back.cross(Vec3f::UnitZ());
  Quatf turn = Quatf::Identity();
  Vec3f turned = back;
  if (across.norm() > 1e-6f) {
    const Eigen::AngleAxisf up(upward, across.normalized());
    turn = up;
    turned = up * turned;
  }
  const Eigen::AngleAxisf side(sideways, Vec3f::UnitZ());
  turn = side * turn;
  turned = side * turned;
  moved.scope_tip_W = moved.scope_target_W + (1 + draw.Around(kDistance)) * turned;
  moved.roll_deg = render::CarriedRoll_deg(camera, moved, turn) + draw.Around(kRoll_deg);
  return variation;
}

std::string VariationText(std::uint32_t seed, std::uint32_t index, const Variation& variation) {
  const auto vector = [](const Vec3f& v) {
    return Format("[%.6f, %.6f, %.6f]", static_cast<double>(v.x()), static_cast<double>(v.y()),
                  static_cast<double>(v.z()));
  };
  const RenderParams& camera = variation.camera;
  const std::string pose = variation.scope_varies
                               ? "\"scope_tip_W\": " + vector(camera.scope_tip_W) +
                                     ", \"scope_target_W\": " + vector(camera.scope_target_W) +
                                     Format(", \"roll_deg\": %.4f", static_cast<double>(camera.roll_deg))
                               : "\"scope_tip_W\": null, \"scope_target_W\": null, \"roll_deg\": null";
  return Format("{\"folder\": \"%03u\", \"seed\": %u, \"patterns\": %u, \"light\": ", index, seed,
                variation.look.patterns) +
         vector(variation.look.light) + ", \"tissue\": " + vector(variation.look.tissue) + ", " + pose +
         Format(", \"fov_deg\": %.4f}\n", static_cast<double>(camera.fov_deg));
}

}  // namespace fulcrum::replay
