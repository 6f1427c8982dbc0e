// One level of the cell-centred grid hierarchy and its kernels. Private to the potential solver.
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
#pragma once

#include <cstddef>
#include <limits>
#include <new>
#include <vector>

namespace fulcrum::thermal {

/// Optimal damping of Jacobi for the five-point operator (smoothing factor 0.6).
inline constexpr float kJacobiWeight = 0.8f;
/// Added to denominators: 0/0, where nothing conducts, gives 0.
inline constexpr float kTiny = std::numeric_limits<float>::min();

/// Width of the widest vector of any CPU; an unaligned load that crosses a cache line costs twice.
inline constexpr std::size_t kVectorBytes = 64;
inline constexpr int kPad = static_cast<int>(kVectorBytes / sizeof(float));

template <class T>
struct VectorAllocator {
  using value_type = T;
  VectorAllocator() = default;
  template <class U>
  explicit VectorAllocator(const VectorAllocator<U>& /*other*/) {}
  T* allocate(std::size_t count) {
    return static_cast<T*>(::operator new (count * sizeof(T), std::align_val_t{kVectorBytes}));
  }
  void deallocate(T* p, std::size_t /*count*/) { ::operator delete (p, std::align_val_t{kVectorBytes}); }
  bool operator==(const VectorAllocator&) const { return true; }
};
using Field = std::vector<float, VectorAllocator<float>>;

/// n x n cells with a halo of zeros: one vector left and right (the right one is the left one of the next row), one row
/// above and below.
struct Level {
  explicit Level(int size);
  [[nodiscard]] int At(int i, int j) const { return (j + 1) * stride + kPad + i; }

  int n, stride, count;
  Field face_x;   ///< Between (i-1, j) and (i, j), at At(i, j) [S].
  Field face_y;   ///< Between (i, j-1) and (i, j).
  Field mass;     ///< Contact plus ground [S].
  Field diag;     ///< 0 where there is no tissue, and for a floating island that is one cell on this level.
  Field smooth;   ///< kJacobiWeight / diag, 0 where diag is 0.
  Field x, b, r;  ///< Solution, right-hand side and residual of the V-cycle.

  /// Computes diag and smooth from faces and mass.
  void Finish();
  /// out = A v.
  void Apply(const float* v, float* out) const;
  /// r = b - A x.
  void Residual();
  /// x = smooth * b: one Jacobi sweep from x = 0.
  void SmoothFromZero();
  /// x += smooth * (b - A x).
  void Smooth();
};

/// Computes faces and mass of the next coarser level. A coarse face is twice as long and its cells are twice as far
/// apart, so its conductance is the mean of the two fine ones.
void Coarsen(const Level& fine, Level* coarse);
/// One symmetric V-cycle from level `l` on: levels[l].x from levels[l].b.
void VCycle(std::vector<Level>* levels, std::size_t l);

}  // namespace fulcrum::thermal
