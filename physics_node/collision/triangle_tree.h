// Nearest triangle of a surface that does not deform: a binary tree of boxes, built once by halving at the median of
// the longest axis. The search visits a box, nearer child first, while
//
//   sum over the axes of max(lo - p, p - hi, 0)^2 <= squared distance of the best triangle so far [m^2]
#pragma once

#include <span>
#include <vector>

#include "services/base/core/types.h"

namespace fulcrum::physics {

class TriangleTree {
 public:
  struct Hit {
    Index triangle = kNoIndex;  ///< Of those given; kNoIndex: none within range.
    Vec3f point = Vec3f::Zero();
    float distance_sq = 0;  ///< [m^2]
  };

  TriangleTree() = default;
  /// Corners of each triangle [m]. Degenerate ones are allowed and have a zero normal.
  explicit TriangleTree(std::vector<std::array<Vec3f, 3>> triangles);

  [[nodiscard]] bool empty() const { return nodes_.empty(); }
  /// The nearest triangle to `p` within `range` [m]; of equally near ones that with the least index. `guess`: a
  /// triangle that is probably near, such as the last result, which shortens the search; kNoIndex: none.
  [[nodiscard]] Hit Nearest(const Vec3f& p, float range, Index guess = kNoIndex) const;
  /// Unit normal, counter-clockwise.
  [[nodiscard]] const Vec3f& normal(Index triangle) const { return normals_[triangle]; }

 private:
  using F4 = float __attribute__((vector_size(16)));  ///< A point; the last lane is 0.
  struct Node {
    F4 low, high;
    Index first = 0;  ///< Leaf: of order_; else left child, the right one follows it.
    Index count = 0;  ///< 0: inner node.
  };
  void Build(Index node, Index first, Index last);
  [[nodiscard]] static float DistanceSq(const F4& p, const Node& box);
  /// Replaces `hit` by the triangle if that is nearer.
  void Try(Index triangle, const Vec3f& p, Hit* hit) const;

  std::vector<std::array<Vec3f, 3>> triangles_;
  std::vector<Vec3f> normals_;
  std::vector<Index> order_;
  std::vector<Node> nodes_;
};

}  // namespace fulcrum::physics
