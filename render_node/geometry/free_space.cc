#include "render_node/geometry/free_space.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "services/base/core/breathing.h"

namespace fulcrum::render {
namespace {

constexpr float kSpacing_m = 0.012f;  // Of the nodes; a loop of bowel is more than twice as wide.
constexpr float kMostHalf_m = 0.17f;  // Of the box: what is farther from the scope's target is dark.
constexpr float kSample_m = 0.008f;   // Between points on a fixed surface.
constexpr float kFar_m = 1.0f;        // From everything.
constexpr float kCell_m = 0.005f;     // Tissue and lines are known by such cells.
constexpr float kHalfDiagonal_m = 0.87f * kCell_m;
constexpr float kRoundTrocars_m = 0.02f;

/// Calls `add` for points on a triangle, at most `spacing` from each other.
template <class Add>
void SampleTriangle(const std::array<Vec3f, 3>& corners, float spacing, const Add& add) {
  const auto& [a, b, c] = corners;
  const float edge = std::sqrt(std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()}));
  const int n = std::max(1, static_cast<int>(std::ceil(edge / spacing)));
  for (int i = 0; i < n; ++i) {
    for (int k = 0; i + k < n; ++k) {
      const float u = (static_cast<float>(i) + 1.0f / 3) / static_cast<float>(n);
      const float v = (static_cast<float>(k) + 1.0f / 3) / static_cast<float>(n);
      add(Vec3f(a + u * (b - a) + v * (c - a)));
    }
  }
}

/// Half of a node's 26 neighbours.
constexpr std::array<std::array<int, 3>, 13> kBefore{{{1, 0, 0},
                                                      {1, 1, 0},
                                                      {0, 1, 0},
                                                      {-1, 1, 0},
                                                      {1, 1, 1},
                                                      {0, 1, 1},
                                                      {-1, 1, 1},
                                                      {1, 0, 1},
                                                      {0, 0, 1},
                                                      {-1, 0, 1},
                                                      {1, -1, 1},
                                                      {0, -1, 1},
                                                      {-1, -1, 1}}};

}  // namespace

Cavity CavityOf(const SceneView& scene) {
  Cavity cavity{scene.render.scope_target_W, (scene.render.scope_tip_W - scene.render.scope_target_W).norm()};
  for (const auto& points : {scene.rest_position, scene.static_vertices}) {
    for (const Vec3f& p : points) cavity.radius = std::max(cavity.radius, (p - cavity.centre).norm());
  }
  // The trocars lead through the wall.
  for (const ToolDescription& tool : scene.tools) {
    if (tool.kind == ToolKind::kNone) continue;
    cavity.radius = std::max(cavity.radius, (tool.p_WP - cavity.centre).norm() + kRoundTrocars_m);
  }
  cavity.radius += scene.breathing.amplitude_m;
  cavity.radius *= 1.02f;  // Slightly larger, so that its facets also lie outside.
  return cavity;
}

GridField::GridField(const Vec3f& centre, float half, float spacing, float value)
    : low_(centre.array() - half),
      spacing_(spacing),
      count_(2 + static_cast<int>(2 * half / spacing)),
      values_(static_cast<std::size_t>(count_) * count_ * count_, value) {}

float GridField::At(const Vec3f& p, float outside) const {
  const Vec3f f = (p - low_) / spacing_;
  if (!(f.minCoeff() >= 1) || f.maxCoeff() >= static_cast<float>(count_ - 2)) return outside;
  const int x = static_cast<int>(f.x()), y = static_cast<int>(f.y()), z = static_cast<int>(f.z());
  const Vec3f t = f - Vec3f(static_cast<float>(x), static_cast<float>(y), static_cast<float>(z));
  const auto row = static_cast<std::size_t>(count_), layer = row * row;
  const float* v = values_.data() + static_cast<std::size_t>(z) * layer + static_cast<std::size_t>(y) * row + x;
  const auto along_x = [&](const float* at) { return at[0] + t.x() * (at[1] - at[0]); };
  const auto along_y = [&](const float* at) {
    const float low = along_x(at);
    return low + t.y() * (along_x(at + row) - low);
  };
  const float low = along_y(v);
  return low + t.z() * (along_y(v + layer) - low);
}

void GridField::Lower(const Vec3f& p, float reach, float margin) {
  const Vec3f f = (p - low_) / spacing_;
  const float r = reach / spacing_, most = static_cast<float>(count_ - 1);
  std::array<int, 3> from{}, to{};
  for (int k = 0; k < 3; ++k) {
    const auto i = static_cast<std::size_t>(k);
    if (f[k] + r < 0 || f[k] - r > most) return;
    from[i] = static_cast<int>(std::ceil(std::max(0.0f, f[k] - r)));
    to[i] = static_cast<int>(std::min(most, f[k] + r));
  }
  for (int z = from[2]; z <= to[2]; ++z) {
    const float dz = static_cast<float>(z) - f.z();
    for (int y = from[1]; y <= to[1]; ++y) {
      const float dy = static_cast<float>(y) - f.y(), aside = dz * dz + dy * dy;
      float* row = values_.data() + (static_cast<std::size_t>(z) * count_ + static_cast<std::size_t>(y)) * count_;
      for (int x = from[0]; x <= to[0]; ++x) {
        const float dx = static_cast<float>(x) - f.x();
        row[x] = std::min(row[x], spacing_ * std::sqrt(aside + dx * dx) - margin);
      }
    }
  }
}

