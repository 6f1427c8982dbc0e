#include "services/base/picture/solid_view.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>

namespace fulcrum::picture {
namespace {

constexpr double kShade = 0.45;  ///< Brightness of what is seen on edge.
constexpr int kMargin = 12;

}  // namespace

SolidView::SolidView(int x0, int y0, int x1, int y1, const Vec3d& centre, const Vec3d& right, const Vec3d& up,
                     double pixel_m, Canvas* canvas)
    : x0_(x0),
      y0_(y0),
      x1_(x1),
      y1_(y1),
      centre_(centre),
      right_(right),
      up_(up),
      eye_(right.cross(up)),
      pixel_m_(pixel_m),
      canvas_(canvas),
      depth_(static_cast<std::size_t>(x1 - x0) * static_cast<std::size_t>(y1 - y0),
             -std::numeric_limits<double>::infinity()) {}

Vec3d SolidView::Project(const Vec3d& p) const {
  const Vec3d q = p - centre_;
  return {0.5 * (x0_ + x1_) + right_.dot(q) / pixel_m_, 0.5 * (y0_ + y1_) - up_.dot(q) / pixel_m_, eye_.dot(q)};
}

void SolidView::Solid(std::span<const Vec3d> vertices, std::span<const Triangle> triangles, const Rgb& colour,
                      bool both_sides) {
  for (const Triangle& t : triangles) {
    const Vec3d a = Project(vertices[t[0]]), b = Project(vertices[t[1]]), c = Project(vertices[t[2]]);
    // Rows of pixels run downwards, so what faces the eye turns clockwise.
    const double area = (b.x() - a.x()) * (c.y() - a.y()) - (c.x() - a.x()) * (b.y() - a.y());
    if (!(std::abs(area) > 1e-12) || (area > 0 && !both_sides)) continue;
    const Vec3d normal = (vertices[t[1]] - vertices[t[0]]).cross(vertices[t[2]] - vertices[t[0]]).normalized();
    const Rgb shaded = Mix({0, 0, 0}, colour, kShade + (1 - kShade) * std::abs(normal.dot(eye_)));
    const auto clamp = [](double value, int low, int high) {
      return static_cast<int>(std::clamp(value, static_cast<double>(low), static_cast<double>(high)));
    };
    const int left = clamp(std::floor(std::min({a.x(), b.x(), c.x()})), x0_, x1_ - 1),
              right = clamp(std::ceil(std::max({a.x(), b.x(), c.x()})), x0_, x1_ - 1),
              top = clamp(std::floor(std::min({a.y(), b.y(), c.y()})), y0_, y1_ - 1),
              bottom = clamp(std::ceil(std::max({a.y(), b.y(), c.y()})), y0_, y1_ - 1);
    for (int y = top; y <= bottom; ++y) {
      for (int x = left; x <= right; ++x) {
        const double v = ((x - a.x()) * (c.y() - a.y()) - (c.x() - a.x()) * (y - a.y())) / area,
                     w = ((b.x() - a.x()) * (y - a.y()) - (x - a.x()) * (b.y() - a.y())) / area;
        if (!(v >= 0 && w >= 0 && v + w <= 1)) continue;
        const double depth = a.z() + v * (b.z() - a.z()) + w * (c.z() - a.z());
        if (depth > Depth(x, y)) {
          Depth(x, y) = depth;
          canvas_->Put(x, y, shaded);
        }
      }
    }
  }
}

void SolidView::Line(const Vec3d& from, const Vec3d& to, double width, const Rgb& colour, double slack_m) {
  const Vec3d a = Project(from), b = Project(to);
  const double length = std::hypot(b.x() - a.x(), b.y() - a.y());
  if (!std::isfinite(length)) return;
  const int steps = std::clamp(static_cast<int>(length) + 1, 1, 8 * (x1_ - x0_ + y1_ - y0_));
  canvas_->Clip(x0_, y0_, x1_, y1_);
  for (int i = 0; i <= steps; ++i) {
    const Vec3d p = a + static_cast<double>(i) / steps * (b - a);
    const auto x = static_cast<int>(std::lround(p.x())), y = static_cast<int>(std::lround(p.y()));
    if (x < x0_ || y < y0_ || x >= x1_ || y >= y1_ || Depth(x, y) > p.z() + slack_m) continue;
    canvas_->Dot({p.x(), p.y()}, 0.5 * width, colour);
  }
  canvas_->Unclip();
}

void SolidView::Ring(const Vec3d& centre, double radius_px, const Rgb& colour) {
  constexpr int kPieces = 48;
  const Vec3d middle = Project(centre);
  const auto at = [&](int i) {
    const double angle = 2 * std::numbers::pi * i / kPieces;
    return Vec2d(middle.x() + radius_px * std::cos(angle), middle.y() + radius_px * std::sin(angle));
  };
  canvas_->Clip(x0_, y0_, x1_, y1_);
  for (int i = 0; i < kPieces; ++i) canvas_->Line(at(i), at(i + 1), 3, colour);
  canvas_->Unclip();
}

void SolidView::Label(std::string_view text, const Rgb& colour) {
  canvas_->Text(x0_ + kMargin, y0_ + kMargin, text, colour);
}

void SolidView::Scale(const Rgb& colour) {
  const double most_mm = 1e3 * pixel_m_ * 0.3 * (x1_ - x0_);
  const double power = std::pow(10.0, std::floor(std::log10(most_mm)));
  const double length_mm = most_mm >= 5 * power ? 5 * power : most_mm >= 2 * power ? 2 * power : power;
  const int y = y1_ - kMargin - 4, x = x0_ + kMargin;
  canvas_->Box(x, y, x + static_cast<int>(1e-3 * length_mm / pixel_m_), y + 4, colour);
  char text[32];
  std::snprintf(text, sizeof(text), "%g mm", length_mm);
  canvas_->Text(x, y - 2 * Canvas::kLetterHeight - 4, text, colour);
}

}  // namespace fulcrum::picture
