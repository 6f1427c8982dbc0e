// The metal on the grid of the source window, as the part of each cell that it covers.
#pragma once

#include <algorithm>
#include <cmath>

#include "services/core/types.h"
#include "thermal_node/heat/sheet.h"

namespace fulcrum::thermal {

/// Conductance of sparks across the steam, relative to metal on tissue; assumed.
inline constexpr float kArcConductance = 0.15f;

/// The points nearer than `radius` to a segment: a capsule, or a disc where the segment has no length. Material
/// coordinates in cells; distances by the metric, in cells.
class Electrode {
 public:
  /// @param middle of the segment. @param half way from there to either end.
  Electrode(const SurfaceMetric& metric, const Vec2f& middle, const Vec2f& half, float radius, float arc)
      : metric_(metric), middle_(middle), half_(half), radius_(radius), arc_(arc), per_arc_(1.0f / arc) {
    const Vec2f lowered(metric.ss * half.x() + metric.st * half.y(), metric.st * half.x() + metric.tt * half.y());
    const float length2 = lowered.dot(half);
    if (length2 > 0.0f) share_ = lowered / length2;
    const float inner = std::max(radius - 0.5f, 0.0f), outer = radius + arc + 0.5f;
    covered2_ = inner * inner;
    reach2_ = outer * outer;
  }

  /// Conductance of the cell at `centre` to the metal, over that of a covered cell: the part of it under the metal, by
  /// its distance to the edge; beyond the edge sparks, which fall to 0 at `arc` as they get rarer.
  [[nodiscard]] float Covered(const Vec2f& centre) const {
    const Vec2f from_middle = centre - middle_;
    const Vec2f d = from_middle - std::clamp(from_middle.dot(share_), -1.0f, 1.0f) * half_;
    const float r2 = metric_.ss * d.x() * d.x() + 2.0f * metric_.st * d.x() * d.y() + metric_.tt * d.y() * d.y();
    if (r2 < covered2_) return 1.0f;
    if (r2 > reach2_) return 0.0f;
    const float r = std::sqrt(r2);
    const float metal = std::clamp(radius_ - r + 0.5f, 0.0f, 1.0f);
    const float beyond = std::max(r - radius_, 0.5f * (1.0f - metal));  // of the middle of what is not covered
    const float rarer = std::max(1.0f - beyond * per_arc_, 0.0f);
    return metal + (1.0f - metal) * kArcConductance * rarer * rarer;
  }

  /// The box that holds every centre with Covered() > 0.
  [[nodiscard]] Vec2f low() const { return middle_ - half_.cwiseAbs() - Reach(); }
  [[nodiscard]] Vec2f high() const { return middle_ + half_.cwiseAbs() + Reach(); }

 private:
  /// Of the ellipse g(d, d) = reach^2.
  [[nodiscard]] Vec2f Reach() const {
    return (radius_ + arc_ + 1.0f) / metric_.area() * Vec2f(std::sqrt(metric_.tt), std::sqrt(metric_.ss));
  }

  SurfaceMetric metric_;
  Vec2f middle_, half_;
  Vec2f share_ = Vec2f::Zero();  ///< Its product with a way from the middle: how far along the half that leads.
  float radius_, arc_, per_arc_;
  float covered2_, reach2_;  ///< Squares of the distances within which all, and beyond which nothing is covered.
};

}  // namespace fulcrum::thermal
