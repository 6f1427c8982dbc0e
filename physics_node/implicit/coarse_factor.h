// The Cholesky factor of the coarse matrix, made by columns of blocks and laid out for the substitutions.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "physics_node/implicit/kernels.h"
#include "physics_node/tissue/particle_store.h"

namespace fulcrum::physics::implicit {

/// P A P^T = L L^T for a matrix A of 3 x 3 blocks, one per pair of nodes, and a permutation P of the nodes:
///
///   column k, left-looking:  S_ik = A_ik - sum_{j<k} L_ij L_kj^T for i >= k,  L_kk L_kk^T = S_kk,  L_ik = S_ik L_kk^-T
///   solve:                   L y = P b,  L^T P x = y
///
/// with blocks of kFactorBlock rows. L and L^T are stored without blocks of zeros, in the order in which their
/// substitutions read them and with the blocks of the diagonal inverted: a solve is products of blocks and vectors, in
/// one pass over the memory each way. A new factor is made beside the one in force, so it may be made a few columns at
/// a time; nothing is allocated for it.
class CoarseFactor {
 public:
  enum class Progress { kMore, kTaken, kRefused };

  /// `order`: the nodes in the order of elimination, by groups. With neighbours close together L is a band.
  /// Each group begins with a column of blocks of its own, so a solve can leave it out.
  explicit CoarseFactor(std::vector<std::vector<std::uint32_t>> order = {});
  /// Factors the next `columns` columns of blocks of `matrix`, symmetric, 3 rows per node, which must stay as it is
  /// from the first of them to the last. Then the factor is in force, and what follows begins anew. Refused as soon as
  /// the matrix turns out not to be positive definite: the last factor stays.
  Progress Continue(const Kernels& kernels, const Eigen::MatrixXf& matrix, int columns);
  /// All columns at once. False when refused.
  bool Take(const Kernels& kernels, const Eigen::MatrixXf& matrix);
  /// x <- A^-1 x, xyz_ per node; the fourth stays. Groups marked in `left_out` (by group; empty: none) keep their x and
  /// cost nothing: their columns of L and rows of L^T are left out of both substitutions. Where x of the first groups
  /// is zero, that changes nothing for the others; otherwise they are solved as if a group before them, that is joined
  /// to them, did not move, which is still symmetric and positive definite.
  void Solve(const Kernels& kernels, float* x, std::span<const std::uint8_t> left_out = {});
  /// Columns of blocks.
  [[nodiscard]] int columns() const { return columns_; }
  /// Blocks of L that are kept.
  [[nodiscard]] std::size_t block_count() const { return down_.block.size(); }

 private:
  using Block = Eigen::Matrix<float, kFactorBlock, kFactorBlock>;
  struct Triangle {
    std::vector<std::uint32_t> start, block;
    FloatArray value;  ///< Room for all blocks, aligned as the kernels need it.
    void Clear();
    void Put(int row, const Block& block_of_row);
    void EndColumn() { start.push_back(static_cast<std::uint32_t>(block.size())); }
    [[nodiscard]] Substitution order() const {
      return {static_cast<int>(start.size()) - 1, start.data(), block.data()};
    }
  };
  [[nodiscard]] std::size_t At(int row, int column) const {
    return static_cast<std::size_t>(column) * static_cast<std::size_t>(columns_) + static_cast<std::size_t>(row);
  }
  [[nodiscard]] Eigen::Map<Block, Eigen::Aligned64> BlockAt(int row, int column) {
    return Eigen::Map<Block, Eigen::Aligned64>(making_.data() + kFactorBlockFloats * At(row, column));
  }
  void LoadColumn(const Eigen::MatrixXf& matrix, int column);
  bool FactorColumn(const Kernels& kernels, int column);
  void PackTransposed();

  struct Group {
    std::vector<std::uint32_t> nodes;
    int first_column = 0, end_column = 0;
  };
  std::vector<Group> groups_;
  std::vector<int> row_;  ///< By row of P A P^T: that of A, -1 between two groups.
  int columns_ = 0;
  Triangle down_, up_;  ///< In force.
  FloatArray solution_;

  // The next factor, as far as it is made.
  int next_column_ = 0;
  FloatArray making_;                 ///< Blocks of L by columns, with the inverses of those on the diagonal.
  std::vector<std::uint8_t> filled_;  ///< By block: not zero.
  Triangle next_down_, next_up_;
};

}  // namespace fulcrum::physics::implicit
