#include "services/transport/link/epoch_map.h"

#include <gtest/gtest.h>

namespace fulcrum::link {
namespace {

TEST(EpochMap, AProcessKeepsItsEpochAndALaterOneGetsALaterOne) {
  EpochMap map;
  const auto first = map.ToOurs(TopicId::kToolState, 500, true, 1000);
  EXPECT_EQ(first, 1000u);
  EXPECT_EQ(map.ToOurs(TopicId::kToolState, 500, true, 2000), first);
  const auto second = map.ToOurs(TopicId::kToolState, 700, true, 900);
  EXPECT_GT(second, first);
  EXPECT_EQ(map.ToTheirs(TopicId::kToolState, *second), 700u);
  EXPECT_EQ(map.ToTheirs(TopicId::kToolState, 4), 4u);
}

TEST(EpochMap, WhatAReplacedProcessStillSendsIsNotItsSuccessors) {
  EpochMap map;
  (void)map.ToOurs(TopicId::kToolState, 700, true, 1000);
  EXPECT_EQ(map.ToOurs(TopicId::kToolState, 500, true, 1001), std::nullopt);
  EXPECT_TRUE(map.ToOurs(TopicId::kHealth, 700, false, 1002));
  EXPECT_TRUE(map.ToOurs(TopicId::kHealth, 500, false, 1003));
}

TEST(EpochMap, AnotherLinkOnOurSideGivesLaterEpochs) {
  EpochMap before, after;
  EXPECT_GT(after.ToOurs(TopicId::kToolState, 500, true, 2000), before.ToOurs(TopicId::kToolState, 500, true, 1000));
}

}  // namespace
}  // namespace fulcrum::link
