#include "services/apps/replayer/variation.h"

#include <cmath>
#include <numbers>
#include <random>

#include "services/apps/replayer/report_format.h"

namespace fulcrum::replay {
namespace {

constexpr float kTarget_m = 0.004f, kTurn_deg = 10, kRoll_deg = 12;
constexpr float kDistance = 0.10f, kField = 0.10f;  // Shares.
constexpr float kDarkest = 0.6f, kBrightest = 1.5f;
constexpr float kWhite = 0.12f, kTint = 0.15f;  // Shares.
constexpr float kWidest_deg = 120;

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

Variation VariationOf(const RenderParams& camera, std::uint32_t seed, std::uint32_t index) {
  Draw draw(seed, index);
  Variation variation{{}, camera};
  const float strength = std::exp(draw.Between(std::log(kDarkest), std::log(kBrightest)));
  variation.look.light = strength * Vec3f(1 + draw.Around(kWhite), 1, 1 + draw.Around(kWhite));
  for (int k = 0; k < 3; ++k) variation.look.tissue[k] = 1 + draw.Around(kTint);
  variation.look.patterns = draw.Number();

  RenderParams& moved = variation.camera;
  for (int k = 0; k < 3; ++k) moved.scope_target_W[k] += draw.Around(kTarget_m);
  const Vec3f back = camera.scope_tip_W - camera.scope_target_W;
  const auto angle = [&] { return std::numbers::pi_v<float> / 180 * draw.Around(kTurn_deg); };
  // About the vertical and about the horizontal line across the view.
  const Vec3f across = back.cross(Vec3f::UnitZ());
  Vec3f turned = Eigen::AngleAxisf(angle(), Vec3f::UnitZ()) * back;
  if (across.norm() > 1e-6f) turned = Eigen::AngleAxisf(angle(), across.normalized()) * turned;
  moved.scope_tip_W = moved.scope_target_W + (1 + draw.Around(kDistance)) * turned;
  moved.roll_deg += draw.Around(kRoll_deg);
  moved.fov_deg = std::min(kWidest_deg, camera.fov_deg * (1 + draw.Around(kField)));
  return variation;
}

std::string VariationText(std::uint32_t index, const Variation& variation) {
  const auto vector = [](const Vec3f& v) {
    return Format("[%.6f, %.6f, %.6f]", static_cast<double>(v.x()), static_cast<double>(v.y()),
                  static_cast<double>(v.z()));
  };
  return Format("{\"folder\": \"%03u\", \"patterns\": %u, \"light\": ", index, variation.look.patterns) +
         vector(variation.look.light) + ", \"tissue\": " + vector(variation.look.tissue) +
         ", \"scope_tip_W\": " + vector(variation.camera.scope_tip_W) +
         ", \"scope_target_W\": " + vector(variation.camera.scope_target_W) +
         Format(", \"roll_deg\": %.4f, \"fov_deg\": %.4f}\n", static_cast<double>(variation.camera.roll_deg),
                static_cast<double>(variation.camera.fov_deg));
}

}  // namespace fulcrum::replay
