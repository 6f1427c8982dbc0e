// Gaps between the bare metal of the hook and the cells of a surface around a contact, and what of them conducts.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "physics_node/collision/closest.h"
#include "physics_node/collision/open_cells.h"
#include "services/base/core/footprint.h"
#include "services/base/core/types.h"

namespace fulcrum::physics {

/// Gap between metal and tissue at which an arc strikes, and up to which it is sustained [m]. At the 500 V peak of a
/// cutting generator air and steam break down across 0.05 to 0.15 mm (Paschen).
inline constexpr float kStrikeGap = 1.0e-4f, kHoldGap = 2.5e-4f;
/// Largest gap in the footprint [m]: the reach of discharges and sparks.
inline constexpr float kFootprintReach = 7.0e-4f;
/// Part of a gap along the normal that does not count [m]: tissue yields under the metal, and its surface is wet.
inline constexpr float kContactSlack = 5.0e-5f;
/// Length of bare metal on the neck [m].
inline constexpr float kBareNeck = 0.005f;
/// Time constant of the rate of the contact in material coordinates [s].
inline constexpr float kRateTime = 0.03f;

/// End of the foot, heel, end of the bare neck, in frame W.
using MetalAxis = std::array<Vec3f, 3>;

/// A triangle of a surface: its corners in W and in material coordinates.
struct SurfaceTriangle {
  std::array<Vec3f, 3> place;
  std::array<Vec2f, 3> material;
};

class GapBox {
 public:
  static constexpr int kCells = static_cast<int>(kFootprintCells);

  /// An empty box of cells around a place [m].
  void Begin(const Vec2f& middle, float cell_m) {
    cell_m_ = cell_m;
    x_ = static_cast<std::int32_t>(std::floor(middle.x() / cell_m)) - kCells / 2;
    y_ = static_cast<std::int32_t>(std::floor(middle.y() / cell_m)) - kCells / 2;
    gap_m_.fill(2 * kFootprintReach);
  }

  /// Adds the cells of a triangle for which belongs(barycentric) is true:
  ///
  ///   gap = sqrt(max(|o|^2 - h^2, 0) + max(|h| - cushion, 0)^2) - radius,   h = n . o
  ///
  /// with the offset o from the cell to the axis and the normal n of the triangle [m].
  template <class Belongs>
  void Add(const SurfaceTriangle& triangle, const MetalAxis& axis, float radius_m, float cushion_m,
           const Belongs& belongs) {
    const auto& x = triangle.place;
    const Vec3f normal = (x[1] - x[0]).cross(x[2] - x[0]).normalized();
    ForCellsIn(triangle.material, cell_m_, x_, y_, x_ + kCells - 1, y_ + kCells - 1,
               [&](std::int32_t ix, std::int32_t iy, const std::array<float, 3>& w) {
                 if (!belongs(w)) return;
                 const Vec3f p = w[0] * x[0] + w[1] * x[1] + w[2] * x[2];
                 float& gap = gap_m_[static_cast<std::size_t>((iy - y_) * kCells + ix - x_)];
                 for (std::size_t k = 1; k < axis.size(); ++k) {
                   const Vec3f along = axis[k] - axis[k - 1];
                   const Vec3f offset = axis[k - 1] + ClosestOnSegment(p, axis[k - 1], axis[k]) * along - p;
                   const float height = normal.dot(offset), off = std::max(std::abs(height) - cushion_m, 0.0f);
                   const float lateral_sq = std::max(offset.squaredNorm() - height * height, 0.0f);
                   gap = std::min(gap, std::sqrt(lateral_sq + off * off) - radius_m);
                 }
               });
  }

  /// Mean place of the cells within `limit_m` of the metal, weighted by (limit - gap)^2; a cell that is tissue. False:
  /// no cell is so near.
  [[nodiscard]] bool FindMiddle(float limit_m, Vec2f* middle) const;
  /// The cells within kFootprintReach; leaves `print` as it is if there are none.
  void Encode(Footprint* print) const;

 private:
  [[nodiscard]] float At(int i, int j) const { return gap_m_[static_cast<std::size_t>(j * kCells + i)]; }

  float cell_m_ = 1e-4f;
  std::array<float, std::size_t{kCells} * kCells> gap_m_{};  ///< Row by row.
  std::int32_t x_ = 0, y_ = 0;                               ///< Cell of the first.
};

}  // namespace fulcrum::physics
