// Triangles seen in parallel projection, drawn into a box of a canvas with hidden surfaces removed.
#pragma once

#include <span>
#include <string_view>
#include <vector>

#include "services/base/core/types.h"
#include "services/base/picture/canvas.h"

namespace fulcrum::picture {

class SolidView {
 public:
  /// @param x0, y0, x1, y1 the box [pixels]. @param centre the point in its middle [m]. @param right, up unit vectors
  /// across the line of sight. @param pixel_m size of a pixel.
  SolidView(int x0, int y0, int x1, int y1, const Vec3d& centre, const Vec3d& right, const Vec3d& up, double pixel_m,
            Canvas* canvas);

  /// Shaded by a light beside the eye. @param both_sides also draw triangles that face away.
  void Solid(std::span<const Vec3d> vertices, std::span<const Triangle> triangles, const Rgb& colour, bool both_sides);
  /// Where nothing drawn so far lies more than `slack_m` in front of it.
  void Line(const Vec3d& from, const Vec3d& to, double width, const Rgb& colour, double slack_m);
  /// Over everything.
  void Ring(const Vec3d& centre, double radius_px, const Rgb& colour);
  void Label(std::string_view text, const Rgb& colour);
  /// A bar of 1, 2 or 5 times a power of ten millimetres, with its length.
  void Scale(const Rgb& colour);

 private:
  /// Pixel coordinates and distance towards the eye [m].
  [[nodiscard]] Vec3d Project(const Vec3d& p) const;
  double& Depth(int x, int y) {
    return depth_[static_cast<std::size_t>(y - y0_) * static_cast<std::size_t>(x1_ - x0_) +
                  static_cast<std::size_t>(x - x0_)];
  }

  int x0_, y0_, x1_, y1_;
  Vec3d centre_, right_, up_, eye_;
  double pixel_m_;
  Canvas* canvas_;
  std::vector<double> depth_;
};

}  // namespace fulcrum::picture
