#include "physics_node/accurate/coarse_factor.h"

#include <algorithm>
#include <utility>

namespace fulcrum::physics::accurate {

CoarseFactor::CoarseFactor(std::vector<std::uint32_t> order)
    : order_(std::move(order)), llt_(static_cast<Eigen::Index>(3 * order_.size())) {
  const auto size = static_cast<Eigen::Index>(3 * order_.size());
  const Eigen::Index blocks = (size + kFactorBlock - 1) / kFactorBlock;
  permuted_ = Eigen::MatrixXf::Identity(size, size);
  llt_.compute(permuted_);  // Not left without a state.
  factor_ = Eigen::MatrixXf::Identity(kFactorBlock * blocks, kFactorBlock * blocks);
  solution_ = FloatArray(static_cast<std::size_t>(kFactorBlock * blocks));
  const auto most = static_cast<std::size_t>(blocks * (blocks + 1) / 2);
  for (Triangle* triangle : {&down_, &up_}) {
    triangle->start.reserve(static_cast<std::size_t>(blocks) + 1);
    triangle->block.reserve(most);
    triangle->value = FloatArray(most * kFactorBlock * kFactorBlock);
  }
  Pack(false, &down_);
  Pack(true, &up_);
}

/// From factor_: its columns from the first on, or those of its transpose from the last.
void CoarseFactor::Pack(bool up, Triangle* triangle) {
  using Block = Eigen::Matrix<float, kFactorBlock, kFactorBlock>;
  const auto blocks = static_cast<std::uint32_t>(factor_.rows() / kFactorBlock);
  const auto at = [&](std::uint32_t row, std::uint32_t column) -> Block {
    const auto block = [&](std::uint32_t i, std::uint32_t j) {
      return factor_.block<kFactorBlock, kFactorBlock>(kFactorBlock * i, kFactorBlock * j);
    };
    return up ? Block(block(column, row).transpose()) : Block(block(row, column));
  };
  float* to = triangle->value.data();
  const auto put = [&](std::uint32_t row, const Block& block) {
    triangle->block.push_back(row);
    to = std::copy_n(block.data(), block.size(), to);
  };
  triangle->start.assign(1, 0);
  triangle->block.clear();
  for (std::uint32_t step = 0; step < blocks; ++step) {
    const std::uint32_t own = up ? blocks - 1 - step : step;
    const Block diagonal = at(own, own), identity = Block::Identity();
    put(own, up ? Block(diagonal.triangularView<Eigen::Upper>().solve(identity))
                : Block(diagonal.triangularView<Eigen::Lower>().solve(identity)));
    for (std::uint32_t later = 1; later < blocks - step; ++later) {
      const std::uint32_t row = up ? own - later : own + later;
      const Block block = at(row, own);
      if (!block.isZero(0)) {
        put(row, block);
      }
    }
    triangle->start.push_back(static_cast<std::uint32_t>(triangle->block.size()));
  }
}

bool CoarseFactor::Take(const Eigen::MatrixXf& matrix) {
  const std::size_t nodes = order_.size(), size = 3 * nodes;
  for (std::size_t column = 0; column < size; ++column) {
    const float* from = matrix.data() + size * (3 * order_[column / 3] + column % 3);
    float* to = permuted_.data() + size * column + 3 * (column / 3);
    for (std::size_t i = column / 3; i < nodes; ++i) {
      to = std::copy_n(from + 3 * std::size_t{order_[i]}, 3, to);
    }
  }
  llt_.compute(permuted_);
  if (llt_.info() != Eigen::Success || !llt_.matrixLLT().diagonal().allFinite()) {
    return false;
  }
  factor_.topLeftCorner(permuted_.rows(), permuted_.cols()).triangularView<Eigen::Lower>() = llt_.matrixLLT();
  Pack(false, &down_);
  Pack(true, &up_);
  return true;
}

void CoarseFactor::Solve(const Kernels& kernels, float* x) {
  float* to = solution_.data();
  for (const std::uint32_t node : order_) {
    to = std::copy_n(x + 4 * std::size_t{node}, 3, to);
  }
  kernels.substitute(down_.order(), down_.value.data(), solution_.data());
  kernels.substitute(up_.order(), up_.value.data(), solution_.data());
  const float* from = solution_.data();
  for (const std::uint32_t node : order_) {
    std::copy_n(from, 3, x + 4 * std::size_t{node});
    from += 3;
  }
}

}  // namespace fulcrum::physics::accurate
