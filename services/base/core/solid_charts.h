// Flat charts of the solids' surface: where a point of it lies in the atlas of its burns. Computed from the scene, the
// same in every process that needs it.
#pragma once

#include <cstdint>
#include <vector>

#include "services/base/core/scene_view.h"

namespace fulcrum {

/// Edge of a cell of the solids' surface, and of a texel of their atlas [m].
inline constexpr float kSolidCell_m = 2e-4f;

/// A connected part of the surface of one solid, projected along its mean normal.
struct SolidChart {
  Vec3f s_axis = Vec3f::UnitX(), t_axis = Vec3f::UnitY();  ///< Orthonormal, in W at rest.
  Vec2f shift = Vec2f::Zero();                             ///< Material coordinates of the origin of W [m].
  /// Its box in the atlas [texels]; empty: the atlas was full.
  std::int32_t x = 0, y = 0, width = 0, height = 0;
  Index solid = 0;  ///< Index in TissueScene::solids; 0 in a scene of one organ.

  /// (s, t) in the atlas [m] of a point at rest.
  [[nodiscard]] Vec2f Material(const Vec3f& rest) const { return shift + Vec2f(s_axis.dot(rest), t_axis.dot(rest)); }
  [[nodiscard]] Vec3f normal() const { return s_axis.cross(t_axis); }
  /// Whether a texel lies in its box.
  [[nodiscard]] bool Contains(std::int32_t tx, std::int32_t ty) const {
    return tx >= x && ty >= y && tx < x + width && ty < y + height;
  }
};

struct SolidCharts {
  std::vector<SolidChart> charts;
  std::vector<Index> of_triangle;      ///< By triangle of TissueScene::tube_surface; kNoIndex: the atlas was full.
  std::int32_t width = 0, height = 0;  ///< Used part of the atlas [texels].

  [[nodiscard]] bool empty() const { return charts.empty(); }
};

/// Charts of at most 40 mm (or one triangle), whose triangles lean by at most 50 degrees, so that lengths on them are
/// up to 1.6 times those in the chart, and do not lie over themselves but for slivers. Between two charts there are
/// cells that belong to none. Processes, recordings and checkpoints of a scene must agree on the charts: a test holds
/// them to a hash.
[[nodiscard]] SolidCharts MakeSolidCharts(const TissueScene& scene);

/// Whether this scene's solids are burnt: it has some, a hook, and not the paper's model of heat.
[[nodiscard]] bool SolidsBurn(const TissueScene& scene);

}  // namespace fulcrum
