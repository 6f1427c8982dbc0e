// Some two hundred random grasps, cuts and releases; grasp_cut_soak_test.cc has ten thousand.
#include <gtest/gtest.h>

#include "tests/numerics/physics/grasp_cut_fuzz.h"

namespace fulcrum::physics {
namespace {

constexpr int kOperations = 90, kRestEvery = 45;

class GraspCut : public testing::TestWithParam<unsigned> {};

TEST_P(GraspCut, NothingBreaks) {
  GraspCutFuzz fuzz(GetParam());
  for (int i = 1; i <= kOperations; ++i) {
    ASSERT_EQ(fuzz.Operate(), "") << "seed " << GetParam() << " operation " << i;
    if (i % kRestEvery == 0) {
      ASSERT_EQ(fuzz.Rest(), "") << "seed " << GetParam() << " operation " << i;
    }
  }
  // All operations occurred.
  EXPECT_GT(fuzz.counts().holds, 10);
  EXPECT_GT(fuzz.counts().cuts, 15);
}

TEST(GraspCutOfSeveralSolids, NothingBreaks) {
  GraspCutFuzz fuzz(4, true);
  for (int i = 1; i <= 2 * kOperations; ++i) {
    ASSERT_EQ(fuzz.Operate(), "") << "operation " << i;
    if (i % kRestEvery == 0) {
      ASSERT_EQ(fuzz.Rest(), "") << "operation " << i;
    }
  }
  EXPECT_GT(fuzz.counts().holds, 15);
}

INSTANTIATE_TEST_SUITE_P(Seeds, GraspCut, testing::Values(1u, 2u));

TEST(GraspCut, TheSameSeedDoesTheSame) {
  GraspCutFuzz one(7), other(7);
  for (int i = 0; i < 30; ++i) {
    ASSERT_EQ(one.Operate(), "");
    ASSERT_EQ(other.Operate(), "");
    ASSERT_EQ(one.StateHash(), other.StateHash()) << i;
  }
}

}  // namespace
}  // namespace fulcrum::physics
