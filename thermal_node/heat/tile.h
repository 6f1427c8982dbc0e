// A tile of 32 x 32 cells: the state that is kept during sleep and the scratch of the explicit step.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "thermal_node/heat/material.h"
#include "thermal_node/heat/sheet.h"

namespace fulcrum::thermal {

enum CellFlag : std::uint8_t {
  kRemoved = 1,      ///< Vaporised: a hole.
  kOutside = 2,      ///< Never was tissue.
  kQuarantined = 4,  ///< Held a value that was not finite or not plausible; excluded from the computation.
};
inline constexpr std::uint8_t kNoTissue = kRemoved | kOutside | kQuarantined;

/// Cells of a neighbouring tile that a face's flux depends on.
inline constexpr int kHalo = 2;
/// Padded layout of theta: two halo rows above and below, eight floats left and right so that rows stay aligned.
inline constexpr int kThetaStride = kTile + 16;
inline constexpr int kThetaCount = (kTile + 2 * kHalo) * kThetaStride;
inline constexpr int ThetaIndex(int i, int j) { return (j + kHalo) * kThetaStride + 8 + i; }
/// Faces across s, i = -1 ... kTile + 1 of row j, and across t, row j = -1 ... kTile + 1: one beyond each border.
inline constexpr int kFaceStride = kTile + 16;
inline constexpr int FaceS(int i, int j) { return j * kFaceStride + 8 + i; }
inline constexpr int FaceT(int i, int j) { return (j + 1) * kTile + i; }
/// Corners (i, j) between cells (i-1, j-1) and (i, j), 0 ... kTile.
inline constexpr int kCornerStride = kTile + 8;
inline constexpr int Corner(int i, int j) { return j * kCornerStride + i; }

/// Conductance of a diagonal link along the main diagonal (stored with positive sign) and the antidiagonal (negative).
[[gnu::always_inline]] inline float Main(float link) { return link > 0.0f ? link : 0.0f; }
[[gnu::always_inline]] inline float Anti(float link) { return link < 0.0f ? -link : 0.0f; }

template <class T>
using CellArray = std::array<T, kTileCells>;

/// State that a sleeping tile keeps and a checkpoint holds, cell (i, j) at j * kTile + i.
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

/// The map from material space to the rest shape, at the cells, faces and corners of a tile.
struct TileGeometry {
  alignas(64) CellArray<float> area{};          ///< sqrt(g).
  alignas(64) CellArray<float> inverse_area{};  ///< 1 / sqrt(g).
  /// sqrt(g) g^ss at FaceS, less the share of diagonal links.
  alignas(64) std::array<float, kTile * kFaceStride> across_s{};
  alignas(64) std::array<float, (kTile + 3) * kTile> across_t{};  ///< sqrt(g) g^tt at FaceT, likewise.
  std::vector<float> shear;                                       ///< sqrt(g) g^st at Corner; empty: none.
  bool has_main = false, has_anti = false;                        ///< The shear has values above 0, below 0.
};

/// Thermal resistance from where a cell has its theta to its face, over cell_m [m K/W]; infinite where there is no
/// tissue. It differs by side only in a cell that boils: there theta is that of the front between dry and wet tissue,
/// and the front divides the cell as its water does.
struct CellResistance {
  alignas(64) std::array<float, kThetaCount> water{};
  alignas(64) std::array<float, kThetaCount> to_drier{};   ///< To the face of a neighbour with less water.
  alignas(64) std::array<float, kThetaCount> to_wetter{};  ///< To the face of any other one.
};

struct Tile {
  TileState state;
  int tx = 0, ty = 0, index = 0;
  const Material* material = nullptr;  ///< Of its sheet.
  float flat_volume = 0;               ///< Volume of a cell in material space [m^3].
  TileGeometry geometry;

  /// theta [K] with a halo; equals enthalpy / heat capacity at all times between calls.
  alignas(64) std::array<float, kThetaCount> theta{};
  /// What a cell adds to the resistance of its faces, with a halo.
  CellResistance resistance;
  /// Conductance over flat_volume of the face between cells (i-1, j) and (i, j), at FaceS [W/(K m^3)].
  alignas(64) std::array<float, kTile * kFaceStride> face_s{};
  /// The same between (i, j-1) and (i, j), at FaceT.
  alignas(64) std::array<float, (kTile + 3) * kTile> face_t{};
  /// The same between cells that touch at a corner, at Corner; above 0 between (i-1, j-1) and (i, j), below 0, minus
  /// that between (i, j-1) and (i-1, j). Empty without shear.
  std::vector<float> links;
  /// 1 where the flux of a face may be of fourth order, 0 near a front of boiling or a border between dry and wet
  /// tissue, where the slope of theta changes; like face_s and face_t. Empty: 1 everywhere.
  std::vector<float> smooth_s, smooth_t;
  alignas(64) CellArray<float> before{};     ///< Enthalpy at the beginning of the step [J/m^3].
  alignas(64) CellArray<float> cell_rate{};  ///< Rate of the explicit step with two-point fluxes in each cell [1/s].
  alignas(64) std::array<float, kTile> theta_sum{};  ///< Column sums of theta times area.
  float theta_max = 0, theta_min = 0;
  float water_off = 0;         ///< Largest |water - 0.5|; above 0.5 the water of a cell is not a fraction.
  float rate = 0;              ///< The largest of cell_rate.
  int substeps = 0;            ///< Substeps of the tile's island in the last step.
  bool material_stale = true;  ///< Resistances must be computed.
  bool faces_stale = true;     ///< Conductances of faces must be recomputed.
  bool has_front = false;      ///< A cell boiled when the resistances were computed.
  bool patch_stale = true;     ///< Changed since it was last drawn into a patch.
  bool held = false;           ///< A warm neighbour touches the tile: it must not sleep in this step.

  /// Volume of a cell on the rest shape [m^3].
  [[nodiscard]] float Volume(int cell) const { return flat_volume * geometry.area[cell]; }
  /// Heat of all cells [J].
  [[nodiscard]] double Heat() const;
};

/// True if the tile sleeps and has no damage or removed cells, so that it need not be stored.
[[nodiscard]] bool IsBlank(const TileState& state);

}  // namespace fulcrum::thermal
