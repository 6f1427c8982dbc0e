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

CoarseFactor::CoarseFactor(std::vector<std::vector<std::uint32_t>> order) {
  Eigen::Index size = 0;
  for (std::vector<std::uint32_t>& nodes : order) {
    for (const std::uint32_t node : nodes) {
      for (int axis = 0; axis < 3; ++axis) row_.push_back(3 * static_cast<int>(node) + axis);
    }
    size += 3 * static_cast<Eigen::Index>(nodes.size());
    while (row_.size() % kFactorBlock != 0) row_.push_back(-1);
    const int end = static_cast<int>(row_.size()) / kFactorBlock;
    groups_.push_back({std::move(nodes), columns_, end});
    columns_ = end;
  }
  const auto blocks = static_cast<std::size_t>(columns_);
  solution_ = FloatArray(kFactorBlock * blocks);
  making_ = FloatArray(kFactorBlockFloats * blocks * blocks);
  filled_.assign(blocks * blocks, 0);
  for (Triangle* triangle : {&down_, &up_, &next_down_, &next_up_}) {
    triangle->start.reserve(blocks + 1);
    triangle->block.reserve(blocks * (blocks + 1) / 2);
    triangle->value = FloatArray(blocks * (blocks + 1) / 2 * kFactorBlockFloats);
  }
  (void)Take(KernelsFor(), Eigen::MatrixXf::Identity(size, size));  // In force until the first matrix is factored.
}

/// The lower part of a column of blocks of P A P^T, with ones on the diagonal where it has no row.
void CoarseFactor::LoadColumn(const Eigen::MatrixXf& matrix, int column) {
  for (int row = column; row < columns_; ++row) {
    BlockAt(row, column).setZero();
  }
  for (int c = 0; c < kFactorBlock; ++c) {
    const int at = kFactorBlock * column + c;
    const int own = row_[static_cast<std::size_t>(at)];
    if (own < 0) {
      BlockAt(column, column)(c, c) = 1.0f;
      continue;
    }
    const float* const from = matrix.col(own).data();
    for (int row = column; row < columns_; ++row) {
      float* const to = BlockAt(row, column).col(c).data();
      const int* const number = row_.data() + static_cast<std::size_t>(kFactorBlock) * static_cast<std::size_t>(row);
      for (int i = 0; i < kFactorBlock; ++i) {
        if (number[i] >= 0) to[i] = from[number[i]];
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

void CoarseFactor::Solve(const Kernels& kernels, float* x, std::span<const std::uint8_t> left_out) {
  const auto taken = [&](std::size_t group) { return left_out.empty() || left_out[group] == 0; };
  const auto part = [&](const Group& group) {
    return solution_.data() + static_cast<std::size_t>(kFactorBlock) * static_cast<std::size_t>(group.first_column);
  };
  const auto substitute = [&](const Triangle& triangle, int first_step, const Group& group) {
    Substitution steps = triangle.order();
    steps.start += first_step;
    steps.steps = group.end_column - group.first_column;
    kernels.factor.substitute(steps, triangle.value.data(), solution_.data());
  };
  for (std::size_t i = 0; i < groups_.size(); ++i) {
    if (!taken(i)) continue;
    float* to = part(groups_[i]);
    for (const std::uint32_t node : groups_[i].nodes) to = std::copy_n(x + kVertexFloats * node, 3, to);
  }
  for (std::size_t i = 0; i < groups_.size(); ++i) {
    if (taken(i)) substitute(down_, groups_[i].first_column, groups_[i]);
  }
  for (std::size_t i = groups_.size(); i-- > 0;) {
    if (taken(i)) substitute(up_, columns_ - groups_[i].end_column, groups_[i]);
  }
  for (std::size_t i = 0; i < groups_.size(); ++i) {
    if (!taken(i)) continue;
    const float* from = part(groups_[i]);
    for (const std::uint32_t node : groups_[i].nodes) {
      std::copy_n(from, 3, x + kVertexFloats * node);
      from += 3;
    }
  }
}

}  // namespace fulcrum::physics::implicit
