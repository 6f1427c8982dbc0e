// Ten thousand random grasps, cuts and releases on one organ, as many on several solids; half with a grasper and a
// hook, half with two graspers.
#include <gtest/gtest.h>

#include <cstdio>

#include "tests/numerics/physics/grasp_cut_fuzz.h"

namespace fulcrum::physics {
namespace {

constexpr int kOperations = 5000, kRestEvery = 100;

/// Seed, and whether there are several solids.
class GraspCutSoak : public testing::TestWithParam<std::pair<unsigned, bool>> {};

TEST_P(GraspCutSoak, FiveThousandOperations) {
  GraspCutFuzz fuzz(GetParam().first, GetParam().second);
  for (int i = 1; i <= kOperations; ++i) {
    ASSERT_EQ(fuzz.Operate(), "") << "seed " << GetParam().first << " operation " << i;
    if (i % kRestEvery == 0) {
      ASSERT_EQ(fuzz.Rest(), "") << "seed " << GetParam().first << " operation " << i;
    }
  }
  const FuzzCounts& c = fuzz.counts();
  EXPECT_GT(c.debris, 0);
  EXPECT_GT(c.revivals, 0);
  EXPECT_GT(c.restarts, 0);
  std::printf(
      "%d grasps (%d held), %d pulls, %d releases, %d cuts, %d restarts, %d sheets in %llu steps; at most "
      "%d nodes loose, %.1f mm from rest, %.2f m/s; let alone %.2f mm, "
      "%.3f m/s, %d of %d times not asleep\n",
      c.grasps, c.holds, c.pulls, c.releases, c.cuts, c.restarts, c.revivals + 1,
      static_cast<unsigned long long>(c.steps), c.debris, 1e3 * c.farthest_m, c.fastest_m_s, 1e3 * c.farthest_at_rest_m,
      c.fastest_at_rest_m_s, c.restless, c.rests);
}

INSTANTIATE_TEST_SUITE_P(Seeds, GraspCutSoak,
                         testing::Values(std::pair{11u, false}, std::pair{12u, false}, std::pair{13u, true},
                                         std::pair{14u, true}));

}  // namespace
}  // namespace fulcrum::physics
