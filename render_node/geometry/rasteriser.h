// Which triangle a pixel of an ideal picture shows, in double precision: the ground truth that belongs to a drawn
// picture. Pure.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <vector>

#include "render_node/geometry/laparoscope.h"

namespace fulcrum::render {

/// Pinhole camera of a round picture. Pixel (x, y), counted from the lower left, has its centre at (x + 0.5, y + 0.5).
struct Pinhole {
  int width = 0, height = 0;
  double focal = 1;                                         ///< [pixels]
  double centre_x = 0, centre_y = 0;                        ///< [pixels]
  double radius = std::numeric_limits<double>::infinity();  ///< Of the round field [pixels].
  double near_m = 0.004;                                    ///< What is nearer is not drawn.

  /// Place [pixels] of a point of the camera frame that lies ahead.
  [[nodiscard]] Vec2d Project(const Vec3d& p) const {
    return {centre_x - focal * p.x() / p.z(), centre_y - focal * p.y() / p.z()};
  }
  [[nodiscard]] bool Shows(const Vec2d& pixel) const;
};
[[nodiscard]] Pinhole PinholeOf(const Laparoscope& scope, int width, int height);

/// What a pixel shows.
struct Hit {
  std::int32_t surface = -1;  ///< -1: nothing.
  std::uint32_t triangle = 0;
  float b1 = 0, b2 = 0;  ///< Barycentric coordinates of the triangle's second and third corner.
  float depth_m = 0;     ///< Along the optical axis.
  [[nodiscard]] bool any() const { return surface >= 0; }
};

struct RasterOptions {
  double behind_m = 0;     ///< Distance added in the comparison with other surfaces, not to the depth.
  bool cull_back = false;  ///< Triangles that are clockwise in the picture are not shown.
  /// Whether a place of a triangle is shown; empty: all are.
  std::function<bool(std::uint32_t triangle, float b1, float b2)> shown = {};
};

class Rasteriser {
 public:
  explicit Rasteriser(const Pinhole& camera);

  /// @param positions corners in the camera frame (x right, y up, looking along -z) [m].
  void Add(std::int32_t surface, std::span<const Vec3d> positions, std::span<const Triangle> triangles,
           const RasterOptions& options);

  [[nodiscard]] const Pinhole& camera() const { return camera_; }
  /// Row by row from the bottom.
  [[nodiscard]] const std::vector<Hit>& hits() const { return hits_; }
  [[nodiscard]] const Hit& At(int x, int y) const {
    return hits_[static_cast<std::size_t>(y) * static_cast<std::size_t>(camera_.width) + static_cast<std::size_t>(x)];
  }

 private:
  void AddTriangle(std::int32_t surface, std::uint32_t index, const Eigen::Matrix3d& corners,
                   const RasterOptions& options);

  Pinhole camera_;
  std::vector<Hit> hits_;
  std::vector<double> order_;  // Depth for the comparison.
};

}  // namespace fulcrum::render
