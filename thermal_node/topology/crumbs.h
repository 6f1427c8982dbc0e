// Crumbs: small pieces of sheet that a cut has separated from the rest. They are removed as debris.
#pragma once

#include <cstdint>
#include <vector>

#include "thermal_node/heat/heat_field.h"

namespace fulcrum::thermal {

/// A separated piece of sheet below this area is debris; a larger one stays tissue [m^2].
inline constexpr float kCrumb_m2 = 4.0e-6f;

/// Cells that a call removed; `low` > `high` when none.
struct RemovedBox {
  CellIndex low{INT32_MAX, INT32_MAX}, high{INT32_MIN, INT32_MIN};
  [[nodiscard]] bool empty() const { return low.ix > high.ix; }
  void Add(CellIndex cell) {
    low = {std::min(low.ix, cell.ix), std::min(low.iy, cell.iy)};
    high = {std::max(high.ix, cell.ix), std::max(high.iy, cell.iy)};
  }
  void Add(const RemovedBox& box) {
    if (box.empty()) return;
    Add(box.low);
    Add(box.high);
  }
};

class Crumbs {
 public:
  /// Removes the pieces, connected over cell faces, that touch a cell removed within `changed` and are smaller than
  /// kCrumb_m2; their heat is added to ledger.debris. The search covers at most kCrumb_m2 of cells for each piece of
  /// border.
  RemovedBox TakeOut(HeatField* field, const RemovedBox& changed, Ledger* ledger);
  /// Area of all crumbs since the start, on the rest shape [m^2].
  [[nodiscard]] double area_m2() const { return area_m2_; }
  void Restore(double area_m2) { area_m2_ = area_m2; }

 private:
  enum Mark : std::uint8_t { kUnseen, kSeen, kSheet };
  [[nodiscard]] bool IsTissue(const HeatField& field, CellIndex cell) const;
  /// Fills piece_ with the cells connected to `start`. Returns true if they are a crumb.
  bool Collect(const HeatField& field, CellIndex start, std::size_t most);

  std::vector<std::uint8_t> mark_;  ///< By cell of the sheet; kUnseen between calls.
  std::vector<CellIndex> piece_, marked_;
  double area_m2_ = 0;
};

}  // namespace fulcrum::thermal
