// The Cholesky factor of the coarse matrix, laid out for the substitutions.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <vector>

#include "physics_node/accurate/kernels.h"
#include "physics_node/pbd/particle_store.h"

namespace fulcrum::physics::accurate {

/// P A P^T = L L^T for a matrix of 3 x 3 blocks, one pair of nodes each. L and L^T are kept in blocks of kFactorBlock
/// rows, those of zeros left out, in the order in which their substitutions read them and with the blocks of the
/// diagonal inverted: a solve is products of blocks and vectors, in one pass over the memory each way.
class CoarseFactor {
 public:
  /// `order`: the nodes in the order of elimination. Neighbours should stand close together, so that L is a band.
  explicit CoarseFactor(std::vector<std::uint32_t> order = {});
  /// Factors `matrix`, symmetric, 3 rows per node. False when it is not positive definite: the last factor stays.
  bool Take(const Eigen::MatrixXf& matrix);
  /// x <- A^-1 x, xyz_ per node; the fourth stays.
  void Solve(const Kernels& kernels, float* x);
  /// Blocks of L that are kept.
  [[nodiscard]] std::size_t block_count() const { return down_.block.size(); }

 private:
  struct Triangle {
    std::vector<std::uint32_t> start, block;
    FloatArray value;  ///< Room for all blocks, aligned as the kernels need it.
    [[nodiscard]] Substitution order() const {
      return {static_cast<int>(start.size()) - 1, start.data(), block.data()};
    }
  };
  void Pack(bool up, Triangle* triangle);

  std::vector<std::uint32_t> order_;
  Eigen::MatrixXf permuted_, factor_;  ///< factor_ is padded to whole blocks, with ones on the diagonal.
  Eigen::LLT<Eigen::MatrixXf> llt_;
  Triangle down_, up_;
  FloatArray solution_;
};

}  // namespace fulcrum::physics::accurate
