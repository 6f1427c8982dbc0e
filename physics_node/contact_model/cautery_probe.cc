#include "physics_node/contact_model/cautery_probe.h"

#include <algorithm>
#include <cmath>

#include "physics_node/collision/closest.h"

namespace fulcrum::physics {
namespace {

/// Current crosses a gap of this size between foot and membrane [m].
constexpr float kContactGap = 0.0004f;
/// Weight of a touching point falls by 4 at this distance from the foot's free end [m].
constexpr float kEndLength = 0.0015f;
/// The membrane counts as lifted off what lies beneath from here on [m].
constexpr float kTentHeight = 0.002f;
/// A binding this many rows and columns away still tells how the organ beneath has moved.
constexpr int kBindingWindow = 6;
constexpr float kRateSmoothing = 0.03f;  ///< [s]

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

CauteryContact CauteryProbe::Update(std::uint32_t tool, const ToolCollision& collision) {
  CauteryContact contact;
  contact.tool = static_cast<std::uint8_t>(tool);
  const ToolDescription& description = scene_.tools[tool];
  const std::uint32_t foot = tool * kMaxCapsules;  // ShapeOf: the foot is the hook's first capsule.
  const float limit = description.tip_radius_m + scene_.physics.collision_margin_m + kContactGap;
  const auto place_of = [&](const ContactPair& pair) {
    Vec2f place = Vec2f::Zero();
    for (std::size_t i = 0; i < 3; ++i) {
      place += pair.closest.barycentric[i] * scene_.membrane_material[pair.particle[i] - scene_.membrane.first];
    }
    return place;
  };
  Vec2f mean = Vec2f::Zero();
  float sum = 0;
  for (const ContactPair& pair : collision.pairs()) {
    const float distance = std::sqrt(pair.closest.distance_sq);
    if (pair.capsule != foot || pair.triangle >= collision.membrane_triangle_count() || distance > limit) {
      continue;
    }
    const float from_end = (1.0f - pair.closest.t) * description.tip_length_m / kEndLength;
    const float fall = 1.0f / (1.0f + from_end * from_end);
    const float weight = (limit - distance) * fall * fall;
    mean += weight * place_of(pair);
    sum += weight;
  }
  if (!(sum > 0.0f)) {
    was_touching_ = false;
    rate_.setZero();
    return contact;
  }
  mean /= sum;
  float nearest = 3e38f;
  for (const ContactPair& pair : collision.pairs()) {
    if (pair.capsule != foot || pair.triangle >= collision.membrane_triangle_count() ||
        pair.closest.distance_sq > limit * limit) {
      continue;
    }
    const auto nodes = model_->TriangleNodes(pair.triangle);
    const auto& m = scene_.membrane_material;
    const auto barycentric = BarycentricInPlane(mean, m[nodes[0]], m[nodes[1]], m[nodes[2]]);
    const Vec2f place = barycentric[0] * m[nodes[0]] + barycentric[1] * m[nodes[1]] + barycentric[2] * m[nodes[2]];
    const float distance = (place - mean).squaredNorm();
    if (distance < nearest) {
      nearest = distance;
      contact.triangle = pair.triangle;
      contact.barycentric = barycentric;
      contact.material = place;
    }
  }
  contact.touching = true;
  contact.tented = Tented(contact.triangle, contact.barycentric);
  contact.contact_radius_m = description.tip_radius_m;
  if (was_touching_) {
    const float dt = scene_.physics.dt_s;
    rate_ += dt / (dt + kRateSmoothing) * ((contact.material - last_material_) / dt - rate_);
  }
  contact.material_rate = rate_;
  was_touching_ = true;
  last_material_ = contact.material;
  return contact;
}

}  // namespace fulcrum::physics
