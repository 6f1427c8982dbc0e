// The others' attempts, without names.
#include "services/session/training/cohort.h"

#include <gtest/gtest.h>

#include <array>

namespace fulcrum::training {
namespace {

TEST(Cohort, QuantilesLieBetweenTheValues) {
  const std::array values{10.0, 20.0, 40.0};
  EXPECT_DOUBLE_EQ(Quantile(values, 0), 10);
  EXPECT_DOUBLE_EQ(Quantile(values, 0.25), 15);
  EXPECT_DOUBLE_EQ(Quantile(values, 0.5), 20);
  EXPECT_DOUBLE_EQ(Quantile(values, 1), 40);
  EXPECT_DOUBLE_EQ(Quantile(std::array{7.0}, 0.75), 7);
}

TEST(Cohort, AttemptsOfFewerThanThreePeopleAreNotTold) {
  std::vector<std::vector<double>> scores{{50, 60, 70}, {30, 90}};
  EXPECT_TRUE(CohortOf(scores).empty());
  scores.push_back({});
  EXPECT_TRUE(CohortOf(scores).empty()) << "a person without an attempt is none of three";
  scores.push_back({10, 80, 85, 90});
  const std::vector<Spread> spreads = CohortOf(scores);
  ASSERT_EQ(spreads.size(), 2u) << "only two have a third attempt";
  EXPECT_EQ(spreads[0].people, 3);
  EXPECT_DOUBLE_EQ(spreads[0].low, 20);
  EXPECT_DOUBLE_EQ(spreads[0].median, 30);
  EXPECT_DOUBLE_EQ(spreads[0].high, 40);
  EXPECT_DOUBLE_EQ(spreads[1].median, 80);
}

}  // namespace
}  // namespace fulcrum::training
