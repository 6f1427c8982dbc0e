// Length of the slit, measured on the hole itself. A removed cell that lies farther than kMarkSpacing from every mark
// becomes a mark, so the marks cover the hole as a net. The length is that of the net's longest way, plus that of each
// branch that leads farther away from it than a slit is wide. It does not depend on the tip's path: a spark that jumps
// ahead or a second pass over the same place does not falsify it.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "thermal_node/heat/heat_field.h"

namespace fulcrum::thermal {

/// Resolution of the length [m].
inline constexpr float kMarkSpacing = 0.0015f;

class CutMeter {
 public:
  /// Material coordinates (s, t) [m].
  using Mark = std::array<float, 2>;

  /// Looks at the cells of a box (inclusive) in which some have been removed.
  void Update(HeatField* field, CellIndex low, CellIndex high);

  [[nodiscard]] float length_m() const { return length_m_; }
  [[nodiscard]] const std::vector<Mark>& marks() const { return marks_; }
  void Restore(const std::vector<Mark>& marks);

 private:
  void Add(const Mark& mark);
  void Measure();
  /// Distance within the net from the sources (distance 0) to each mark; negative where no way leads.
  [[nodiscard]] std::vector<float> DistanceFrom(const std::vector<std::uint32_t>& sources,
                                                std::vector<std::uint32_t>* previous) const;

  struct Link {
    std::uint32_t to;
    float length_m;
  };
  std::vector<Mark> marks_;
  std::vector<std::vector<Link>> links_;  ///< Per mark: its neighbours within two spacings.
  float length_m_ = 0;
};

}  // namespace fulcrum::thermal
