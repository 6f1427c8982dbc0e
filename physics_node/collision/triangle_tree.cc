#include "physics_node/collision/triangle_tree.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

#include "physics_node/collision/closest.h"
#include "physics_node/simd/limits.h"

namespace fulcrum::physics {
namespace {

/// Most triangles in a leaf: below it boxes cost as much as triangles. Assumed.
constexpr Index kMaxInLeaf = 4;
/// Entries of the stack: halving 2^32 triangles gives at most 32 levels with two open nodes each.
constexpr std::size_t kMaxDepth = 64;

}  // namespace

TriangleTree::TriangleTree(std::vector<std::array<Vec3f, 3>> triangles) : triangles_(std::move(triangles)) {
  if (triangles_.empty()) {
    return;
  }
  for (const auto& t : triangles_) {
    const Vec3f normal = (t[1] - t[0]).cross(t[2] - t[0]);
    const float area = normal.norm();
    normals_.push_back(area > 0.0f ? Vec3f(normal / area) : Vec3f(Vec3f::Zero()));
  }
  order_.resize(triangles_.size());
  std::iota(order_.begin(), order_.end(), 0u);
  nodes_.reserve(2 * triangles_.size());
  nodes_.emplace_back();
  Build(0, 0, static_cast<Index>(triangles_.size()));
}

void TriangleTree::Build(Index node, Index first, Index last) {
  Vec3f low = Vec3f::Constant(kLargestFinite), high = Vec3f::Constant(-kLargestFinite);
  for (Index i = first; i < last; ++i) {
    for (const Vec3f& p : triangles_[order_[i]]) {
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
  }
  nodes_[node].low = F4{low.x(), low.y(), low.z(), 0};
  nodes_[node].high = F4{high.x(), high.y(), high.z(), 0};
  if (last - first <= kMaxInLeaf) {
    nodes_[node].first = first;
    nodes_[node].count = last - first;
    return;
  }
  Eigen::Index axis = 0;
  (high - low).maxCoeff(&axis);
  const Index middle = first + (last - first) / 2;
  const auto place = [&](Index t) { return triangles_[t][0][axis] + triangles_[t][1][axis] + triangles_[t][2][axis]; };
  std::nth_element(order_.begin() + first, order_.begin() + middle, order_.begin() + last,
                   [&](Index s, Index t) { return std::pair(place(s), s) < std::pair(place(t), t); });
  const auto left = static_cast<Index>(nodes_.size());
  nodes_[node].first = left;
  nodes_.emplace_back();
  nodes_.emplace_back();
  Build(left, first, middle);
  Build(left + 1, middle, last);
}

inline float TriangleTree::DistanceSq(const F4& p, const Node& box) {
  const F4 zero{}, below = box.low - p, above = p - box.high;
  F4 out = below > above ? below : above;
  out = out > zero ? out : zero;
  out *= out;
  return out[0] + out[1] + out[2];
}

inline void TriangleTree::Try(Index triangle, const Vec3f& p, Hit* hit) const {
  const auto& t = triangles_[triangle];
  const auto b = ClosestOnTriangle(p, t[0], t[1], t[2]);
  const Vec3f point = b[0] * t[0] + b[1] * t[1] + b[2] * t[2];
  const float distance_sq = (p - point).squaredNorm();
  if (distance_sq < hit->distance_sq ||
      (distance_sq == hit->distance_sq && (hit->triangle == kNoIndex || triangle < hit->triangle))) {
    *hit = {triangle, point, distance_sq};
  }
}

TriangleTree::Hit TriangleTree::Nearest(const Vec3f& p, float range, Index guess) const {
  Hit hit;
  hit.distance_sq = range * range;
  if (nodes_.empty()) {
    return hit;
  }
  if (guess != kNoIndex) {
    Try(guess, p, &hit);
  }
  const F4 from{p.x(), p.y(), p.z(), 0};
  struct Waiting {
    Index node;
    float distance_sq;
  };
  std::array<Waiting, kMaxDepth> stack;
  std::size_t depth = 0;
  stack[depth++] = {0, 0.0f};
  while (depth > 0) {
    const Waiting next = stack[--depth];
    if (next.distance_sq > hit.distance_sq) {
      continue;
    }
    const Node& node = nodes_[next.node];
    if (node.count == 0) {
      Waiting near{node.first, DistanceSq(from, nodes_[node.first])};
      Waiting far{node.first + 1, DistanceSq(from, nodes_[node.first + 1])};
      if (far.distance_sq < near.distance_sq) {
        std::swap(near, far);
      }
      stack[depth++] = far;
      stack[depth++] = near;
      continue;
    }
    for (Index i = node.first; i < node.first + node.count; ++i) {
      Try(order_[i], p, &hit);
    }
  }
  return hit;
}

}  // namespace fulcrum::physics
