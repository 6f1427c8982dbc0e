#include "physics_node/contact_model/solid_probe.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "physics_node/collision/tool_shape.h"

namespace fulcrum::physics {
namespace {

/// The metal changes to another chart if that is nearer by this [m].
constexpr float kNearerChart = 1.0e-4f;

}  // namespace

SolidProbe::SolidProbe(const TissueScene& scene, const ParticleStore* particles)
    : scene_(scene),
      particles_(particles),
      charts_(MakeSolidCharts(scene)),
      cushion_m_(ContactMargin(scene, ToolPart::kTip) + kContactSlack) {}

SurfaceTriangle SolidProbe::At(Index triangle) const {
  const SolidChart& chart = charts_.charts[charts_.of_triangle[triangle]];
  SurfaceTriangle at;
  for (std::size_t k = 0; k < 3; ++k) {
    const Index vertex = scene_.tube_surface[triangle][k];
    at.place[k] = particles_->At({4 * vertex, 1});
    at.material[k] = chart.Material(scene_.rest_position[vertex]);
  }
  return at;
}

SolidProbe::Nearest SolidProbe::FindNear(std::uint32_t tool, const ToolCollision& collision) {
  near_.clear();
  Nearest nearest, on_last;
  const auto take = [](const ContactPair& pair, Index triangle, Nearest* least) {
    if (least->triangle != kNoIndex && pair.closest.distance_sq >= least->distance_sq) return;
    *least = {triangle, pair.closest.barycentric, pair.closest.distance_sq};
  };
  for (const ContactPair& pair : collision.pairs()) {
    // ShapeOf: the hook's first capsule is the foot, its second the neck.
    if (pair.capsule / kMaxCapsules != tool || pair.capsule % kMaxCapsules > 1 ||
        pair.triangle < collision.membrane_triangle_count() || !(pair.closest.distance_sq < kFarSq)) {
      continue;
    }
    const Index triangle = pair.triangle - collision.membrane_triangle_count();
    if (charts_.of_triangle[triangle] == kNoIndex) continue;
    near_.push_back(triangle);
    take(pair, triangle, &nearest);
    if (was_touching_ && charts_.of_triangle[triangle] == last_chart_) take(pair, triangle, &on_last);
  }
  std::sort(near_.begin(), near_.end());
  near_.erase(std::unique(near_.begin(), near_.end()), near_.end());
  // Over a border the metal stays with its chart, instead of changing with each step.
  const bool stays =
      on_last.triangle != kNoIndex && std::sqrt(on_last.distance_sq) < std::sqrt(nearest.distance_sq) + kNearerChart;
  return stays ? on_last : nearest;
}

void SolidProbe::Update(std::uint32_t tool, const ToolPose& pose, const ToolCollision& collision, float step_s,
                        CauteryContact* contact) {
  const ToolDescription& description = scene_.tools[tool];
  const Nearest nearest = FindNear(tool, collision);
  const bool touched = std::exchange(was_touching_, false);
  if (nearest.triangle == kNoIndex) return;
  const Index chart = charts_.of_triangle[nearest.triangle];
  const std::array<Vec2f, 3> corners = At(nearest.triangle).material;
  const auto& b = nearest.barycentric;
  gaps_.Begin(b[0] * corners[0] + b[1] * corners[1] + b[2] * corners[2], kSolidCell_m);
  const MetalAxis axis{pose.ToWorld(Vec3f(description.tip_length_m, 0, 0)), pose.p_WT,
                       pose.ToWorld(Vec3f(0, 0, -kBareNeck))};
  for (const Index triangle : near_) {
    if (charts_.of_triangle[triangle] != chart) continue;
    gaps_.Add(At(triangle), axis, description.tip_radius_m, cushion_m_,
              [](const std::array<float, 3>&) { return true; });
  }
  const bool stays = touched && chart == last_chart_;
  Vec2f centre = Vec2f::Zero();
  if (!gaps_.FindMiddle(stays ? kHoldGap : kStrikeGap, &centre)) return;
  contact->on_solid = true;
  contact->triangle = nearest.triangle;
  contact->barycentric = b;
  contact->material = centre;
  contact->contact_radius_m = description.tip_radius_m;
  gaps_.Encode(&contact->footprint);
  if (!stays) {
    rate_.setZero();
  } else {
    rate_ += step_s / (step_s + kRateTime) * ((centre - last_material_) / step_s - rate_);
  }
  contact->material_rate = rate_;
  was_touching_ = true;
  last_chart_ = chart;
  last_material_ = centre;
}

}  // namespace fulcrum::physics
