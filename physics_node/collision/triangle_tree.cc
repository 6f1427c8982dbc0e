#include "physics_node/collision/triangle_tree.h"

#include <algorithm>
#include <array>
#include <numeric>

#include "physics_node/collision/closest.h"

namespace fulcrum::physics {
namespace {

constexpr Index kLeafSize = 4;
/// Deeper than any tree of 2^32 triangles halved at each node.
constexpr std::size_t kMaxDepth = 64;

float DistanceSqToBox(const Vec3f& p, const Vec3f& low, const Vec3f& high) {
  return (p - p.cwiseMax(low).cwiseMin(high)).squaredNorm();
}

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
  Vec3f low = Vec3f::Constant(3e38f), high = Vec3f::Constant(-3e38f);
  for (Index i = first; i < last; ++i) {
    for (const Vec3f& p : triangles_[order_[i]]) {
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
  }
  nodes_[node].low = low;
  nodes_[node].high = high;
  if (last - first <= kLeafSize) {
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

TriangleTree::Hit TriangleTree::Nearest(const Vec3f& p, float range) const {
  Hit hit;
  hit.distance_sq = range * range;
  if (nodes_.empty()) {
    return hit;
  }
  std::array<Index, kMaxDepth> stack;
  std::size_t depth = 0;
  stack[depth++] = 0;
  while (depth > 0) {
    const Node& node = nodes_[stack[--depth]];
    if (DistanceSqToBox(p, node.low, node.high) > hit.distance_sq) {
      continue;
    }
    if (node.count == 0) {
      const Node &left = nodes_[node.first], &right = nodes_[node.first + 1];
      const bool left_first = DistanceSqToBox(p, left.low, left.high) <= DistanceSqToBox(p, right.low, right.high);
      stack[depth++] = left_first ? node.first + 1 : node.first;
      stack[depth++] = left_first ? node.first : node.first + 1;
      continue;
    }
    for (Index i = node.first; i < node.first + node.count; ++i) {
      const auto& t = triangles_[order_[i]];
      const auto b = ClosestOnTriangle(p, t[0], t[1], t[2]);
      const Vec3f point = b[0] * t[0] + b[1] * t[1] + b[2] * t[2];
      const float distance_sq = (p - point).squaredNorm();
      if (distance_sq < hit.distance_sq ||
          (distance_sq == hit.distance_sq && (hit.triangle == kNoIndex || order_[i] < hit.triangle))) {
        hit = {order_[i], point, distance_sq};
      }
    }
  }
  return hit;
}

}  // namespace fulcrum::physics
