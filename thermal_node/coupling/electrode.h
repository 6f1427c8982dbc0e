// The metal on the grid of the source window: how far each cell of the sheet is from its surface.
#pragma once

#include <algorithm>
#include <cmath>
#include <span>

#include "services/core/types.h"
#include "thermal_node/heat/sheet.h"

namespace fulcrum::thermal {

/// Conductance of sparks across the gap beside dry contact, relative to metal on tissue; assumed.
inline constexpr float kArcConductance = 0.15f;

/// A straight piece of the metal's axis as the sheet sees it: its ends in material coordinates, and how far the axis is
/// from the sheet there. The sign of the height changes where the metal goes through the sheet.
struct MetalPiece {
  Vec2f a = Vec2f::Zero(), b = Vec2f::Zero();
  float height_a = 0, height_b = 0;
};

/// All points nearer than `radius` to the pieces' axes. A cell at lateral distance x from an axis at height h is
/// sqrt(x^2 + h^2) - radius away from the metal: metal that lies on the sheet touches along a line, metal that stands
/// in it covers a disc. Lengths in cells, lateral distances by the metric.
class Electrode {
 public:
  Electrode(const SurfaceMetric& metric, const MetalPiece& piece, float radius) : radius_(radius) {
    // g = L^T L: L maps cells to lengths on the rest shape.
    l_ss_ = std::sqrt(metric.ss);
    l_st_ = metric.st / l_ss_;
    l_tt_ = std::sqrt(std::max(metric.tt - l_st_ * l_st_, 1e-12f));
    a_ = Map(piece.a);
    ab_ = Map(piece.b) - a_;
    height_a_ = piece.height_a;
    rise_ = piece.height_b - piece.height_a;
    const float length2 = ab_.squaredNorm() + rise_ * rise_;
    per_length2_ = length2 > 0.0f ? 1.0f / length2 : 0.0f;
    low_ = piece.a.cwiseMin(piece.b);
    high_ = piece.a.cwiseMax(piece.b);
    across_ = Vec2f(std::sqrt(metric.tt), std::sqrt(metric.ss)) / metric.area();
  }

  /// Distance of a cell's centre from the metal's surface; negative under it [cells].
  [[nodiscard]] float Gap(const Vec2f& centre) const {
    const Vec2f d = Map(centre) - a_;
    const float u = std::clamp((d.dot(ab_) - height_a_ * rise_) * per_length2_, 0.0f, 1.0f);
    const Vec2f lateral = d - u * ab_;
    const float height = height_a_ + u * rise_;
    return std::sqrt(lateral.squaredNorm() + height * height) - radius_;
  }
  /// Part of a cell that is under the metal, by its gap [cells].
  [[nodiscard]] static float Covered(float gap) { return std::clamp(0.5f - gap, 0.0f, 1.0f); }

  /// The box that holds every centre with a gap below `reach`.
  [[nodiscard]] Vec2f low(float reach) const { return low_ - (radius_ + reach + 1.0f) * across_; }
  [[nodiscard]] Vec2f high(float reach) const { return high_ + (radius_ + reach + 1.0f) * across_; }

 private:
  [[nodiscard]] Vec2f Map(const Vec2f& v) const { return {l_ss_ * v.x() + l_st_ * v.y(), l_tt_ * v.y()}; }

  float l_ss_, l_st_, l_tt_;
  float radius_;
  Vec2f a_, ab_;
  float height_a_, rise_, per_length2_;
  Vec2f low_, high_, across_;
};

}  // namespace fulcrum::thermal
