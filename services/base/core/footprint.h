// How far the cells of the sheet around a contact are from the metal.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace fulcrum {

/// Of a footprint at most, along either axis [cells].
inline constexpr std::uint32_t kFootprintCells = 64;
/// What a byte of a footprint means: kLeastGap_m + value * kGapStep_m from the metal's surface; the last one: farther.
inline constexpr float kLeastGap_m = -5e-4f, kGapStep_m = 5e-6f;
inline constexpr std::uint8_t kBeyond = 255;

/// A box of cells of the sheet, row by row; cell (x, y) holds what has floor(s / cell_m) = x and floor(t / cell_m) = y.
struct Footprint {
  std::int32_t x = 0, y = 0;  ///< Of its first cell.
  std::uint32_t width = 0;    ///< Cells of a row; 0: no cell is near.
  std::vector<std::uint8_t> gap;

  [[nodiscard]] std::uint32_t height() const { return width > 0 ? static_cast<std::uint32_t>(gap.size()) / width : 0; }
  /// Its numbers agree, and it lies where a sheet can be: no sum of two of its cells overflows.
  [[nodiscard]] bool whole() const {
    constexpr std::int32_t kLastCell = 1 << 24;
    const auto near = [](std::int32_t cell) { return cell > -kLastCell && cell < kLastCell; };
    return width == 0 ? gap.empty()
                      : near(x) && near(y) && width <= kFootprintCells && !gap.empty() && gap.size() % width == 0 &&
                            height() <= kFootprintCells;
  }
  [[nodiscard]] static std::uint8_t Encode(float gap_m) {
    return static_cast<std::uint8_t>(std::clamp((gap_m - kLeastGap_m) / kGapStep_m + 0.5f, 0.0f, 255.0f));
  }
  [[nodiscard]] static float Decode(std::uint8_t value) { return kLeastGap_m + kGapStep_m * static_cast<float>(value); }
};

}  // namespace fulcrum