void GridField::LowerAll(std::span<const Eigen::Vector4f> points) {
  constexpr std::uint32_t kNone = ~std::uint32_t{0};
  const int n = count_;
  std::vector<std::uint32_t> nearest(values_.size(), kNone);
  const auto offer = [&](std::size_t node, int x, int y, int z, std::uint32_t point) {
    const Eigen::Vector4f& p = points[point];
    const float dx = low_.x() + spacing_ * static_cast<float>(x) - p.x();
    const float dy = low_.y() + spacing_ * static_cast<float>(y) - p.y();
    const float dz = low_.z() + spacing_ * static_cast<float>(z) - p.z();
    const float value = std::sqrt(dx * dx + dy * dy + dz * dz) - p.w();
    if (value < values_[node]) {
      values_[node] = value;
      nearest[node] = point;
    }
  };
  for (std::uint32_t point = 0; point < points.size(); ++point) {
    const Vec3f f = (points[point].head<3>() - low_) / spacing_;
    if (!(f.minCoeff() >= 0) || f.maxCoeff() >= static_cast<float>(n - 1)) continue;
    const int x = static_cast<int>(f.x()), y = static_cast<int>(f.y()), z = static_cast<int>(f.z());
    for (int corner = 0; corner < 8; ++corner) {
      const int i = x + (corner & 1), j = y + (corner >> 1 & 1), k = z + (corner >> 2);
      offer((static_cast<std::size_t>(k) * n + static_cast<std::size_t>(j)) * n + static_cast<std::size_t>(i), i, j, k,
            point);
    }
  }
  const auto row = static_cast<std::ptrdiff_t>(n), layer = row * row;
  std::array<std::ptrdiff_t, kBefore.size()> before;
  for (std::size_t k = 0; k < before.size(); ++k) {
    before[k] = kBefore[k][0] + kBefore[k][1] * row + kBefore[k][2] * layer;
  }
  // Each node asks its neighbours whose point is nearest: those before it in one sweep, those behind it in the other.
  for (const int way : {1, -1}) {
    const int first = way > 0 ? 1 : n - 2;
    for (int z = first; z > 0 && z < n - 1; z += way) {
      for (int y = first; y > 0 && y < n - 1; y += way) {
        for (int x = first; x > 0 && x < n - 1; x += way) {
          const std::ptrdiff_t node = x + y * row + z * layer;
          std::uint32_t last = nearest[static_cast<std::size_t>(node)];
          for (const std::ptrdiff_t step : before) {
            const std::uint32_t point = nearest[static_cast<std::size_t>(node - way * step)];
            if (point == kNone || point == last) continue;
            offer(static_cast<std::size_t>(node), x, y, z, point);
            last = point;
          }
        }
      }
    }
  }
}

Vec3f GridField::NodeAt(std::size_t node) const {
  const auto n = static_cast<std::size_t>(count_);
  const std::size_t x = node % n, y = node / n % n, z = node / n / n;
  return low_ + spacing_ * Vec3f(static_cast<float>(x), static_cast<float>(y), static_cast<float>(z));
}

std::size_t GridField::NearestNode(const Vec3f& p) const {
  const Vec3f f = ((p - low_) / spacing_).array() + 0.5f;
  if (!(f.minCoeff() >= 0) || f.maxCoeff() >= static_cast<float>(count_)) return size();
  const auto n = static_cast<std::size_t>(count_);
  return (static_cast<std::size_t>(f.z()) * n + static_cast<std::size_t>(f.y())) * n + static_cast<std::size_t>(f.x());
}

FreeSpace::FreeSpace(const SceneView& scene) : cavity_(CavityOf(scene)), scope_tip_(scene.render.scope_tip_W) {
  nearest_ = (scene.render.scope_target_W - scope_tip_).norm();
  walls_ = GridField(cavity_.centre, std::min(cavity_.radius, kMostHalf_m), kSpacing_m, kFar_m);
  kept_ = MakeField(kFar_m);
  hiding_.assign(walls_.size(), 0);
  AddWalls(scene);
  KeepClear(scene);
}

GridField FreeSpace::MakeField(float value) const {
  return {cavity_.centre, std::min(cavity_.radius, kMostHalf_m), kSpacing_m, value};
}

