// Electric potential of the paper (eq. 13): div grad V = 0 on a square texture, by Jacobi sweeps.
//
// The electrical conductivity of tissue is uniform; the electrode's texels are at 1 V, the texture's border is at 0 V,
// holes insulate. The solution is not iterated to convergence: each frame starts from the last potential and does a
// fixed number of sweeps.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace fulcrum::thermal {

inline constexpr int kTexture = 256;  ///< Texels along the edge.

class TexturePotential {
 public:
  TexturePotential();

  /// One row of texels: 1 where there is tissue, 0 elsewhere.
  [[nodiscard]] std::span<float> tissue_row(int j) { return std::span(tissue_).subspan(At(0, j), kTexture); }
  /// Adds the tissue texel (i, j) to the electrode. Call after the rows are set and before Relax.
  void SetElectrode(int i, int j);
  /// Does `count` Jacobi sweeps over the texture.
  void Relax(int count);

  /// Electrode current at 1 V per sheet conductance sigma d [1]. Removes the electrode.
  [[nodiscard]] float TakeConductance();
  /// Sum over a texel's faces of half (V - V')^2: its Joule heat at 1 V per sheet conductance [1], for one row.
  void HeatOfRow(int j, std::span<float> out) const;

  /// Moves the potential by whole texels: the value at (i, j) moves to (i - di, j - dj).
  void Shift(int di, int dj);
  void Clear();
  /// Potential with its halo, for checkpoints.
  [[nodiscard]] std::span<float> state() { return volt_; }
  [[nodiscard]] std::span<const float> state() const { return volt_; }
  [[nodiscard]] static constexpr std::size_t StateBytes() { return sizeof(float) * (kTexture + 2) * kStride; }

 private:
  static constexpr int kHalo = 8;  ///< Left and right, so that rows stay aligned; one row above and below.
  static constexpr int kStride = kTexture + 2 * kHalo;
  static constexpr int At(int i, int j) { return (j + 1) * kStride + kHalo + i; }

  void SetWeights();

  std::vector<float> tissue_;          ///< The halo counts as tissue at 0 V: the grounded border.
  std::vector<float> weight_, fixed_;  ///< A sweep is V = weight * (sum of the neighbours) + fixed.
  std::vector<float> volt_, next_;
  std::vector<int> electrode_;
};

}  // namespace fulcrum::thermal
