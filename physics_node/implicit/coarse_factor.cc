#include "physics_node/implicit/coarse_factor.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <utility>

namespace fulcrum::physics::implicit {

void CoarseFactor::Triangle::Clear() {
  start.assign(1, 0);
  block.clear();
}

void CoarseFactor::Triangle::Put(int row, const Block& block_of_row) {
  std::copy_n(block_of_row.data(), kFactorBlockFloats, value.data() + kFactorBlockFloats * block.size());
  block.push_back(static_cast<std::uint32_t>(row));
}

CoarseFactor::CoarseFactor(std::vector<std::uint32_t> order)
    : order_(std::move(order)), columns_((3 * static_cast<int>(order_.size()) + kFactorBlock - 1) / kFactorBlock) {
  const auto blocks = static_cast<std::size_t>(columns_);
  solution_ = FloatArray(kFactorBlock * blocks);
  making_ = FloatArray(kFactorBlockFloats * blocks * blocks);
  filled_.assign(blocks * blocks, 0);
  for (Triangle* triangle : {&down_, &up_, &next_down_, &next_up_}) {
    triangle->start.reserve(blocks + 1);
    triangle->block.reserve(blocks * (blocks + 1) / 2);
    triangle->value = FloatArray(blocks * (blocks + 1) / 2 * kFactorBlockFloats);
  }
  const auto size = static_cast<Eigen::Index>(3 * order_.size());
  (void)Take(KernelsFor(), Eigen::MatrixXf::Identity(size, size));  // In force until the first matrix is factored.
}

/// The lower part of a column of blocks of P A P^T, with ones on the diagonal beyond its last row.
void CoarseFactor::LoadColumn(const Eigen::MatrixXf& matrix, int column) {
  const int size = 3 * static_cast<int>(order_.size());
  for (int row = column; row < columns_; ++row) {
    BlockAt(row, column).setZero();
  }
  for (int c = 0; c < kFactorBlock; ++c) {
    const int at = kFactorBlock * column + c;
    if (at >= size) {
      BlockAt(column, column)(c, c) = 1.0f;
      continue;
    }
    const auto number = [&](int i) {
      return 3 * order_[static_cast<std::size_t>(i / 3)] + static_cast<unsigned>(i % 3);
    };
    const float* const from = matrix.data() + static_cast<std::size_t>(size) * number(at);
    for (int row = column; row < columns_; ++row) {
      float* const to = BlockAt(row, column).col(c).data();
      const int first = kFactorBlock * row, end = std::min(first + kFactorBlock, size);
      for (int i = first; i < end; ++i) {
        to[i - first] = from[number(i)];
      }
    }
  }
  for (int row = column; row < columns_; ++row) {
    filled_[At(row, column)] = BlockAt(row, column).isZero(0) ? 0 : 1;
  }
}

bool CoarseFactor::FactorColumn(const Kernels& kernels, int column) {
  for (int before = 0; before < column; ++before) {
    if (filled_[At(column, before)] == 0) {
      continue;
    }
    for (int row = column; row < columns_; ++row) {
      if (filled_[At(row, before)] != 0) {
        kernels.factor.block_product(BlockAt(row, before).data(), BlockAt(column, before).data(), true,
                                     BlockAt(row, column).data());
        filled_[At(row, column)] = 1;
      }
    }
  }
  const Eigen::LLT<Block> diagonal(BlockAt(column, column));
  if (diagonal.info() != Eigen::Success || !diagonal.matrixLLT().diagonal().allFinite()) {
    return false;
  }
  alignas(64) const Block inverse = diagonal.matrixL().solve(Block::Identity());
  BlockAt(column, column) = inverse;
  next_down_.Put(column, inverse);
  for (int row = column + 1; row < columns_; ++row) {
    if (filled_[At(row, column)] != 0) {
      alignas(64) Block block;
      kernels.factor.block_product(BlockAt(row, column).data(), inverse.data(), false, block.data());
      BlockAt(row, column) = block;
      next_down_.Put(row, block);
    }
  }
  next_down_.EndColumn();
  return true;
}

void CoarseFactor::PackTransposed() {
  next_up_.Clear();
  for (int column = columns_ - 1; column >= 0; --column) {
    for (int row = column; row >= 0; --row) {
      if (filled_[At(column, row)] != 0) {
        next_up_.Put(row, BlockAt(column, row).transpose());
      }
    }
    next_up_.EndColumn();
  }
}

CoarseFactor::Progress CoarseFactor::Continue(const Kernels& kernels, const Eigen::MatrixXf& matrix, int columns) {
  if (next_column_ == 0) {
    next_down_.Clear();
  }
  for (const int end = std::min(next_column_ + columns, columns_); next_column_ < end; ++next_column_) {
    LoadColumn(matrix, next_column_);
    if (!FactorColumn(kernels, next_column_)) {
      next_column_ = 0;
      return Progress::kRefused;
    }
  }
  if (next_column_ < columns_) {
    return Progress::kMore;
  }
  next_column_ = 0;
  PackTransposed();
  std::swap(down_, next_down_);
  std::swap(up_, next_up_);
  return Progress::kTaken;
}

bool CoarseFactor::Take(const Kernels& kernels, const Eigen::MatrixXf& matrix) {
  next_column_ = 0;
  return Continue(kernels, matrix, columns_) == Progress::kTaken;
}

void CoarseFactor::Solve(const Kernels& kernels, float* x) {
  float* to = solution_.data();
  for (const std::uint32_t node : order_) {
    to = std::copy_n(x + kVertexFloats * node, 3, to);
  }
  kernels.factor.substitute(down_.order(), down_.value.data(), solution_.data());
  kernels.factor.substitute(up_.order(), up_.value.data(), solution_.data());
  const float* from = solution_.data();
  for (const std::uint32_t node : order_) {
    std::copy_n(from, 3, x + kVertexFloats * node);
    from += 3;
  }
}

}  // namespace fulcrum::physics::implicit
