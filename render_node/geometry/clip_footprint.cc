#include "render_node/geometry/clip_footprint.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace fulcrum::render {
namespace {

/// Distance from the middle line of the legs within which tissue is between them [m]: half a leg and the sheet's
/// thickness, not the tissue beside them.
constexpr float kBetween_m = 0.0012f;

/// The longest side of the triangle of three places.
ClipFootprint LongestSide(const std::array<Vec2f, 3>& corners) {
  ClipFootprint longest;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec2f &from = corners[k], &to = corners[(k + 1) % 3];
    if ((to - from).squaredNorm() > (longest.to - longest.from).squaredNorm()) longest = {from, to};
  }
  return longest;
}

/// The middle line of places that are spread along one direction most.
ClipFootprint LineThrough(std::span<const Vec2f> places) {
  Vec2f mean = Vec2f::Zero();
  for (const Vec2f& p : places) mean += p / static_cast<float>(places.size());
  float ss = 0, st = 0, tt = 0;
  for (const Vec2f& p : places) {
    const Vec2f d = p - mean;
    ss += d.x() * d.x();
    st += d.x() * d.y();
    tt += d.y() * d.y();
  }
  const float angle = 0.5f * std::atan2(2 * st, ss - tt);  // Of the larger principal axis.
  const Vec2f along(std::cos(angle), std::sin(angle));
  float least = 0, most = 0;
  for (const Vec2f& p : places) {
    least = std::min(least, along.dot(p - mean));
    most = std::max(most, along.dot(p - mean));
  }
  return {mean + least * along, mean + most * along};
}

}  // namespace

std::optional<ClipFootprint> FootprintOf(const Clip& clip, const ClipPose& pose, const SceneView& scene,
                                         std::span<const float> xyz) {
  const Index first = scene.membrane.first, nodes = static_cast<Index>(scene.membrane_material.size());
  const Quatf to_clip = pose.q_WC.conjugate();
  const float half = 0.5f * clip.length_m;
  std::vector<Vec2f> between;
  for (Index node = 0; node < nodes; ++node) {
    const Vec3f p = to_clip * (Vec3f::Map(&xyz[3 * std::size_t{first + node}]) - pose.p_WC);
    const Vec3f nearest(0, 0, std::clamp(p.z(), -half, half));
    // False for NaN.
    if ((p - nearest).squaredNorm() <= kBetween_m * kBetween_m) between.push_back(scene.membrane_material[node]);
  }
  if (between.size() > 1) return LineThrough(between);
  std::array<Vec2f, 3> corners;
  for (std::size_t k = 0; k < 3; ++k) {
    const Index node = clip.anchors[k] - first;  // Of a solid's vertex, which comes before: too large.
    if (node >= nodes) return std::nullopt;
    corners[k] = scene.membrane_material[node];
  }
  return LongestSide(corners);
}

}  // namespace fulcrum::render
