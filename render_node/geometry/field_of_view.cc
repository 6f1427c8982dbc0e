#include "render_node/geometry/field_of_view.h"

#include <algorithm>

namespace fulcrum::render {

FieldOfView::FieldOfView(const Laparoscope& scope) {
  const Eigen::Matrix4f to_clip = scope.projection * scope.view;
  for (int axis = 0; axis < 2; ++axis) {
    const float reach = std::min(1.0f, scope.circle_radius / scope.picture_centre[axis]);
    planes_.row(2 * axis) = to_clip.row(axis) - reach * to_clip.row(3);
    planes_.row(2 * axis + 1) = -to_clip.row(axis) - reach * to_clip.row(3);
  }
  eye_W_ = -scope.view.block<3, 3>(0, 0).transpose() * scope.view.block<3, 1>(0, 3);
}

bool FieldOfView::Find(std::span<const Vec3f> positions, std::span<const Triangle> triangles, Sides sides,
                       std::vector<Triangle>* seen) {
  beyond_.resize(positions.size());
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const Eigen::Vector4f distance = planes_.leftCols<3>() * positions[i] + planes_.col(3);
    beyond_[i] = static_cast<std::uint8_t>((distance[0] > 0 ? 1 : 0) | (distance[1] > 0 ? 2 : 0) |
                                           (distance[2] > 0 ? 4 : 0) | (distance[3] > 0 ? 8 : 0));
  }
  found_.clear();
  found_.reserve(triangles.size());
  for (const Triangle& t : triangles) {
    if ((beyond_[t[0]] & beyond_[t[1]] & beyond_[t[2]]) != 0) {
      continue;
    }
    if (sides == Sides::kFront) {
      const Vec3f& a = positions[t[0]];
      if ((positions[t[1]] - a).cross(positions[t[2]] - a).dot(eye_W_ - a) <= 0) {
        continue;
      }
    }
    found_.push_back(t);
  }
  if (found_ == *seen) {
    return false;
  }
  std::swap(found_, *seen);
  return true;
}

}  // namespace fulcrum::render
