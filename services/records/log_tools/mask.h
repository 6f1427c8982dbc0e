// Sets of pixels: distances and connected pieces.
#pragma once

#include <cstdint>
#include <vector>

#include "services/base/core/types.h"

namespace fulcrum::log_tools {

/// Pixels row by row; everything outside is clear.
struct Mask {
  int width = 0, height = 0;
  std::vector<std::uint8_t> set;  ///< 0 or 1.

  Mask() = default;
  Mask(int columns, int rows)
      : width(columns), height(rows), set(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows)) {}

  [[nodiscard]] std::size_t Index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
  }
  [[nodiscard]] bool Contains(int x, int y) const { return x >= 0 && y >= 0 && x < width && y < height; }
  [[nodiscard]] bool At(int x, int y) const { return Contains(x, y) && set[Index(x, y)] != 0; }
  void Put(int x, int y, bool value = true) {
    if (Contains(x, y)) set[Index(x, y)] = value ? 1 : 0;
  }
};

/// Euclidean distance of each set pixel's centre to the nearest clear pixel's centre [pixels]; 0 where clear. Exact:
/// Felzenszwalb and Huttenlocher, "Distance transforms of sampled functions" (2012).
[[nodiscard]] std::vector<float> DistanceToClear(const Mask& mask);

enum class Neighbours { kFour, kEight };

struct Piece {
  int pixels = 0;
  bool at_border = false;  ///< Contains a pixel of the first or last row or column.
};

struct Pieces {
  std::vector<int> label;  ///< Per pixel: index into `pieces`; -1 for pixels of the other value.
  std::vector<Piece> pieces;
};

/// Connected pieces of the pixels whose value is `value`.
[[nodiscard]] Pieces FindPieces(const Mask& mask, bool value, Neighbours neighbours);

/// Mask of twice the size: each pixel becomes 2 x 2.
[[nodiscard]] Mask Doubled(const Mask& mask);

}  // namespace fulcrum::log_tools
