#include "render_node/geometry/field_of_view.h"

#include <algorithm>
#include <cmath>

namespace fulcrum::render {
namespace {

Eigen::Matrix4f PlanesOf(const Laparoscope& scope) {
  const Eigen::Matrix4f to_clip = scope.projection * scope.view;
  Eigen::Matrix4f planes;
  for (int axis = 0; axis < 2; ++axis) {
    const float reach = std::min(1.0f, scope.circle_radius / scope.picture_centre[axis]);
    planes.row(2 * axis) = to_clip.row(axis) - reach * to_clip.row(3);
    planes.row(2 * axis + 1) = -to_clip.row(axis) - reach * to_clip.row(3);
  }
  return planes;
}

}  // namespace

FieldOfView::FieldOfView(std::span<const Laparoscope> eyes) : stereo_(eyes.size() > 1) {
  const Eigen::Matrix4f left = PlanesOf(eyes.front()), right = PlanesOf(eyes.back());
  const Vec3f left_W = EyeOf(eyes.front()), right_W = EyeOf(eyes.back());
  planes_ = 0.5f * (left + right);
  apart_ = 0.5f * (right - left).row(0).transpose();
  eye_W_ = 0.5f * (left_W + right_W);
  half_W_ = 0.5f * (right_W - left_W);
}

bool FieldOfView::Find(std::span<const Vec3f> positions, std::span<const Triangle> triangles, Sides sides,
                       std::vector<Triangle>* seen, std::span<std::size_t> ends) {
  beyond_.resize(positions.size());
  for (std::size_t i = 0; i < positions.size(); ++i) {
    Eigen::Vector4f distance = planes_.leftCols<3>() * positions[i] + planes_.col(3);
    // Of the two eyes' distances from an edge the smaller one.
    if (stereo_) distance.head<2>().array() -= std::abs(apart_.head<3>().dot(positions[i]) + apart_[3]);
    beyond_[i] = static_cast<std::uint8_t>((distance[0] > 0 ? 1 : 0) | (distance[1] > 0 ? 2 : 0) |
                                           (distance[2] > 0 ? 4 : 0) | (distance[3] > 0 ? 8 : 0));
  }
  found_.clear();
  found_.reserve(triangles.size());
  std::size_t run = 0;
  const auto end_runs = [&](std::size_t at) {
    for (; run < ends.size() && ends[run] <= at; ++run) ends[run] = found_.size();
  };
  for (std::size_t k = 0; k < triangles.size(); ++k) {
    end_runs(k);
    const Triangle& t = triangles[k];
    if ((beyond_[t[0]] & beyond_[t[1]] & beyond_[t[2]]) != 0) {
      continue;
    }
    if (sides == Sides::kFront) {
      const Vec3f& a = positions[t[0]];
      const Vec3f normal = (positions[t[1]] - a).cross(positions[t[2]] - a);
      if (normal.dot(eye_W_ - a) + std::abs(normal.dot(half_W_)) <= 0) {
        continue;
      }
    }
    found_.push_back(t);
  }
  end_runs(triangles.size());
  if (found_ == *seen) {
    return false;
  }
  std::swap(found_, *seen);
  return true;
}

}  // namespace fulcrum::render
