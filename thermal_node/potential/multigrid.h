// One level of the cell-centred grid hierarchy and its kernels. Private to the potential solver.
#pragma once

#include <algorithm>
#include <array>
#include <vector>

namespace fulcrum::thermal {

inline constexpr float kJacobiWeight = 0.8f;  ///< Best smoothing of the five-point operator (factor 0.6).

/// n x n cells with a halo of zeros: four floats on the left and right, one row above and below.
struct Level {
  explicit Level(int size);
  [[nodiscard]] int At(int i, int j) const { return (j + 1) * stride + 4 + i; }

  int n, stride, count;
  std::vector<float> face_x;   ///< Between (i-1, j) and (i, j), at At(i, j) [S].
  std::vector<float> face_y;   ///< Between (i, j-1) and (i, j).
  std::vector<float> mass;     ///< Contact plus ground [S].
  std::vector<float> diag;     ///< 0 where there is no tissue.
  std::vector<float> smooth;   ///< kJacobiWeight / diag.
  std::vector<float> x, b, r;  ///< Of the V-cycle.

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
