// Cell-centred grid hierarchy and its kernels. Private to the potential solver.
//
//   (A v)_c = diag_c v_c - sum over the four faces of G_f v_n,   diag_c = sum of G_f + mass_c
//
// v potential at 1 V of the electrode [1], G_f conductance of the face between cell c and its neighbour n [S], mass
// conductance of the cell to electrode and return electrode [S]; A v is a current per volt [S]. Stencil: five points.
// The halo has conductance 0, so no current crosses the border of the grid.
//
// V-cycle: damped Jacobi, x <- x + w D^-1 (b - A x), once before and once after the coarse correction; restriction by
// the sum over 2 x 2 cells, prolongation by a constant over them, its transpose. So the cycle is a symmetric operator,
// as conjugate gradients require of a preconditioner.
//
// Sizes are known to the compiler: half of the levels have rows of at most one vector.
#pragma once

#include <array>
#include <limits>

#include "thermal_node/potential/potential_solver.h"

namespace fulcrum::thermal {

/// Optimal damping of Jacobi for the five-point operator (smoothing factor 0.6).
inline constexpr float kJacobiWeight = 0.8f;
/// Added to denominators: 0/0, where nothing conducts, gives 0.
inline constexpr float kTiny = std::numeric_limits<float>::min();

/// Floats of the widest vector of any CPU; an unaligned load that crosses a cache line costs twice.
inline constexpr int kPad = 16;

/// kSize x kSize cells with a halo of zeros: one vector left and right (the right one is the left one of the next row),
/// one row above and below.
template <int kSize>
struct Level {
  static constexpr int kStride = kSize + kPad, kCount = (kSize + 2) * kStride + kPad;
  using Field = std::array<float, kCount>;
  [[nodiscard]] static constexpr int At(int i, int j) { return (j + 1) * kStride + kPad + i; }

  alignas(64) Field face_x{};  ///< Between (i-1, j) and (i, j), at At(i, j) [S].
  alignas(64) Field face_y{};  ///< Between (i, j-1) and (i, j).
  alignas(64) Field mass{};    ///< Contact plus ground [S].
  alignas(64) Field diag{};  ///< 0 where there is no tissue, and for a floating island that is one cell on this level.
  alignas(64) Field smooth{};  ///< kJacobiWeight / diag, 0 where diag is 0.
  alignas(64) Field b{};       ///< Right-hand side of the V-cycle.
  alignas(64) Field x{};       ///< Its solution before the last sweep.
  alignas(64) Field z{};       ///< Its result; before the last sweep the residual.
};

/// A level and those below it, down to 2 x 2 cells.
template <int kSize>
struct Grid {
  Level<kSize> level;
  Grid<kSize / 2> coarser;
};
template <>
struct Grid<2> {
  Level<2> level;
};
using Fine = Level<kWindow>;

/// Computes diag and smooth of the finest level from its faces and mass, and the coarser levels. A coarse face is twice
/// as long and its cells are twice as far apart, so its conductance is the mean of the two fine ones.
void SetUp(Grid<kWindow>* grid);
/// out = A v.
void Apply(const Fine& level, const Fine::Field& v, Fine::Field* out);
/// One symmetric V-cycle: level.z from level.b.
void VCycle(Grid<kWindow>* grid);

}  // namespace fulcrum::thermal
