#include "services/transport/link/allow_list.h"

#include <gtest/gtest.h>

namespace fulcrum::link {
namespace {

constexpr std::uint32_t BitOf(NodeId node) { return 1u << static_cast<unsigned>(node); }
constexpr std::uint32_t kAll = (1u << kNodeCount) - 1;
constexpr std::uint32_t kRemote = BitOf(NodeId::kThermal) | BitOf(NodeId::kRender);
constexpr Side kCart{bus::FarSide::kCart, kAll & ~kRemote};
constexpr Side kHost{bus::FarSide::kHost, kRemote};

TEST(AllowList, EveryTopicOfANodeMayTravelAndNoCommandDoes) {
  for (int i = 0; i < kTopicCount; ++i) {
    const auto topic = static_cast<TopicId>(i);
    const bool of_nodes = topic == TopicId::kHealth || topic == TopicId::kTickManifest;
    const bool heavy = topic == TopicId::kPicture;
    EXPECT_EQ(bus::Contains(kTravels, topic), !heavy && (bus::OwnerOf(topic).has_value() || of_nodes)) << i;
  }
}

TEST(AllowList, WhatLeavesOneSideMayArriveAtTheOtherAndNeverBothWays) {
  for (int i = 0; i < kTopicCount; ++i) {
    const auto topic = static_cast<TopicId>(i);
    EXPECT_EQ(kCart.MayLeave(topic), kHost.MayArrive(topic)) << i;
    EXPECT_EQ(kHost.MayLeave(topic), kCart.MayArrive(topic)) << i;
    if (topic != TopicId::kHealth) {
      EXPECT_FALSE(kCart.MayLeave(topic) && kCart.MayArrive(topic)) << i;
    }
  }
}

TEST(AllowList, EachSideMayWriteTheTopicsOfItsNodesOnly) {
  for (const TopicId topic : {TopicId::kTopologyState, TopicId::kTemperaturePatch, TopicId::kThermalEvent}) {
    EXPECT_TRUE(kCart.MayArrive(topic));
    EXPECT_FALSE(kHost.MayArrive(topic));
  }
  for (const TopicId topic : {TopicId::kSceneManifest, TopicId::kGeneratorSetting, TopicId::kToolState,
                              TopicId::kTissueFrame, TopicId::kHandleState}) {
    EXPECT_FALSE(kCart.MayArrive(topic));
    EXPECT_TRUE(kHost.MayArrive(topic));
  }
  EXPECT_TRUE(kCart.MayArrive(TopicId::kTickManifest));
  EXPECT_FALSE(kHost.MayArrive(TopicId::kTickManifest));
}

TEST(AllowList, AMessageThatNamesItsNodeMustComeFromThatNodesHost) {
  EXPECT_TRUE(kCart.MayArriveOf(NodeId::kRender));
  for (const NodeId node : {NodeId::kSupervisor, NodeId::kPhysics, NodeId::kRecorder}) {
    EXPECT_FALSE(kCart.MayArriveOf(node));
    EXPECT_TRUE(kHost.MayArriveOf(node));
  }
  EXPECT_FALSE(kHost.MayArriveOf(NodeId::kThermal));
  for (const int number : {kNodeCount, 32, 255}) {
    EXPECT_FALSE(kCart.MayArriveOf(static_cast<NodeId>(number)));
    EXPECT_FALSE(kHost.MayArriveOf(static_cast<NodeId>(number)));
  }
}

}  // namespace
}  // namespace fulcrum::link
