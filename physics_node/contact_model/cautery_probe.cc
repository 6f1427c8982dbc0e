#include "physics_node/contact_model/cautery_probe.h"

#include <algorithm>
#include <cmath>

#include "physics_node/collision/closest.h"

namespace fulcrum::physics {
namespace {

/// The arc strikes across a gap of this size between metal and membrane. Once struck it holds over kHoldSpacings of the
/// mesh more: where the membrane has burnt away it ends a triangle further on, not where the heat really ended [m].
constexpr float kStrikeGap = 0.0004f;
constexpr float kHoldSpacings = 0.5f;
/// Bare metal up the neck [m].
constexpr float kBareNeck = 0.005f;
/// The weight of a touching point falls to a quarter this far from the aim; at the reach it is out of the circuit [m].
constexpr float kSpotSize = 0.001f;
constexpr float kSpotReach = 0.003f;
/// The aim lies so far ahead of the spot when the tool moves faster than kSlow [m], [m/s].
constexpr float kLead = 0.0008f;
constexpr float kSlow = 0.001f;
/// The spot follows the touch along the metal at most this fast [m/s]. After this time without a touch it is chosen
/// anew and the arc is out [s].
constexpr float kSpotSpeed = 0.010f;
constexpr float kSpotMemory = 0.3f;
/// The membrane counts as lifted off what lies beneath from here on [m].
constexpr float kTentHeight = 0.002f;
/// A binding this many rows and columns away still tells how the organ beneath has moved.
constexpr int kBindingWindow = 6;
constexpr float kRateSmoothing = 0.03f;  ///< [s]
/// The line of contact is cut off here [m]: the spot reaches no farther, whatever the metal lies on.
constexpr float kLongestHalf = 0.002f;

}  // namespace

std::array<float, 3> BarycentricInPlane(const Vec2f& p, const Vec2f& a, const Vec2f& b, const Vec2f& c) {
  const auto lift = [](const Vec2f& v) { return Vec3f(v.x(), v.y(), 0.0f); };
  return ClosestOnTriangle(lift(p), lift(a), lift(b), lift(c));
}

bool CauteryProbe::Tented(Index triangle, const std::array<float, 3>& barycentric) const {
  const auto nodes = model_->TriangleNodes(triangle);
  const Index first = scene_.membrane.first;
  std::array<Vec3f, 3> rest;
  Vec3f displacement = Vec3f::Zero();
  for (std::size_t i = 0; i < 3; ++i) {
    rest[i] = scene_.rest_position[first + nodes[i]];
    displacement += barycentric[i] * (particles_->At(particles_->Ref(first + nodes[i])) - rest[i]);
  }
  const auto cols = static_cast<int>(model_->cols()), rows = static_cast<int>(model_->rows());
  const int row = static_cast<int>(nodes[0]) / cols, col = static_cast<int>(nodes[0]) % cols;
  int nearest = 2 * kBindingWindow + 1;
  Vec3f beneath = Vec3f::Zero();
  for (int r = std::max(row - kBindingWindow, 0); r <= std::min(row + kBindingWindow, rows - 1); ++r) {
    for (int c = std::max(col - kBindingWindow, 0); c <= std::min(col + kBindingWindow, cols - 1); ++c) {
      const int apart = std::abs(r - row) + std::abs(c - col);
      const auto binding = apart < nearest ? model_->BindingOf(static_cast<Index>(r * cols + c)) : std::nullopt;
      if (!binding) {
        continue;
      }
      nearest = apart;
      beneath.setZero();
      for (std::size_t i = 0; i < 3; ++i) {
        beneath += binding->barycentric[i] *
                   (particles_->At(binding->surface[i]) - scene_.rest_position[binding->surface[i].base / 4]);
      }
    }
  }
  const Vec3f normal = (rest[1] - rest[0]).cross(rest[2] - rest[0]).normalized();
  return normal.dot(displacement - beneath) > kTentHeight;
}

CauteryProbe::CauteryProbe(const SceneView& scene, const TissueModel* model, const ParticleStore* particles)
    : scene_(scene), model_(model), particles_(particles) {
  double sum = 0, count = 0;
  for (Index edge = 0; edge < scene.membrane_rest_length.size(); ++edge) {
    if (edge % 3 != 2 && scene.membrane_rest_length[edge] > 0.0f) {
      sum += scene.membrane_rest_length[edge];
      count += 1;
    }
  }
  spacing_ = static_cast<float>(sum / std::max(count, 1.0));
}

bool CauteryProbe::IsFresh() const { return static_cast<float>(steps_away_) * scene_.physics.dt_s > kSpotMemory; }

void CauteryProbe::FindTouches(std::uint32_t tool, const ToolCollision& collision) {
  const ToolDescription& description = scene_.tools[tool];
  const float hold = IsFresh() ? 0.0f : kHoldSpacings * spacing_;
  const float metal = description.tip_radius_m + scene_.physics.collision_margin_m, limit = metal + kStrikeGap + hold;
  touches_.clear();
  for (const ContactPair& pair : collision.pairs()) {
    // ShapeOf: the hook's first capsule is the foot, its second the neck; both begin at the heel.
    const std::uint32_t part = pair.capsule - tool * kMaxCapsules;
    if (pair.capsule / kMaxCapsules != tool || part > 1 || pair.triangle >= collision.membrane_triangle_count() ||
        pair.closest.distance_sq > limit * limit) {
      continue;
    }
    const float along = part == 0 ? pair.closest.t * description.tip_length_m : -pair.closest.t * kHookNeck;
    if (along >= -kBareNeck) {
      const float distance = std::sqrt(pair.closest.distance_sq);
      touches_.push_back({&pair, along, limit - distance, metal - distance, pair.closest.on_triangle});
    }
  }
}

float CauteryProbe::Nearness(const Touch& touch) const {
  const float away = (touch.place - aim_).norm();
  if (away > kSpotReach) {
    return 0.0f;
  }
  const float fall = 1.0f / (1.0f + away * away / (kSpotSize * kSpotSize));
  return fall * fall;
}

float CauteryProbe::Weight(const Touch& touch) const { return touch.closeness * Nearness(touch); }

Vec2f CauteryProbe::MaterialOf(const Touch& touch) const {
  Vec2f place = Vec2f::Zero();
  for (std::size_t i = 0; i < 3; ++i) {
    place +=
        touch.pair->closest.barycentric[i] * scene_.membrane_material[touch.pair->particle[i] - scene_.membrane.first];
  }
  return place;
}

Vec2f CauteryProbe::HalfLine() const {
  float sum = 0, along = 0, square = 0;
  Vec2f place = Vec2f::Zero(), product = Vec2f::Zero();
  for (const Touch& touch : touches_) {
    const float weight = touch.along >= 0.0f ? std::max(touch.metal, 0.0f) * Nearness(touch) : 0.0f;
    if (weight > 0.0f) {
      const Vec2f at = MaterialOf(touch);
      sum += weight;
      along += weight * touch.along;
      square += weight * touch.along * touch.along;
      place += weight * at;
      product += weight * touch.along * at;
    }
  }
  const float variance = sum > 0.0f ? square / sum - along * along / (sum * sum) : 0.0f;
  if (!(variance > 1e-10f)) {
    return Vec2f::Zero();
  }
  const Vec2f slope = (product / sum - along * place / (sum * sum)) / variance;
  const Vec2f half = slope * std::sqrt(3.0f * variance);
  const float length = half.norm();
  return length > kLongestHalf ? Vec2f(half * (kLongestHalf / length)) : half;
}

void CauteryProbe::FollowSpot(const ToolPose& pose, const ToolPose& last_pose, const ToolDescription& tool) {
  const float dt = scene_.physics.dt_s;
  motion_ += dt / (dt + kRateSmoothing) * ((pose.p_WT - last_pose.p_WT) / dt - motion_);
  float sum = 0, along = 0;
  const bool fresh = IsFresh();
  const float speed = motion_.norm();
  const Vec3f lead = speed > kSlow ? Vec3f(motion_ * (kLead / speed)) : Vec3f(Vec3f::Zero());
  const auto aim_at = [&](float spot) {
    return Vec3f(pose.ToWorld(spot >= 0.0f ? Vec3f(spot, 0, 0) : Vec3f(0, 0, spot)) + lead);
  };
  aim_ = aim_at(spot_);
  for (const Touch& touch : touches_) {
    // Nothing near the spot: wherever it touches draws the spot to itself.
    const float weight = fresh ? touch.closeness * touch.closeness : Weight(touch) + 1e-3f * touch.closeness;
    sum += weight;
    along += weight * touch.along;
  }
  if (!(sum > 0.0f)) {
    ++steps_away_;
    return;
  }
  steps_away_ = 0;
  const float step = kSpotSpeed * dt;
  spot_ = fresh ? along / sum : spot_ + std::clamp(along / sum - spot_, -step, step);
  spot_ = std::clamp(spot_, -kBareNeck, tool.tip_length_m);
  aim_ = aim_at(spot_);
}

CauteryContact CauteryProbe::Update(std::uint32_t tool, const ToolPose& last_pose, const ToolPose& pose,
                                    const ToolCollision& collision) {
  CauteryContact contact;
  contact.tool = static_cast<std::uint8_t>(tool);
  const ToolDescription& description = scene_.tools[tool];
  const auto& material = scene_.membrane_material;
  const float dt = scene_.physics.dt_s;
  FindTouches(tool, collision);
  FollowSpot(pose, last_pose, description);
  Vec2f mean = Vec2f::Zero();
  float sum = 0;
  for (const Touch& touch : touches_) {
    const float weight = Weight(touch);
    mean += weight * MaterialOf(touch);
    sum += weight;
  }
  if (!(sum > 0.0f)) {
    was_touching_ = false;
    rate_.setZero();
    half_.setZero();
    return contact;
  }
  mean /= sum;
  float nearest = 3e38f;
  for (const Touch& touch : touches_) {
    if (!(Weight(touch) > 0.0f)) {
      continue;
    }
    const auto nodes = model_->TriangleNodes(touch.pair->triangle);
    const auto barycentric = BarycentricInPlane(mean, material[nodes[0]], material[nodes[1]], material[nodes[2]]);
    const Vec2f place =
        barycentric[0] * material[nodes[0]] + barycentric[1] * material[nodes[1]] + barycentric[2] * material[nodes[2]];
    const float distance = (place - mean).squaredNorm();
    if (distance < nearest) {
      nearest = distance;
      contact.triangle = touch.pair->triangle;
      contact.barycentric = barycentric;
      contact.material = place;
    }
  }
  contact.touching = true;
  contact.tented = Tented(contact.triangle, contact.barycentric);
  contact.contact_radius_m = description.tip_radius_m;
  // A line has no direction: towards the end that was told of last.
  const Vec2f half = HalfLine();
  half_ += dt / (dt + kRateSmoothing) * ((half.dot(half_) < 0.0f ? Vec2f(-half) : half) - half_);
  contact.contact_half = half_;
  if (was_touching_) {
    rate_ += dt / (dt + kRateSmoothing) * ((contact.material - last_material_) / dt - rate_);
  }
  contact.material_rate = rate_;
  was_touching_ = true;
  last_material_ = contact.material;
  return contact;
}

}  // namespace fulcrum::physics
