#include "render_node/geometry/tool_shadow.h"

#include <algorithm>
#include <cmath>

#include "render_node/geometry/solid.h"
#include "render_node/geometry/surface.h"
#include "render_node/geometry/texel.h"

namespace fulcrum::render {
namespace {

constexpr int kSamples = 28;               // Number of sections along an instrument …
constexpr float kLength = 0.13f;           // … over this length from the tip [m]; denser near the tip.
constexpr float kTransition = 0.006f;      // Length of the transition from the tip's to the shaft's radius [m].
constexpr float kLeastPenumbra = 0.6e-3f;  // [m]
// Half width of the soft edge per height: angle subtended by the crescent of fibres.
constexpr float kPenumbra = 0.05f;
constexpr float kDarkest = 0.62f;
// Height at which the darkness has fallen to a half, because of light from the walls [m].
constexpr float kFade = 0.10f;
constexpr float kTipEnd = 0.005f;  // [m]
constexpr int kFillRounds = 4;     // Rounds of filling gaps: vertices of the fixed surfaces are several cells apart.

float SmoothStep(float low, float high, float x) {
  const float t = std::clamp((x - low) / (high - low), 0.0f, 1.0f);
  return t * t * (3 - 2 * t);
}

float RadiusAt(const ToolDescription& tool, float behind_tip_m) {
  const float tip_m = tool.kind == ToolKind::kHook ? kHookNeck : tool.tip_length_m;
  const float t = std::clamp((behind_tip_m - tip_m) / kTransition, 0.0f, 1.0f);
  return tool.tip_radius_m + t * (tool.shaft_radius_m - tool.tip_radius_m);
}

}  // namespace

void ToolShadow::Update(const Laparoscope& scope, std::span<const float> xyz,
                        std::span<const ToolSample, kMaxTools> tools) {
  positions_.clear();
  coordinates_.clear();
  triangles_.clear();
  if (std::all_of(tools.begin(), tools.end(), [](const ToolSample& t) { return !TouchesTissue(t.kind); })) {
    return;
  }
  FindDepths(scope, xyz);
  for (std::size_t k = 0; k < tools.size(); ++k) {
    if (TouchesTissue(tools[k].kind)) {
      AppendRibbon(scope, scene_.tools[k], tools[k]);
    }
  }
}

void ToolShadow::FindDepths(const Laparoscope& scope, std::span<const float> xyz) {
  constexpr std::size_t kCells = std::size_t{kCellsAcross} * kCellsUp;
  // Larger than the camera's field, because the light is beside the camera.
  reach_ = 1.25f * Vec2f(1 / scope.projection(0, 0), 1 / scope.projection(1, 1));
  depth_.assign(kCells, 0.0f);
  const Mat3f turn = scope.view.block<3, 3>(0, 0);
  const Vec3f offset = scope.view.block<3, 1>(0, 3) - LightPlace(scope);
  const Vec2f scale(0.5f * kCellsAcross / reach_.x(), 0.5f * kCellsUp / reach_.y());
  const auto add = [&](const Vec3f& p_W) {
    const Vec3f p = turn * p_W + offset;
    const float depth = -p.z();
    const float x = 0.5f * kCellsAcross + scale.x() * p.x() / depth, y = 0.5f * kCellsUp + scale.y() * p.y() / depth;
    if (depth > 0 && x >= 0 && y >= 0 && x < kCellsAcross && y < kCellsUp) {
      float& nearest = depth_[TexelIndex(static_cast<int>(x), static_cast<int>(y), kCellsAcross)];
      nearest = nearest > 0 ? std::min(nearest, depth) : depth;
    }
  };
  for (Index i = 0; i < xyz.size() / 3; ++i) {
    add(PositionOf(xyz, i));
  }
  for (const Vec3f& p : scene_.static_vertices) {
    add(p);
  }
  for (int round = 0; round < kFillRounds; ++round) {
    filled_ = depth_;
    for (int y = 0; y < kCellsUp; ++y) {
      for (int x = 0; x < kCellsAcross; ++x) {
        if (depth_[TexelIndex(x, y, kCellsAcross)] > 0) {
          continue;
        }
        float sum = 0;
        int count = 0;
        for (int b = std::max(0, y - 1); b <= std::min(kCellsUp - 1, y + 1); ++b) {
          for (int a = std::max(0, x - 1); a <= std::min(kCellsAcross - 1, x + 1); ++a) {
            const float depth = depth_[TexelIndex(a, b, kCellsAcross)];
            sum += depth;
            count += depth > 0 ? 1 : 0;
          }
        }
        if (count > 0) {
          filled_[TexelIndex(x, y, kCellsAcross)] = sum / static_cast<float>(count);
        }
      }
    }
    std::swap(depth_, filled_);
  }
}

// Interpolates between the four cells around a direction; 0 outside the map and where there is no tissue.
float ToolShadow::DepthAt(const Vec2f& direction) const {
  const float x = (0.5f + 0.5f * direction.x() / reach_.x()) * kCellsAcross - 0.5f;
  const float y = (0.5f + 0.5f * direction.y() / reach_.y()) * kCellsUp - 0.5f;
  if (!(x >= 0 && y >= 0 && x < kCellsAcross - 1 && y < kCellsUp - 1)) {
    return 0;
  }
  const int ix = static_cast<int>(x), iy = static_cast<int>(y);
  float sum = 0, weights = 0;
  for (const auto& [dx, dy] : {std::array{0, 0}, {1, 0}, {0, 1}, {1, 1}}) {
    const float depth = depth_[TexelIndex(ix + dx, iy + dy, kCellsAcross)];
    const float u = x - static_cast<float>(ix), v = y - static_cast<float>(iy);
    const float weight = depth > 0 ? (dx == 1 ? u : 1 - u) * (dy == 1 ? v : 1 - v) : 0;
    sum += weight * depth;
    weights += weight;
  }
  return weights > 0 ? sum / weights : 0;
}

void ToolShadow::AppendRibbon(const Laparoscope& scope, const ToolDescription& tool, const ToolSample& sample) {
  struct Section {
    Vec3f ray;                        // From the light to the axis, camera frame.
    float behind_tip, radius, depth;  // [m]
  };
  std::array<Section, kSamples> sections;
  const Mat3f turn = scope.view.block<3, 3>(0, 0);
  const Vec3f light = LightPlace(scope);
  const Vec3f tip = turn * sample.p_WT + scope.view.block<3, 1>(0, 3);
  const Vec3f back = -(turn * (sample.q_WT * Vec3f::UnitZ()));
  for (int k = 0; k < kSamples; ++k) {
    const float share = static_cast<float>(k) / (kSamples - 1);
    const float behind_tip_m = std::min(kLength, tool.shaft_length_m) * (0.35f * share + 0.65f * share * share);
    Section& section = sections[static_cast<std::size_t>(k)];
    section.behind_tip = behind_tip_m;
    section.ray = tip + behind_tip_m * back - light;
    section.radius = RadiusAt(tool, behind_tip_m);
    section.depth = section.ray.z() < 0 ? DepthAt(section.ray.head<2>() / -section.ray.z()) : 0;
  }
  const auto first = static_cast<Index>(positions_.size());
  for (std::size_t k = 0; k < kSamples; ++k) {
    const Section& here = sections[k];
    const Section &before = sections[k > 0 ? k - 1 : 0], &after = sections[std::min<std::size_t>(k + 1, kSamples - 1)];
    // Averaging with the neighbours smooths the steps of the coarse cells.
    const bool known = before.depth > 0 && here.depth > 0 && after.depth > 0;
    const float depth = known ? 0.25f * before.depth + 0.5f * here.depth + 0.25f * after.depth : -here.ray.z();
    const float magnified = depth / -here.ray.z();
    const float height = depth + here.ray.z();
    const Vec3f place = light + magnified * here.ray;
    const Vec3f across = (after.ray / -after.ray.z() - before.ray / -before.ray.z()).cross(place).normalized();
    // The tip's end is round and soft.
    const float end = std::min(1.0f, here.behind_tip / kTipEnd);
    const float core = magnified * here.radius * std::sqrt(end),
                penumbra = kLeastPenumbra + kPenumbra * std::max(0.0f, height);
    const float share = static_cast<float>(k) / (kSamples - 1);
    // The opacity is 0 where the depth of the tissue is unknown or the instrument penetrates it; the ends fade out.
    const float opacity = known && here.ray.z() < 0
                              ? kDarkest * std::min(1.0f, core / penumbra) * kFade / (kFade + std::max(0.0f, height)) *
                                    SmoothStep(-here.radius, 0.5f * here.radius, height) *
                                    SmoothStep(1.0f, 0.8f, share) * SmoothStep(0.0f, 1.0f, end)
                              : 0.0f;
    const float half_width = core + penumbra;
    const float in_front = std::clamp(0.7f * height, 0.0005f, 0.004f);
    for (const float side : {-1.0f, 1.0f}) {
      positions_.push_back(turn.transpose() * (place + side * half_width * across - scope.view.block<3, 1>(0, 3)));
      coordinates_.push_back({side, std::min(1.0f, 2 * penumbra / half_width), opacity, in_front});
    }
    if (k > 0) {
      const Index a = first + 2 * static_cast<Index>(k - 1);
      triangles_.push_back({a, a + 1, a + 3});
      triangles_.push_back({a, a + 3, a + 2});
    }
  }
}

}  // namespace fulcrum::render
