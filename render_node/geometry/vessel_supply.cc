#include "render_node/geometry/vessel_supply.h"

#include <algorithm>
#include <cmath>

#include "render_node/geometry/texel.h"

namespace fulcrum::render {
namespace {

constexpr std::uint8_t kRemoved = 128;  // Texels below are removed …
constexpr std::uint8_t kSealed = 128;   // … and with this damage coagulated: they carry no blood.

float DistanceToSegment(const Vec2f& p, const Vec2f& a, const Vec2f& b) {
  const Vec2f ab = b - a;
  const float length2 = ab.squaredNorm();
  const float along = length2 > 0 ? std::clamp((p - a).dot(ab) / length2, 0.0f, 1.0f) : 0.0f;
  return (p - a - along * ab).norm();
}

float Cross(const Vec2f& a, const Vec2f& b) { return a.x() * b.y() - a.y() * b.x(); }

bool Inside(const Vec2f& p, const std::array<Vec2f, 3>& t) {
  const float a = Cross(t[1] - t[0], p - t[0]), b = Cross(t[2] - t[1], p - t[1]), c = Cross(t[0] - t[2], p - t[2]);
  return (a >= 0 && b >= 0 && c >= 0) || (a <= 0 && b <= 0 && c <= 0);
}

}  // namespace

float VesselSupply::VesselAt(const Vec2f& material) const {
  const auto wrapped = [this](float metres) {
    const float place = metres * per_m_;
    return std::min(texels_ - 1, static_cast<int>((place - std::floor(place)) * static_cast<float>(texels_)));
  };
  return static_cast<float>(vessels_[4 * TexelIndex(wrapped(material.x()), wrapped(material.y()), texels_) + 3]) / 255;
}

void VesselSupply::SetClips(std::span<const Clip> clips) {
  closed_.clear();
  const Index first = scene_.membrane.first, nodes = static_cast<Index>(scene_.membrane_material.size());
  for (const Clip& clip : clips) {
    std::array<Vec2f, 3> triangle;
    bool on_sheet = true;
    for (std::size_t k = 0; k < 3; ++k) {
      const Index node = clip.anchors[k] - first;  // Of a solid's vertex, which comes before: too large.
      on_sheet = on_sheet && node < nodes;
      if (on_sheet) triangle[k] = scene_.membrane_material[node];
    }
    if (on_sheet) closed_.push_back(triangle);
  }
}

bool VesselSupply::Closed(const Vec2f& material) const {
  return std::ranges::any_of(closed_, [&](const std::array<Vec2f, 3>& t) {
    const Vec2f low = t[0].cwiseMin(t[1]).cwiseMin(t[2]), high = t[0].cwiseMax(t[1]).cwiseMax(t[2]);
    if (((material - low).array() < -kClosed_m).any() || ((material - high).array() > kClosed_m).any()) return false;
    return Inside(material, t) || DistanceToSegment(material, t[0], t[1]) <= kClosed_m ||
           DistanceToSegment(material, t[1], t[2]) <= kClosed_m || DistanceToSegment(material, t[2], t[0]) <= kClosed_m;
  });
}

bool VesselSupply::CutOff(const Vec2f& material, const Atlas& atlas) {
  if (!has_clips()) return false;
  const float texel_m = atlas.texel_m();
  const int width = atlas.width(), height = atlas.height();
  seen_.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  filled_.clear();
  const auto push = [&](int x, int y) {
    std::uint8_t& seen = seen_[TexelIndex(x, y, width)];
    if (seen == 0) filled_.push_back({x, y});
    seen = 1;
  };
  push(std::clamp(static_cast<int>(material.x() / texel_m), 0, width - 1),
       std::clamp(static_cast<int>(material.y() / texel_m), 0, height - 1));
  bool reached = false, at_clip = false;
  for (std::size_t k = 0; k < filled_.size() && !reached; ++k) {
    const auto [x, y] = filled_[k];
    const Vec2f place = texel_m * Vec2f(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
    if (Closed(place)) {
      at_clip = true;
      continue;
    }
    reached = x == 0 || y == 0 || x == width - 1 || y == height - 1 || (place - material).norm() > kSupply_m;
    for (int v = y - 1; v <= y + 1 && !reached; ++v) {
      for (int u = x - 1; u <= x + 1; ++u) {
        const std::uint8_t* texel = atlas.texels().data() + 4 * TexelIndex(u, v, width);
        if (texel[3] < kRemoved || texel[1] >= kSealed) continue;
        const Vec2f next = texel_m * Vec2f(static_cast<float>(u) + 0.5f, static_cast<float>(v) + 0.5f);
        if (VesselAt(next) >= kVessel) push(u, v);
      }
    }
  }
  for (const auto& [x, y] : filled_) seen_[TexelIndex(x, y, width)] = 0;
  return at_clip && !reached;
}

}  // namespace fulcrum::render
