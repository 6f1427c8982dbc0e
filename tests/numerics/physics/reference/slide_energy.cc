#include "tests/numerics/physics/reference/slide_energy.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

namespace fulcrum::physics::reference {
namespace {

/// Nearer than this the direction to the nearest point is rounding [m].
constexpr double kTouching_m = 1e-10;

/// Parameter from 0 to 1 of the point of a segment nearest to p.
double OnSegment(const Vec3d& p, const Vec3d& a, const Vec3d& b) {
  return std::clamp((p - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
}

/// Barycentric coordinates of the nearest point: that of the plane if it is inside, else the best of the three sides.
std::array<double, 3> Nearest(const Vec3d& p, const std::array<Vec3d, 3>& x) {
  const Vec3d normal = (x[1] - x[0]).cross(x[2] - x[0]);
  std::array<double, 3> b{};
  for (std::size_t i = 0; i < 3; ++i) {
    b[i] = normal.dot((x[(i + 1) % 3] - p).cross(x[(i + 2) % 3] - p)) / normal.squaredNorm();
  }
  if (b[0] >= 0 && b[1] >= 0 && b[2] >= 0) return b;
  double best = std::numeric_limits<double>::max();
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t j = (i + 1) % 3;
    const double t = OnSegment(p, x[i], x[j]), distance = (x[i] + t * (x[j] - x[i]) - p).norm();
    if (distance < best) {
      best = distance;
      b = {0, 0, 0};
      b[i] = 1 - t;
      b[j] = t;
    }
  }
  return b;
}

}  // namespace

SlideFoot FootOf(const ElasticModel& model, const ElasticSlide& slide, const Points& x) {
  const Vec3d p = x.col(slide.vertex);
  SlideFoot foot;
  double nearest = std::numeric_limits<double>::max(), height = 0;
  for (Index t = slide.first; t < slide.end; ++t) {
    const Triangle& v = model.slide_surface[t];
    const std::array<Vec3d, 3> corner{x.col(v[0]), x.col(v[1]), x.col(v[2])};
    const std::array<double, 3> b = Nearest(p, corner);
    const Vec3d r = p - (b[0] * corner[0] + b[1] * corner[1] + b[2] * corner[2]);
    const Vec3d outward = (corner[1] - corner[0]).cross(corner[2] - corner[0]).normalized();
    const double h = outward.dot(r);
    const bool same = std::abs(r.norm() - nearest) < 1e-12;
    if (same ? std::abs(h) > std::abs(height) : r.norm() < nearest) {
      nearest = r.norm();
      height = h;
      const double gap_m = std::copysign(nearest, h);
      const Vec3d normal = nearest > kTouching_m ? Vec3d(r / gap_m) : outward;
      foot = {{slide.vertex, v[0], v[1], v[2]}, {1, -b[0], -b[1], -b[2]}, normal, gap_m};
    }
  }
  return foot;
}

double SlideEnergy(const ElasticModel& model, const Points& x) {
  double energy = 0;
  for (const ElasticSlide& slide : model.slides) {
    const double stretch = FootOf(model, slide, x).gap_m - slide.gap_m;
    energy += slide.stiffness / 2 * stretch * stretch;
  }
  return energy;
}

void AddSlideGradient(const ElasticModel& model, const Points& x, Points* gradient) {
  for (const ElasticSlide& slide : model.slides) {
    const SlideFoot foot = FootOf(model, slide, x);
    for (std::size_t i = 0; i < 4; ++i) {
      gradient->col(foot.v[i]) += slide.stiffness * (foot.gap_m - slide.gap_m) * foot.c[i] * foot.normal;
    }
  }
}

}  // namespace fulcrum::physics::reference
