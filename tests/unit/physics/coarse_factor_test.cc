// The factor of the coarse matrix against a dense solve, on every instruction set, and the blocks that it omits.
#include "physics_node/implicit/coarse_factor.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <numeric>
#include <vector>

namespace fulcrum::physics::implicit {
namespace {

constexpr int kNodes = 37;  // 111 rows: the last block of sixteen is not full.

/// A chain in which each node is coupled to its neighbours up to `reach` away, numbered 0, 2, 4, ..., 5, 3, 1.
Eigen::MatrixXf Chain(int reach) {
  Eigen::MatrixXf matrix = Eigen::MatrixXf::Zero(3 * kNodes, 3 * kNodes);
  const auto number = [](int place) { return 2 * place < kNodes ? 2 * place : 2 * (kNodes - place) - 1; };
  for (int a = 0; a < kNodes; ++a) {
    matrix.block<3, 3>(3 * number(a), 3 * number(a)) += 0.1f * Eigen::Matrix3f::Identity();
    for (int b = a + 1; b < std::min(a + reach + 1, kNodes); ++b) {
      const Eigen::Vector3f d = Eigen::Vector3f(1.0f, 0.3f * static_cast<float>(b % 3), 0.2f).normalized();
      const Eigen::Matrix3f k = 0.2f * Eigen::Matrix3f::Identity() + d * d.transpose();
      const int i = 3 * number(a), j = 3 * number(b);
      matrix.block<3, 3>(i, i) += k;
      matrix.block<3, 3>(j, j) += k;
      matrix.block<3, 3>(i, j) -= k;
      matrix.block<3, 3>(j, i) -= k;
    }
  }
  return matrix;
}
std::vector<std::vector<std::uint32_t>> AlongChain() {
  std::vector<std::uint32_t> order;
  order.reserve(kNodes);
  for (int place = 0; place < kNodes; ++place) {
    order.push_back(static_cast<std::uint32_t>(2 * place < kNodes ? 2 * place : 2 * (kNodes - place) - 1));
  }
  return {order};
}
FloatArray RightSide() {
  FloatArray x(4 * kNodes);
  for (std::size_t i = 0; i < x.size(); ++i) {
    x[i] = i % 4 == 3 ? 77.0f : static_cast<float>((7 * i) % 11) - 5.0f;
  }
  return x;
}

TEST(CoarseFactor, SolvesAsADenseOneInAnyOrder) {
  const Eigen::MatrixXf matrix = Chain(4);
  Eigen::VectorXf right(3 * kNodes);
  const FloatArray b = RightSide();
  for (Eigen::Index i = 0; i < right.size(); ++i) {
    right[i] = b[static_cast<std::size_t>(4 * (i / 3) + i % 3)];
  }
  const Eigen::VectorXd exact = matrix.cast<double>().llt().solve(right.cast<double>());
  std::vector<std::uint32_t> as_numbered(kNodes);
  std::iota(as_numbered.begin(), as_numbered.end(), 0u);
  const std::vector<std::uint32_t> along = AlongChain().front();
  const std::vector<std::vector<std::uint32_t>> by_groups{{along.begin(), along.begin() + 11},
                                                          {along.begin() + 11, along.end()}};
  using Groups = std::vector<std::vector<std::uint32_t>>;
  for (const Groups& order : {Groups{as_numbered}, AlongChain(), by_groups}) {
    CoarseFactor factor(order);
    ASSERT_TRUE(factor.Take(KernelsFor(InstructionSet::kBaseline), matrix));
    FloatArray x = RightSide();
    factor.Solve(KernelsFor(InstructionSet::kBaseline), x.data());
    for (Eigen::Index i = 0; i < right.size(); ++i) {
      EXPECT_NEAR(x[static_cast<std::size_t>(4 * (i / 3) + i % 3)], exact[i], 1e-4 * exact.norm());
    }
    EXPECT_EQ(x[3], 77.0f) << "the fourth value of a node is unchanged";
  }
}

TEST(CoarseFactor, LeavesOutGroups) {
  // Three groups along the chain: what comes before is left out exactly, what lies between others as if it stood still.
  const std::vector<std::uint32_t> along = AlongChain().front();
  const std::vector<std::vector<std::uint32_t>> groups{
      {along.begin(), along.begin() + 11}, {along.begin() + 11, along.begin() + 20}, {along.begin() + 20, along.end()}};
  CoarseFactor factor(groups);
  const Kernels& kernels = KernelsFor(InstructionSet::kBaseline);
  ASSERT_TRUE(factor.Take(kernels, Chain(4)));
  const auto solve = [&](FloatArray x, std::vector<std::uint8_t> left_out) {
    factor.Solve(kernels, x.data(), left_out);
    return x;
  };
  const auto only = [&](std::initializer_list<std::size_t> taken) {
    FloatArray x = RightSide();
    for (std::size_t g = 0; g < groups.size(); ++g) {
      if (std::find(taken.begin(), taken.end(), g) != taken.end()) continue;
      for (const std::uint32_t node : groups[g]) std::fill_n(x.data() + 4 * node, 3, 0.0f);
    }
    return x;
  };
  const FloatArray whole = solve(only({1, 2}), {}), part = solve(only({1, 2}), {1, 0, 0});
  for (std::size_t g = 0; g < groups.size(); ++g) {
    for (const std::uint32_t node : groups[g]) {
      for (std::size_t i = 4 * node; i < 4 * node + 3; ++i) {
        if (g == 0) {
          EXPECT_EQ(part[i], 0.0f) << "stays as it was";
        } else {
          EXPECT_EQ(part[i], whole[i]);
        }
      }
    }
  }
  // Without the middle one the result is still symmetric and positive: z_a . b = a . z_b, z_a . a > 0.
  const FloatArray a = only({0}), b = only({2}), z_a = solve(only({0}), {0, 1, 0}), z_b = solve(only({2}), {0, 1, 0});
  double ab = 0, ba = 0, aa = 0, bb = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (i % 4 == 3) continue;
    ab += static_cast<double>(z_a[i] * b[i]);
    ba += static_cast<double>(a[i] * z_b[i]);
    aa += static_cast<double>(z_a[i] * a[i]);
    bb += static_cast<double>(z_b[i] * b[i]);
  }
  EXPECT_NEAR(ab, ba, 1e-4 * std::sqrt(aa * bb));
  EXPECT_GT(aa, 0);
  EXPECT_GT(bb, 0);
}

TEST(CoarseFactor, IsTheSameOnEveryInstructionSet) {
  CoarseFactor baseline(AlongChain());
  ASSERT_TRUE(baseline.Take(KernelsFor(InstructionSet::kBaseline), Chain(4)));
  FloatArray narrow = RightSide();
  baseline.Solve(KernelsFor(InstructionSet::kBaseline), narrow.data());
  for (const InstructionSet set : kInstructionSets) {
    if (!Has(set)) continue;
    const Kernels& kernels = KernelsFor(set);
    CoarseFactor factor(AlongChain());
    ASSERT_TRUE(factor.Take(kernels, Chain(4)));
    FloatArray wide = RightSide();
    factor.Solve(kernels, wide.data());
    EXPECT_TRUE(std::equal(narrow.data(), narrow.data() + narrow.size(), wide.data())) << kernels.name;
  }
}

TEST(CoarseFactor, LeavesOutBlocksOfZeros) {
  CoarseFactor banded(AlongChain()), whole(AlongChain());
  ASSERT_TRUE(banded.Take(KernelsFor(InstructionSet::kBaseline), Chain(4)));
  ASSERT_TRUE(whole.Take(KernelsFor(InstructionSet::kBaseline), Chain(kNodes)));
  EXPECT_EQ(whole.block_count(), 7u * 8u / 2u);
  EXPECT_EQ(banded.block_count(), 7u + 6u) << "a band within 15 rows reaches into the next block only";
}

TEST(CoarseFactor, KeepsTheLastFactorWhenTheMatrixIsNone) {
  CoarseFactor factor(AlongChain());
  ASSERT_TRUE(factor.Take(KernelsFor(InstructionSet::kBaseline), Chain(4)));
  FloatArray before = RightSide(), after = RightSide();
  factor.Solve(KernelsFor(InstructionSet::kBaseline), before.data());
  Eigen::MatrixXf bad = Chain(4);
  bad(5, 5) = -1.0f;
  EXPECT_FALSE(factor.Take(KernelsFor(InstructionSet::kBaseline), bad));
  bad(5, 5) = std::numeric_limits<float>::quiet_NaN();
  EXPECT_FALSE(factor.Take(KernelsFor(InstructionSet::kBaseline), bad));
  factor.Solve(KernelsFor(InstructionSet::kBaseline), after.data());
  EXPECT_TRUE(std::equal(before.data(), before.data() + before.size(), after.data()));
}

TEST(CoarseFactor, IsTheSameWhenItIsMadeAFewColumnsAtATime) {
  using Progress = CoarseFactor::Progress;
  CoarseFactor at_once(AlongChain()), by_parts(AlongChain());
  ASSERT_TRUE(at_once.Take(KernelsFor(InstructionSet::kBaseline), Chain(4)));
  ASSERT_TRUE(by_parts.Take(KernelsFor(InstructionSet::kBaseline), Chain(2)));
  FloatArray wanted = RightSide(), old = RightSide();
  at_once.Solve(KernelsFor(InstructionSet::kBaseline), wanted.data());
  by_parts.Solve(KernelsFor(InstructionSet::kBaseline), old.data());
  Eigen::MatrixXf bad = Chain(4);
  bad(5, 5) = -1.0f;
  for (const Eigen::MatrixXf& matrix : {bad, Chain(4)}) {
    Progress progress = Progress::kMore;
    int parts = 0;
    for (; progress == Progress::kMore; ++parts) {
      FloatArray x = RightSide();
      by_parts.Solve(KernelsFor(InstructionSet::kBaseline), x.data());
      EXPECT_TRUE(std::equal(x.data(), x.data() + x.size(), old.data()))
          << "the old factor is used until the next one is complete";
      progress = by_parts.Continue(KernelsFor(InstructionSet::kBaseline), matrix, 2);
    }
    if (matrix(5, 5) < 0) {
      EXPECT_EQ(progress, Progress::kRefused);
      continue;
    }
    EXPECT_EQ(progress, Progress::kTaken);
    EXPECT_EQ(parts, 4) << "of seven columns";
  }
  FloatArray x = RightSide();
  by_parts.Solve(KernelsFor(InstructionSet::kBaseline), x.data());
  EXPECT_TRUE(std::equal(x.data(), x.data() + x.size(), wanted.data()));
}

}  // namespace
}  // namespace fulcrum::physics::implicit
