// Which of two processes leads.
#include "physics_node/node/pair.h"

#include <gtest/gtest.h>

#include "services/transport/bus/in_process.h"

namespace fulcrum::physics {
namespace {

constexpr std::int64_t kPeriod = 10'000'000;
constexpr std::int64_t kStart = 1'000'000'000'000;

class PairTest : public ::testing::Test {
 protected:
  void LeaderSpeaks(std::uint64_t epoch, NodeId node = NodeId::kPhysics) {
    TickManifest manifest;
    manifest.stamp = {++sequence_, epoch, now_};
    manifest.node = node;
    out_->Write(manifest);
  }
  /// Role after a further period.
  Pair::Role Next(Pair* pair, std::int64_t later = kPeriod) {
    now_ += later;
    return pair->Update(now_, other_holds_);
  }

  bus::InProcessTopic<TickManifest> topic_;
  std::unique_ptr<bus::Output<TickManifest>> out_ = topic_.MakeOutput();
  std::unique_ptr<bus::Input<TickManifest>> in_ = topic_.MakeInput(64);
  std::int64_t now_ = kStart;
  std::uint64_t sequence_ = 0;
  bool other_holds_ = false;
};

TEST_F(PairTest, FollowsWhileTheLeaderSpeaks) {
  Pair pair(*in_, NodeId::kPhysics, false, 5);
  for (int i = 0; i < 100; ++i) {
    LeaderSpeaks(1);
    ASSERT_EQ(Next(&pair), Pair::Role::kFollows);
  }
}

TEST_F(PairTest, TakesOverFromASilentLeaderWithinFourPeriods) {
  Pair pair(*in_, NodeId::kPhysics, false, 5);
  LeaderSpeaks(1);
  ASSERT_EQ(Next(&pair), Pair::Role::kFollows);
  int periods = 0;
  while (Next(&pair) == Pair::Role::kFollows) {
    // Samples of another node do not count as the leader's.
    LeaderSpeaks(9, NodeId::kThermal);
    ++periods;
  }
  EXPECT_EQ(periods, 3);
  EXPECT_EQ(pair.own_epoch(), static_cast<std::uint64_t>(now_)) << "later than the leader's";
  LeaderSpeaks(pair.own_epoch());
  EXPECT_EQ(Next(&pair), Pair::Role::kLeads) << "its own sample does not count as another leader's";
}

TEST_F(PairTest, TakesOverAtOnceFromALeaderThatHasLostItsCheckpoint) {
  Pair pair(*in_, NodeId::kPhysics, false, 5);
  other_holds_ = true;
  ASSERT_EQ(Next(&pair), Pair::Role::kFollows) << "the leader has not been received yet";
  LeaderSpeaks(1);
  ASSERT_EQ(Next(&pair), Pair::Role::kFollows);
  other_holds_ = false;
  LeaderSpeaks(1);
  EXPECT_EQ(Next(&pair), Pair::Role::kTakesOver) << "its last sample has arrived";
}

TEST_F(PairTest, ALeaderWithoutACheckpointIsJudgedByItsSilenceOnly) {
  Pair pair(*in_, NodeId::kPhysics, false, 5);
  for (int i = 0; i < 5; ++i) {
    LeaderSpeaks(1);
    ASSERT_EQ(Next(&pair), Pair::Role::kFollows);
    ASSERT_EQ(Next(&pair), Pair::Role::kFollows);
  }
}

TEST_F(PairTest, WaitsLongerForTheFirstWord) {
  Pair pair(*in_, NodeId::kPhysics, false, 5);
  for (int i = 0; i < 50; ++i) ASSERT_EQ(Next(&pair), Pair::Role::kFollows);
  Pair::Role role = Pair::Role::kFollows;
  for (int i = 0; i < 3 && role == Pair::Role::kFollows; ++i) role = Next(&pair);
  EXPECT_EQ(role, Pair::Role::kTakesOver) << "both may have died";
}

TEST_F(PairTest, ItsOwnAbsenceIsNotTheLeaders) {
  Pair pair(*in_, NodeId::kPhysics, false, 5);
  LeaderSpeaks(1);
  ASSERT_EQ(Next(&pair), Pair::Role::kFollows);
  EXPECT_EQ(Next(&pair, 100 * kPeriod), Pair::Role::kFollows);
  LeaderSpeaks(1);
  EXPECT_EQ(Next(&pair), Pair::Role::kFollows);
}

TEST_F(PairTest, AReplacedLeaderRetiresAndFollows) {
  Pair pair(*in_, NodeId::kPhysics, true, 5);
  LeaderSpeaks(5);
  ASSERT_EQ(Next(&pair), Pair::Role::kLeads);
  LeaderSpeaks(3);
  ASSERT_EQ(Next(&pair), Pair::Role::kLeads) << "a process that was replaced earlier has no effect";
  LeaderSpeaks(static_cast<std::uint64_t>(now_));
  EXPECT_EQ(Next(&pair, 100 * kPeriod), Pair::Role::kRetires);
  // The process was away for as long as a follower waits.
  EXPECT_EQ(Next(&pair, 15 * kPeriod), Pair::Role::kFollows);
  const auto other = static_cast<std::uint64_t>(now_);
  for (int i = 0; i < 10; ++i) {
    LeaderSpeaks(other);
    ASSERT_EQ(Next(&pair), Pair::Role::kFollows);
  }
  int periods = 0;
  while (Next(&pair) == Pair::Role::kFollows) ++periods;
  EXPECT_EQ(periods, 3);
  EXPECT_GT(pair.own_epoch(), other);
  EXPECT_EQ(Next(&pair), Pair::Role::kLeads);
}

}  // namespace
}  // namespace fulcrum::physics
