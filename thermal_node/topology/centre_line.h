// Centre line of the hole: a set of cells one cell wide, with the topology of the hole, on the ridge of its distance
// transform. Found by distance-ordered homotopic thinning (C. Pudney, "Distance-ordered homotopic thinning: a
// skeletonization algorithm for 3D digital images", Computer Vision and Image Understanding 72, 1998): cells are
// removed from the object by ascending distance from the tissue, each only if the number of pieces of the hole and of
// islands in it stays the same. The hole is 8-connected, the tissue 4-connected.
//
// An update thins again only around the cells that were removed. Three nested boxes:
//
//   +--------------------------------+   loaded: the distance transform is exact for all of the margin
//   |  +--------------------------+  |
//   |  |  margin: old line fixed  |  |   the old line stays; the hole around it thins away to it
//   |  |   +------------------+   |  |
//   |  |   | inner: thinned   |   |  |   changed cells, and kReach around them: all that the change can move
//   |  |   +------------------+   |  |
//   |  +--------------------------+  |
//   +--------------------------------+
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "thermal_node/heat/heat_field.h"

namespace fulcrum::thermal {

/// The distance transform is exact in holes up to twice as wide as this; in wider ones it has a plateau [m].
inline constexpr float kCentreReach_m = 2e-3f;

struct LineCell {
  CellIndex at;
  /// Squared distance from the cell's centre to that of the nearest cell that is no hole [cells^2], at most the squared
  /// reach.
  std::int32_t distance2 = 0;
  bool operator==(const LineCell&) const = default;
};

/// True for removed and quarantined cells. Cells beyond the sheet's border are not part of a hole.
[[nodiscard]] bool IsHole(const HeatField& field, CellIndex cell);

class CentreLine {
 public:
  /// Updates the line after cells within a box (both corners inclusive) were removed.
  void Update(const HeatField& field, CellIndex low, CellIndex high);
  /// Cells of the line by ascending row, then column.
  [[nodiscard]] std::span<const LineCell> cells() const { return cells_; }
  /// Restores a line from its cells. Returns false, and leaves an empty line, if they are not sorted or not all in the
  /// hole.
  [[nodiscard]] bool Restore(const HeatField& field, std::span<const CellIndex> cells);
  void Clear() { cells_.clear(); }

 private:
  /// Columns and rows of the loaded box, from `low` to below `high`.
  struct Box {
    CellIndex low, high;
    [[nodiscard]] bool Contains(CellIndex c) const {
      return c.ix >= low.ix && c.iy >= low.iy && c.ix < high.ix && c.iy < high.iy;
    }
  };
  /// kBackground: tissue, or thinned away. kMayEnd: free, and the line may end there.
  enum Role : std::uint8_t { kBackground, kFree, kMayEnd, kFixed };

  void SetBoxes(CellIndex low, CellIndex high, int reach);
  void Load(const HeatField& field);
  void RowDistances(int reach);
  [[nodiscard]] std::int32_t Distance2(int at) const;
  void CollectObject();
  void Thin();
  /// Removes cells of `part` until none can be removed; the remaining cells stay in `part`.
  void ThinPart(std::vector<std::int32_t>* part);
  /// True if removing the cell changes neither the topology nor a place where the line may end.
  [[nodiscard]] bool IsRemovable(std::int32_t at) const;
  /// True if the distance transform does not rise steeply in any direction, so that the cell lies on its ridge and not
  /// on a side or in a corner of the hole.
  [[nodiscard]] bool OnRidge(std::int32_t at) const;
  void Remove(std::int32_t at);
  void Merge();
  [[nodiscard]] int At(CellIndex sheet_cell) const {
    return (sheet_cell.iy - loaded_.low.iy) * stride_ + sheet_cell.ix - loaded_.low.ix;
  }
  [[nodiscard]] CellIndex CellAt(std::int32_t at) const {
    return {loaded_.low.ix + at % stride_, loaded_.low.iy + at / stride_};
  }

  std::vector<LineCell> cells_, merged_;

  // Scratch of an update, by cell of the loaded box.
  Box inner_, kept_, margin_, loaded_;
  int stride_ = 0, reach_ = 0;
  std::vector<std::uint8_t> run_;        ///< Cells to the next tissue in the same row, at most the reach.
  std::vector<std::int32_t> distance2_;  ///< As LineCell's; 0 outside the margin.
  std::vector<std::uint8_t> role_;       ///< Role.
  std::vector<std::uint8_t> around_;     ///< A bit per neighbour that is not kBackground; see kOffsets.
  std::vector<std::int32_t> order_;      ///< Cells of the object by ascending distance.
  std::vector<std::int32_t> object_, part_, going_, starts_;
  std::array<std::int32_t, 8> offsets_{};
  std::array<std::int32_t, 16> ring_{};
};

}  // namespace fulcrum::thermal
