// A brick of 64 x 64 x 32 cells beneath 3 x 3 tiles of the sheet.
#pragma once

#include <array>

#include "thermal_node/volume/volume_material.h"

namespace fulcrum::thermal {

inline constexpr int kBrick = 64;                  ///< Columns of cells along the edge of a brick.
inline constexpr int kBrickTiles = 3;              ///< Tiles of the sheet along it.
inline constexpr int kBrickSpan = kBrick * 3 / 2;  ///< Cells of the sheet along it.
inline constexpr int kBrickPairs = kBrick / 2;
inline constexpr int kColumns = kBrick * kBrick;
inline constexpr int kBrickCells = kColumns * kLayers;

/// Padded layout of theta: one halo row before and after, eight floats left and right so that rows stay aligned.
inline constexpr int kBrickStride = kBrick + 16;
inline constexpr int kLayerStride = kBrickStride * (kBrick + 2);
inline constexpr int BrickIndex(int i, int j, int k) { return (k * kBrick + j) * kBrick + i; }
inline constexpr int BrickThetaIndex(int i, int j, int k) { return k * kLayerStride + (j + 1) * kBrickStride + 8 + i; }

inline constexpr int kBoxColumns = 16;  ///< A box begins and ends at multiples of this along s …
inline constexpr int kBoxRows = 2;      ///< … and of this along t.

/// The warm part of a brick: cells [col0, col1) of the rows [row0, row1) of layers [0, layers). Outside it the
/// temperature is 0 and no heat crosses its border; it is extended before the heat front reaches the border.
struct WarmBox {
  int col0 = kBrick, col1 = 0, row0 = kBrick, row1 = 0, layers = 0;
  [[nodiscard]] bool empty() const { return row0 >= row1; }
  [[nodiscard]] bool Holds(int i, int j, int k) const {
    return i >= col0 && i < col1 && j >= row0 && j < row1 && k < layers;
  }
  bool operator==(const WarmBox&) const = default;
};
inline constexpr WarmBox kWholeBrick{0, kBrick, 0, kBrick, kLayers};

struct Brick {
  int bx = 0, by = 0, index = 0;
  bool awake = false;
  bool held = false;  ///< A warm neighbour touches the brick: it must not sleep in this step.
  bool has_source = false;
  float length_s = 1, length_t = 1;  ///< Rest length of a cell relative to pitch_m.
  float volume = 0;                  ///< Volume of a cell on the rest shape [m^3].
  float lid_area = 1;                ///< Largest area of the sheet above a column relative to the column's area.
  WarmBox box;
  float theta_max = 0;

  alignas(64) std::array<float, kBrickCells> enthalpy{};  ///< Over rc [K]; boiling takes latent[k] of it.
  alignas(64) std::array<float, kBrickCells> omega{};     ///< Arrhenius integral of cell death.
  /// Temperature above body temperature [K]; cells beside the box hold halo values.
  alignas(64) std::array<float, kLayerStride * kLayers> theta{};
  /// Largest |theta| of rows 2n and 2n + 1 of layer k, at k * kBrickPairs + n.
  alignas(64) std::array<float, kLayers * kBrickPairs> pair_max{};
  std::array<float, kLayers> layer_sum{};  ///< Sums of theta [K].

  /// Above layer 0: d(enthalpy/rc)/dt = lid_flux - lid_rate * theta [K/s], [1/s], column (i, j) at j * kBrick + i.
  alignas(64) std::array<float, kColumns> lid_flux{}, lid_rate{};
  /// Heat of the leak current for the next step, in each fat cell of a column [J/m^3].
  alignas(64) std::array<float, kColumns> source{};
};

/// True when the brick sleeps and no cell was ever warm enough to be damaged.
[[nodiscard]] bool IsBlank(const Brick& brick);

}  // namespace fulcrum::thermal
