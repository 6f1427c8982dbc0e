// A capsule of metal on the grid of the source window, and the distance of each cell of the sheet from its surface.
#pragma once

#include <algorithm>
#include <cmath>

#include "services/base/core/types.h"
#include "thermal_node/heat/sheet.h"

namespace fulcrum::thermal {

/// Conductance of sparks across the gap beside the contact, relative to that of metal on tissue; assumed.
inline constexpr float kArcConductance = 0.15f;

/// All points of the sheet nearer than `radius` to an axis in the sheet. Lengths are in cells, distances are those of
/// the rest shape by its metric.
class Electrode {
 public:
  Electrode(const SurfaceMetric& metric, const Vec2f& a, const Vec2f& b, float radius) : radius_(radius) {
    // g = L^T L: L maps cells to lengths on the rest shape.
    l_ss_ = std::sqrt(metric.ss);
    l_st_ = metric.st / l_ss_;
    l_tt_ = std::sqrt(std::max(metric.tt - l_st_ * l_st_, 1e-12f));
    a_ = Map(a);
    ab_ = Map(b) - a_;
    const float length2 = ab_.squaredNorm();
    per_length2_ = length2 > 0.0f ? 1.0f / length2 : 0.0f;
    low_ = a.cwiseMin(b);
    high_ = a.cwiseMax(b);
    across_ = Vec2f(std::sqrt(metric.tt), std::sqrt(metric.ss)) / metric.area();
  }

  /// Distance of a cell's centre from the metal's surface; negative under it [cells].
  [[nodiscard]] float Gap(const Vec2f& centre) const {
    const Vec2f d = Map(centre) - a_;
    return (d - std::clamp(d.dot(ab_) * per_length2_, 0.0f, 1.0f) * ab_).norm() - radius_;
  }
  /// Fraction of a cell that the metal covers, from its gap [cells].
  [[nodiscard]] static float Covered(float gap) { return std::clamp(0.5f - gap, 0.0f, 1.0f); }

  /// The box that holds every centre with a gap below `reach`.
  [[nodiscard]] Vec2f low(float reach) const { return low_ - (radius_ + reach + 1.0f) * across_; }
  [[nodiscard]] Vec2f high(float reach) const { return high_ + (radius_ + reach + 1.0f) * across_; }

 private:
  [[nodiscard]] Vec2f Map(const Vec2f& v) const { return {l_ss_ * v.x() + l_st_ * v.y(), l_tt_ * v.y()}; }

  float l_ss_, l_st_, l_tt_;
  float radius_;
  Vec2f a_, ab_;
  float per_length2_;
  Vec2f low_, high_, across_;
};

}  // namespace fulcrum::thermal
