// Length of the slit, measured on the hole itself: a removed cell that lies farther than kMarkSpacing from every mark
// becomes a mark and adds its distance to the nearest one. The marks walk along a slit as it grows at its ends,
// whatever path the tip took, so neither a spark that jumps ahead nor a second pass over the same place falsifies the
// length. Holds for slits narrower than twice the spacing; a straight slit is short by half a spacing on average.
#pragma once

#include <array>
#include <vector>

#include "thermal_node/heat/heat_field.h"

namespace fulcrum::thermal {

/// [m]
inline constexpr float kMarkSpacing = 0.0015f;

class CutMeter {
 public:
  /// Material coordinates (s, t) [m].
  using Mark = std::array<float, 2>;

  /// Looks at the cells of a box (inclusive) in which some have been removed.
  void Update(HeatField* field, CellIndex low, CellIndex high);

  [[nodiscard]] float length_m() const { return static_cast<float>(length_m_); }

  [[nodiscard]] double state() const { return length_m_; }
  [[nodiscard]] const std::vector<Mark>& marks() const { return marks_; }
  void Restore(double length_m, std::vector<Mark> marks);

 private:
  void Add(const Vec2f& place);

  std::vector<Mark> marks_;
  double length_m_ = 0;
};

}  // namespace fulcrum::thermal
