// Distance between the metal and the cells of the membrane around a contact.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace fulcrum {

/// Largest size of a footprint along either axis [cells].
inline constexpr std::uint32_t kFootprintCells = 64;
/// Meaning of a byte of a footprint: distance kLeastGap_m + value * kGapStep_m from the metal's surface [m]; the
/// largest value also stands for any larger distance.
inline constexpr float kLeastGap_m = -5e-4f, kGapStep_m = 5e-6f;
inline constexpr std::uint8_t kBeyond = 255;

/// A box of cells of the membrane, row by row; cell (x, y) contains the points with floor(s / cell_m) = x and floor(t /
/// cell_m) = y.
struct Footprint {
  std::int32_t x = 0, y = 0;  ///< Position of its first cell.
  std::uint32_t width = 0;    ///< Cells per row; 0: no cell is near.
  std::vector<std::uint8_t> gap;

  [[nodiscard]] std::uint32_t height() const { return width > 0 ? static_cast<std::uint32_t>(gap.size()) / width : 0; }
  /// Whether its numbers are consistent and its position is possible: no sum of two of its cells overflows.
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
