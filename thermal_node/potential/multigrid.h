// One level of the cell-centred grid hierarchy and its kernels. Private to the potential solver.
#pragma once

#include <cstddef>
#include <limits>
#include <new>
#include <vector>

namespace fulcrum::thermal {

inline constexpr float kJacobiWeight = 0.8f;  ///< Best smoothing of the five-point operator (factor 0.6).
inline constexpr float kTiny = std::numeric_limits<float>::min();  ///< Keeps 0/0 where nothing conducts at 0.

/// Widest vector of any CPU; a load that straddles two of its kind costs twice.
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
  Field diag;     ///< 0 where there is no tissue, and where an island floats that is one cell of this level.
  Field smooth;   ///< kJacobiWeight / diag, 0 where diag is 0.
  Field x, b, r;  ///< Of the V-cycle.

  /// diag and smooth from faces and mass.
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

/// Faces and mass of the next coarser level. A coarse face is twice as long and its cells twice as far apart, so its
/// conductance is the mean of the two fine ones.
void Coarsen(const Level& fine, Level* coarse);
/// One symmetric V-cycle from level `l` on: levels[l].x from levels[l].b.
void VCycle(std::vector<Level>* levels, std::size_t l);

}  // namespace fulcrum::thermal