void FreeSpace::AddWalls(const SceneView& scene) {
  std::vector<Eigen::Vector4f> points;
  for (const StaticSurface& surface : scene.static_surfaces) {
    const bool breathes = scene.breathing.amplitude_m > 0 && Breathes(surface.role);
    const Vec3f out = breathes ? Vec3f(scene.breathing.amplitude_m * scene.breathing.direction) : Vec3f::Zero();
    for (Index k = 0; k < surface.triangle_count; ++k) {
      const Triangle& t = scene.static_triangles[surface.first_triangle + k];
      const std::array<Vec3f, 3> corners{scene.static_vertices[t[0]], scene.static_vertices[t[1]],
                                         scene.static_vertices[t[2]]};
      const Vec3f normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
      const bool faces = normal.dot(scope_tip_ - corners[0]) > 0;
      SampleTriangle(corners, kSample_m, [&](const Vec3f& p) {
        const std::size_t node = walls_.NearestNode(p);
        if (node == walls_.size()) return;
        if (faces) hiding_[node] = 1;
        for (const float share : {0.0f, 0.5f, 1.0f}) {
          points.emplace_back(0, 0, 0, 0).head<3>() = p + share * out;
          if (!breathes) break;
        }
      });
    }
  }
  walls_.LowerAll(points);
}

void FreeSpace::KeepClear(const SceneView& scene) {
  std::vector<Vec3f> origins{scope_tip_};
  for (const ToolDescription& tool : scene.tools) {
    if (tool.kind != ToolKind::kNone) origins.push_back(tool.p_WP);
  }
  // One point, the middle of a cell, for all places in it.
  const float half = std::min(cavity_.radius, kMostHalf_m);
  const Vec3f low = cavity_.centre.array() - half;
  const int count = 1 + static_cast<int>(2 * half / kCell_m);
  std::vector<Eigen::Vector4f> points;
  std::vector<std::uint8_t> known;
  const auto keep_from = [&](const Vec3f& p, float distance) {
    const Vec3f f = (p - low) / kCell_m;
    if (!(f.minCoeff() >= 0) || f.maxCoeff() >= static_cast<float>(count)) return;
    const int x = static_cast<int>(f.x()), y = static_cast<int>(f.y()), z = static_cast<int>(f.z());
    std::uint8_t& cell = known[(static_cast<std::size_t>(z) * count + static_cast<std::size_t>(y)) * count + x];
    if (std::exchange(cell, 1)) return;
    points.emplace_back(0, 0, 0, distance + kHalfDiagonal_m).head<3>() =
        low + kCell_m * Vec3f(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f, static_cast<float>(z) + 0.5f);
  };
  known.assign(static_cast<std::size_t>(count) * count * count, 0);
  for (const Vec3f& p : scene.rest_position) keep_from(p, kToTissue_m);
  for (const ScriptKey& key : scene.script) keep_from(key.p_W, kToTissue_m);
  if (points.empty()) return;
  Vec3f middle = Vec3f::Zero();
  const std::size_t places = points.size();
  for (const Eigen::Vector4f& point : points) middle += point.head<3>() / static_cast<float>(places);
  up_ = Vec3f::Zero();
  for (const Vec3f& origin : origins) up_ += (origin - middle).normalized();
  up_.normalize();
  std::fill(known.begin(), known.end(), std::uint8_t{0});
  std::vector<std::uint8_t> ended(kept_.size(), 0);  // One line to each node.
  for (std::size_t i = 0; i < places; ++i) {
    const Vec3f place = points[i].head<3>();
    const std::size_t node = kept_.NearestNode(place);
    if (node == kept_.size() || std::exchange(ended[node], 1)) continue;
    for (const Vec3f& origin : origins) {
      const int steps = 1 + static_cast<int>((place - origin).norm() / (0.8f * kCell_m));
      for (int k = 0; k < steps; ++k) {
        keep_from(origin + (static_cast<float>(k) / static_cast<float>(steps)) * (place - origin), kToLines_m);
      }
    }
  }
  kept_.LowerAll(points);
}

float FreeSpace::ToWalls(const Vec3f& p) const {
  const float to_cavity = 0.995f * cavity_.radius - (p - cavity_.centre).norm();
  return std::min(walls_.At(p, 0), to_cavity);
}

float FreeSpace::Room(const Vec3f& p) const {
  const float behind = (p - scope_tip_).norm() - nearest_;
  return std::min({ToWalls(p) - kToWalls_m, kept_.At(p, -1), behind});
}

bool FreeSpace::Seen(const Vec3f& p) const {
  const Vec3f way = p - scope_tip_;
  const float length = way.norm(), step = 0.5f * kSpacing_m;
  for (float at = 0.02f; at < length - 3 * kSpacing_m; at += step) {
    const std::size_t node = walls_.NearestNode(scope_tip_ + (at / length) * way);
    if (node < hiding_.size() && hiding_[node]) return false;
  }
  return true;
}

}  // namespace fulcrum::render
