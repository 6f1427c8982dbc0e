#include "services/transport/bus/in_process.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

namespace fulcrum::bus {
namespace {

ToolState MakeTool(std::uint64_t sequence, std::uint64_t epoch = 1) {
  ToolState m;
  m.stamp = {sequence, epoch, static_cast<std::int64_t>(1000 * sequence)};
  return m;
}

TEST(InProcess, TakeLatestReturnsTheNewestAndEmptiesTheQueue) {
  InProcessTopic<ToolState> topic;
  auto out = topic.MakeOutput();
  auto in = topic.MakeInput(8);
  for (std::uint64_t i = 1; i <= 5; ++i) EXPECT_TRUE(out->Write(MakeTool(i)));
  ToolState got;
  ASSERT_TRUE(in->TakeLatest(&got));
  EXPECT_EQ(got.stamp.sequence, 5u);
  EXPECT_FALSE(in->TakeLatest(&got));
  EXPECT_EQ(in->stats().received, 5u);
  EXPECT_EQ(in->stats().lost, 0u);
  EXPECT_EQ(in->stats().newest_stamp_ns, 5000);
}

TEST(InProcess, TakeNextKeepsOrder) {
  InProcessTopic<ThermalEvent> topic;
  auto out = topic.MakeOutput();
  auto in = topic.MakeInput(8);
  for (std::uint64_t i = 1; i <= 3; ++i) {
    ThermalEvent e;
    e.stamp = {i, 1, 0};
    ASSERT_TRUE(out->Write(e));
  }
  ThermalEvent got;
  for (std::uint64_t i = 1; i <= 3; ++i) {
    ASSERT_TRUE(in->TakeNext(&got));
    EXPECT_EQ(got.stamp.sequence, i);
  }
  EXPECT_FALSE(in->TakeNext(&got));
}

TEST(InProcess, OverflowCountsAsLostWithinOneEpochOnly) {
  InProcessTopic<ToolState> topic;
  auto out = topic.MakeOutput();
  auto in = topic.MakeInput(2);
  ToolState got;
  out->Write(MakeTool(1));
  ASSERT_TRUE(in->TakeLatest(&got));
  for (std::uint64_t i = 2; i <= 6; ++i) out->Write(MakeTool(i));  // 2, 3, 4 are overwritten
  ASSERT_TRUE(in->TakeLatest(&got));
  EXPECT_EQ(in->stats().lost, 3u);
  out->Write(MakeTool(100, 2));  // a restarted writer: its earlier samples are not a loss
  ASSERT_TRUE(in->TakeLatest(&got));
  EXPECT_EQ(in->stats().lost, 3u);
}

TEST(InProcess, TwoWritersOfOneTopicAreFollowedApart) {
  InProcessTopic<Health> topic;
  auto a = topic.MakeOutput();
  auto b = topic.MakeOutput();
  auto in = topic.MakeInput();
  Health m, got;
  for (std::uint64_t i = 1; i <= 4; ++i) {
    m.stamp = {i, 10, 0};
    a->Write(m);
    m.stamp = {i * 2, 20, 0};  // every second one of b is missing
    b->Write(m);
  }
  while (in->TakeNext(&got)) {
  }
  EXPECT_EQ(in->stats().received, 8u);
  EXPECT_EQ(in->stats().lost, 3u);
}

// Samples of a replaced process are rejected, both from a stopped process that continues and from late delivery.
TEST(InProcess, ALaterProcessShutsOutTheEarlierOne) {
  InProcessTopic<ToolState> topic;
  auto before = topic.MakeOutput();
  auto after = topic.MakeOutput();
  auto in = topic.MakeInput(8);
  before->Write(MakeTool(1, 10));
  after->Write(MakeTool(1, 20));
  before->Write(MakeTool(2, 10));
  ToolState got;
  ASSERT_TRUE(in->TakeNext(&got));
  EXPECT_EQ(got.stamp.epoch, 10u);
  ASSERT_TRUE(in->TakeNext(&got));
  EXPECT_EQ(got.stamp.epoch, 20u);
  EXPECT_FALSE(in->TakeNext(&got));
  EXPECT_EQ(in->stats().rejected, 1u);
  EXPECT_EQ(in->stats().lost, 0u);
  before->Write(MakeTool(3, 10));
  after->Write(MakeTool(2, 20));
  before->Write(MakeTool(4, 10));
  ASSERT_TRUE(in->TakeLatest(&got));
  EXPECT_EQ(got.stamp.epoch, 20u) << "the newest sample of the owner, not the newest received";
  EXPECT_EQ(in->stats().rejected, 3u);
}

TEST(InputAccount, OfOneOwnerOnlyTheLatestEpochCounts) {
  InputAccount account(true, true);
  EXPECT_TRUE(account.IsOfOwner({1, 10, 0}));
  EXPECT_TRUE(account.IsOfOwner({2, 10, 0}));
  EXPECT_TRUE(account.IsOfOwner({1, 11, 0}));
  EXPECT_FALSE(account.IsOfOwner({3, 10, 0}));
  EXPECT_TRUE(account.IsOfOwner({2, 11, 0})) << "the refused sample has no effect";
}

TEST(InputAccount, OfSeveralOwnersEachEpochCounts) {
  InputAccount account(true, false);
  EXPECT_TRUE(account.IsOfOwner({1, 20, 0}, 30));
  EXPECT_TRUE(account.IsOfOwner({1, 10, 0}, 30));
  EXPECT_TRUE(account.IsOfOwner({1, 40, 0}, 30)) << "no epoch is excluded";
}

TEST(InputAccount, AnEpochOfTheFutureIsNobodysAndShutsNobodyOut) {
  constexpr std::int64_t kNow = 1000;
  InputAccount account(true, true);
  EXPECT_TRUE(account.IsOfOwner({1, 10, 0}, kNow));
  EXPECT_FALSE(account.IsOfOwner({1, kNow + 1, 0}, kNow));
  EXPECT_FALSE(account.IsOfOwner({1, std::numeric_limits<std::uint64_t>::max(), 0}, kNow));
  EXPECT_TRUE(account.IsOfOwner({2, 10, 0}, kNow));
  EXPECT_TRUE(account.IsOfOwner({1, kNow, 0}, kNow)) << "started at this moment";
  EXPECT_FALSE(account.IsOfOwner({1, std::numeric_limits<std::uint64_t>::max(), 0})) << "no clock reaches this value";
}

TEST(InProcess, GateDropsAndCounts) {
  InProcessTopic<ToolState> topic;
  auto out = topic.MakeOutput();
  auto in = topic.MakeInput();
  out->Write(MakeTool(1));
  ToolState bad = MakeTool(2);
  bad.tools[1].v_WT.y() = std::numeric_limits<float>::quiet_NaN();
  out->Write(bad);
  ToolState got;
  ASSERT_TRUE(in->TakeLatest(&got));
  EXPECT_EQ(got.stamp.sequence, 1u);  // the newest sample that passes
  EXPECT_EQ(in->stats().rejected, 1u);
  out->Write(MakeTool(3));
  ASSERT_TRUE(in->TakeLatest(&got));
  EXPECT_EQ(in->stats().lost, 0u);  // refused is not lost
}

TEST(InProcess, LateJoinerGetsStateOfLiveWritersOnly) {
  InProcessTopic<TopologyState> topology;
  auto out = topology.MakeOutput();
  TopologyState m;
  m.revision = 7;
  out->Write(m);
  TopologyState got;
  EXPECT_TRUE(topology.MakeInput()->TakeLatest(&got));
  EXPECT_EQ(got.revision, 7u);
  out.reset();
  EXPECT_FALSE(topology.MakeInput()->TakeLatest(&got));

  InProcessTopic<ToolState> tool;
  auto tool_out = tool.MakeOutput();
  tool_out->Write(MakeTool(1));
  ToolState t;
  EXPECT_FALSE(tool.MakeInput()->TakeLatest(&t));  // a late reader gets no old samples of a stream
}

TEST(InProcess, MatchedAndHasReadersFollowTheOtherSide) {
  InProcessTopic<HandleState> topic;
  auto in = topic.MakeInput();
  EXPECT_FALSE(in->stats().matched);
  auto out = topic.MakeOutput();
  EXPECT_TRUE(in->stats().matched);
  EXPECT_TRUE(out->has_readers());
  in.reset();
  EXPECT_FALSE(out->has_readers());
}

TEST(InProcess, LoanFillsHeaderAndRoundsPositions) {
  InProcessTopic<TissueFrame> topic;
  auto out = topic.MakeOutput();
  auto in = topic.MakeInput();
  ASSERT_TRUE(out->WriteInPlace([](TissueFrame::View view) {
    view.header.vertex_count = 2;
    view.xyz = {0, 0.5f, 1.000002f, 1.5f, 2, 2.499998f};
  }));
  TissueFrame got;
  ASSERT_TRUE(in->TakeLatest(&got));
  EXPECT_EQ(got.xyz, (std::vector<float>{0, 0.5f, 1, 1.5f, 2, 2.5f}));
}

TEST(InProcess, LoanThatThrowsOrOverflowsIsAFailedWrite) {
  InProcessTopic<TissueFrame> topic;
  auto out = topic.MakeOutput();
  auto in = topic.MakeInput();
  EXPECT_FALSE(out->WriteInPlace([](TissueFrame::View view) { view.header.vertex_count = kMaxTissueVertices + 1; }));
  EXPECT_FALSE(out->WriteInPlace([](TissueFrame::View) { throw 1; }));
  EXPECT_EQ(out->stats().failed, 2u);
  TissueFrame got;
  EXPECT_FALSE(in->TakeLatest(&got));
}

TEST(InProcess, PortsOutliveTheTopic) {
  auto topic = std::make_unique<InProcessTopic<ToolState>>();
  auto out = topic->MakeOutput();
  auto in = topic->MakeInput();
  topic.reset();
  EXPECT_TRUE(out->Write(MakeTool(1)));
  ToolState got;
  EXPECT_TRUE(in->TakeLatest(&got));
}

}  // namespace
}  // namespace fulcrum::bus
