// A tile of 32 x 32 cells: the state that survives sleep and the scratch of the explicit step.
#pragma once

#include <array>
#include <cstdint>

#include "thermal_node/heat/sheet.h"

namespace fulcrum::thermal {

enum CellFlag : std::uint8_t {
  kRemoved = 1,      ///< Vaporised: a hole.
  kOutside = 2,      ///< Never was tissue.
  kQuarantined = 4,  ///< Held a number that was not finite; taken out of the computation.
  kCounted = 8,      ///< Already counted in the cut length.
};
inline constexpr std::uint8_t kNoTissue = kRemoved | kOutside | kQuarantined;

/// Padded layout of theta: one halo row above and below, eight floats left and right so that rows stay aligned.
inline constexpr int kThetaStride = kTile + 16;
inline constexpr int ThetaIndex(int i, int j) { return (j + 1) * kThetaStride + 8 + i; }
inline constexpr int kFaceStride = kTile + 8;

template <class T>
using CellArray = std::array<T, kTileCells>;

/// What a sleeping tile keeps and a checkpoint holds, cell (i, j) at j * kTile + i.
struct TileState {
  alignas(64) CellArray<float> enthalpy{};  ///< Sensible heat above body temperature [J/m^3].
  CellArray<float> water{};                 ///< Fraction of the tissue water left.
  CellArray<float> omega_cell{};            ///< Arrhenius integral of cell death.
  CellArray<float> omega_collagen{};        ///< Arrhenius integral of collagen denaturation.
  CellArray<float> charred{};               ///< 0 … 1.
  CellArray<std::uint8_t> flags{};          ///< CellFlag.
  std::uint8_t awake = 0;
  std::uint8_t tented = 0;
};

struct Tile {
  TileState state;
  int tx = 0, ty = 0, index = 0;
  float volume = 0;  ///< Of a cell on the rest shape [m^3].

  /// theta [K] with a halo; equals enthalpy / heat capacity at all times between calls.
  alignas(64) std::array<float, (kTile + 2) * kThetaStride> theta{};
  /// Conductance over volume of the face between cells (i-1, j) and (i, j) [W/(K m^3)].
  alignas(64) std::array<float, kTile * kFaceStride> face_x{};
  /// The same between (i, j-1) and (i, j).
  alignas(64) std::array<float, (kTile + 1) * kTile> face_y{};
  alignas(64) std::array<float, kTile> theta_sum{};  ///< Column sums of theta.
  float theta_max = 0, theta_min = 0;
  float rate = 0;           ///< Largest rate of the explicit step [1/s].
  bool faces_stale = true;  ///< Material of this tile changed since its faces were built.
  bool patch_stale = true;  ///< Changed since it was last drawn into a patch.
  bool held = false;        ///< A warm neighbour touches it: no sleep in this step.
};

/// True when the tile sleeps and nothing lasting ever happened in it, so that it need not be stored.
[[nodiscard]] bool IsBlank(const TileState& state);

}  // namespace fulcrum::thermal
