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

Vec2f MiddleOf(int x, int y, float texel_m) {
  return texel_m * Vec2f(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
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
  Ends ends = Flood(material, atlas, Tissue::kLiving);
  Forget();
  if (ends.supplied || ends.at_clip) return !ends.supplied;
  if (ends.farthest_m > kPiece_m) return false;  // A vessel that only ends.
  ends = Flood(material, atlas, Tissue::kLivingOrLost);
  Forget();
  return ends.at_clip;
}

void VesselSupply::Forget() {
  for (const auto& [x, y] : filled_) seen_[TexelIndex(x, y, width_)] = 0;
}

bool VesselSupply::Carries(int x, int y, const Atlas& atlas, Tissue tissue) const {
  const std::uint8_t* texel = atlas.texels().data() + 4 * TexelIndex(x, y, atlas.width());
  const bool living = texel[3] >= kRemoved && texel[1] < kSealed;
  return (living || tissue == Tissue::kLivingOrLost) && VesselAt(MiddleOf(x, y, atlas.texel_m())) >= kVessel;
}

void VesselSupply::ForEachCutOff(const Atlas& atlas, const std::function<void(const Vec2f& material)>& visit) {
  const float texel_m = atlas.texel_m();
  const float beside_m = kClosed_m + 2 * texel_m;
  // A vessel that has been visited is not visited again from another one of its texels beside a clip.
  std::vector<std::uint8_t> known(static_cast<std::size_t>(atlas.width()) * static_cast<std::size_t>(atlas.height()));
  for (const std::array<Vec2f, 3>& t : closed_) {
    const Vec2f low = t[0].cwiseMin(t[1]).cwiseMin(t[2]), high = t[0].cwiseMax(t[1]).cwiseMax(t[2]);
    const auto first = [&](float metres) { return std::max(1, static_cast<int>((metres - beside_m) / texel_m)); };
    const auto last = [&](float metres, int count) {
      return std::min(count - 2, static_cast<int>((metres + beside_m) / texel_m));
    };
    for (int y = first(low.y()); y <= last(high.y(), atlas.height()); ++y) {
      for (int x = first(low.x()); x <= last(high.x(), atlas.width()); ++x) {
        const Vec2f place = MiddleOf(x, y, texel_m);
        if (known[TexelIndex(x, y, atlas.width())] != 0 || !Carries(x, y, atlas, Tissue::kLiving) || Closed(place))
          continue;
        const Ends ends = Flood(place, atlas, Tissue::kLiving);
        const bool cut_off = ends.at_clip && !ends.supplied;
        for (const auto& [u, v] : filled_) {
          const Vec2f at = MiddleOf(u, v, texel_m);
          if (Closed(at)) continue;  // It may lie beside another vessel, too.
          known[TexelIndex(u, v, atlas.width())] = 1;
          if (cut_off) visit(at);
        }
        Forget();
      }
    }
  }
}

VesselSupply::Ends VesselSupply::Flood(const Vec2f& material, const Atlas& atlas, Tissue tissue) {
  const float texel_m = atlas.texel_m();
  const int width = atlas.width(), height = atlas.height();
  width_ = width;
  seen_.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  filled_.clear();
  const auto push = [&](int x, int y) {
    std::uint8_t& seen = seen_[TexelIndex(x, y, width)];
    if (seen == 0) filled_.push_back({x, y});
    seen = 1;
  };
  push(std::clamp(static_cast<int>(material.x() / texel_m), 0, width - 1),
       std::clamp(static_cast<int>(material.y() / texel_m), 0, height - 1));
  Ends ends;
  for (std::size_t k = 0; k < filled_.size() && !ends.supplied; ++k) {
    const auto [x, y] = filled_[k];
    const Vec2f place = MiddleOf(x, y, texel_m);
    if (Closed(place)) {
      ends.at_clip = true;
      continue;
    }
    ends.farthest_m = std::max(ends.farthest_m, (place - material).norm());
    ends.supplied = x == 0 || y == 0 || x == width - 1 || y == height - 1 || ends.farthest_m > kSupply_m;
    for (int v = y - 1; v <= y + 1 && !ends.supplied; ++v) {
      for (int u = x - 1; u <= x + 1; ++u) {
        if (Carries(u, v, atlas, tissue)) push(u, v);
      }
    }
  }
  return ends;
}

}  // namespace fulcrum::render
