#include "render_node/geometry/rasteriser.h"

#include <algorithm>
#include <cmath>

namespace fulcrum::render {
namespace {

struct Range {
  int begin, end;  // Half open.
};

/// Pixels whose centres lie in [low, high].
Range Pixels(double low, double high, int count) {
  const double begin = std::clamp(std::ceil(low - 0.5), 0.0, static_cast<double>(count));
  const double end = std::clamp(std::floor(high - 0.5) + 1, 0.0, static_cast<double>(count));
  return {static_cast<int>(begin), static_cast<int>(end)};
}

}  // namespace

bool Pinhole::Shows(const Vec2d& pixel) const {
  return pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() < width && pixel.y() < height &&
         (pixel - Vec2d(centre_x, centre_y)).squaredNorm() < radius * radius;
}

Pinhole PinholeOf(const Laparoscope& scope, int width, int height) {
  const double scale = height / (2 * static_cast<double>(scope.picture_centre.y()));
  return {width,       height,       0.5 * height * static_cast<double>(scope.projection(1, 1)),
          0.5 * width, 0.5 * height, scale * static_cast<double>(scope.circle_radius)};
}

Rasteriser::Rasteriser(const Pinhole& camera)
    : camera_(camera),
      hits_(static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height)),
      order_(hits_.size(), std::numeric_limits<double>::infinity()) {}

void Rasteriser::Add(std::int32_t surface, std::span<const Vec3d> positions, std::span<const Triangle> triangles,
                     const RasterOptions& options) {
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    Eigen::Matrix3d corners;
    for (int k = 0; k < 3; ++k) corners.col(k) = positions[triangles[t][static_cast<std::size_t>(k)]];
    if (corners.allFinite()) AddTriangle(surface, t, corners, options);
  }
}

// Homogeneous rasterisation (Olano and Greer 1997): a corner is (x w, y w, w) in pixels, with w its depth. The inverse
// of the matrix of the corners takes a pixel (x, y, 1) to its barycentric coordinates over the depth. A triangle that
// passes the camera needs no clipping.
void Rasteriser::AddTriangle(std::int32_t surface, std::uint32_t index, const Eigen::Matrix3d& corners,
                             const RasterOptions& options) {
  Eigen::Matrix3d pixels;
  for (int k = 0; k < 3; ++k) {
    const double w = -corners(2, k);
    pixels.col(k) = Vec3d(camera_.focal * corners(0, k) + camera_.centre_x * w,
                          camera_.focal * corners(1, k) + camera_.centre_y * w, w);
  }
  const auto w = pixels.row(2);
  if (w.maxCoeff() < camera_.near_m) return;
  Vec2d low(0, 0), high(camera_.width, camera_.height);
  if (w.minCoeff() >= camera_.near_m) {
    const Eigen::Matrix<double, 2, 3> places = pixels.topRows<2>().array().rowwise() / w.array();
    low = places.rowwise().minCoeff();
    high = places.rowwise().maxCoeff();
  }
  const Range rows = Pixels(low.y(), high.y(), camera_.height);
  // Most triangles of a fine mesh lie between the centres of the pixels.
  if (const Range all = Pixels(low.x(), high.x(), camera_.width); rows.begin >= rows.end || all.begin >= all.end)
    return;
  const double turn = pixels.determinant();
  if (turn == 0 || (options.cull_back && turn < 0)) return;
  const Eigen::Matrix3d inverse = pixels.inverse();
  const Vec3d step = inverse.col(0);
  for (int y = rows.begin; y < rows.end; ++y) {
    const double dy = y + 0.5 - camera_.centre_y, half_squared = camera_.radius * camera_.radius - dy * dy;
    if (half_squared <= 0) continue;
    const double half = std::sqrt(half_squared);
    double left = std::max(low.x(), camera_.centre_x - half), right = std::min(high.x(), camera_.centre_x + half);
    // Where all three are positive: each is linear along the row.
    const Vec3d at_0 = inverse * Vec3d(0, y + 0.5, 1);
    for (int k = 0; k < 3; ++k) {
      if (step[k] > 0) left = std::max(left, -at_0[k] / step[k]);
      if (step[k] < 0) right = std::min(right, -at_0[k] / step[k]);
      if (step[k] == 0 && at_0[k] < 0) right = -1;
    }
    const Range columns = Pixels(left, right, camera_.width);
    for (int x = columns.begin; x < columns.end; ++x) {
      const Vec3d over_depth = at_0 + (x + 0.5) * step;
      const double sum = over_depth.sum();
      if (sum <= 0) continue;
      const double depth = 1 / sum;
      if (depth < camera_.near_m) continue;
      const std::size_t pixel =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(camera_.width) + static_cast<std::size_t>(x);
      if (depth >= order_[pixel]) continue;
      const Vec3d share = over_depth * depth;
      const double order = options.behind_m == 0 ? depth : depth * (1 + options.behind_m / (corners * share).norm());
      if (order >= order_[pixel]) continue;
      const auto b1 = static_cast<float>(share[1]), b2 = static_cast<float>(share[2]);
      if (options.shown && !options.shown(index, b1, b2)) continue;
      order_[pixel] = order;
      hits_[pixel] = {surface, index, b1, b2, static_cast<float>(depth)};
    }
  }
}

}  // namespace fulcrum::render
