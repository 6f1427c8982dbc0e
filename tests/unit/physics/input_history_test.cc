#include "physics_node/node/input_history.h"

#include <gtest/gtest.h>

#include "services/transport/bus/in_process.h"

namespace fulcrum::physics {
namespace {

class InputHistoryTest : public testing::Test {
 protected:
  void Send(std::int64_t stamp_ns, std::uint64_t epoch = 1) {
    HandleState state;
    state.stamp = {++sequence_, epoch, stamp_ns};
    ASSERT_TRUE(out_->Write(state));
  }
  [[nodiscard]] std::int64_t Before() const { return history_.before().stamp.stamp_ns; }
  [[nodiscard]] std::int64_t After() const {
    return history_.after() != nullptr ? history_.after()->stamp.stamp_ns : -1;
  }

  bus::InProcessTopic<HandleState> topic_;
  std::unique_ptr<bus::Input<HandleState>> in_ = topic_.MakeInput();
  std::unique_ptr<bus::Output<HandleState>> out_ = topic_.MakeOutput();
  InputHistory<HandleState> history_;
  std::uint64_t sequence_ = 0;
};

TEST_F(InputHistoryTest, GivesTheSamplesAroundAMoment) {
  EXPECT_TRUE(history_.empty());
  for (std::int64_t ns = 100; ns <= 1000; ns += 100) Send(ns);
  history_.Take(in_.get());
  history_.DropBefore(450);
  EXPECT_EQ(Before(), 400);
  EXPECT_EQ(After(), 500);
  history_.DropBefore(500);
  EXPECT_EQ(Before(), 500) << "a sample of exactly that time is not later";
  EXPECT_EQ(After(), 600);
}

TEST_F(InputHistoryTest, WhatArrivesLateIsHeldUntilAnythingNewerHas) {
  Send(100);
  history_.Take(in_.get());
  history_.DropBefore(250);
  EXPECT_EQ(Before(), 100);
  EXPECT_EQ(After(), -1);
  // The sample of 200 was in transit when the step began.
  Send(200);
  Send(300);
  history_.Take(in_.get());
  history_.DropBefore(350);
  EXPECT_EQ(Before(), 300);
}

TEST_F(InputHistoryTest, OfAMomentBeforeTheFirstSampleTheFirstIsGiven) {
  Send(500);
  Send(600);
  history_.Take(in_.get());
  history_.DropBefore(450);
  EXPECT_EQ(Before(), 500);
  EXPECT_EQ(After(), 600);
}

TEST_F(InputHistoryTest, AWriterThatIsStartedAnewGoesOnWithTheClock) {
  Send(100);
  Send(200);
  history_.Take(in_.get());
  sequence_ = 0;
  out_ = topic_.MakeOutput();
  Send(300, 2);
  history_.Take(in_.get());
  history_.DropBefore(310);
  EXPECT_EQ(Before(), 300);
  EXPECT_EQ(history_.before().stamp.epoch, 2u);
}

TEST_F(InputHistoryTest, TimeNeverRunsBackwards) {
  for (const std::int64_t ns : {100, 300, 200, 300, 400}) Send(ns);
  history_.Take(in_.get());
  history_.DropBefore(250);
  EXPECT_EQ(Before(), 100);
  EXPECT_EQ(After(), 300);
  history_.DropBefore(350);
  EXPECT_EQ(After(), 400);
}

TEST_F(InputHistoryTest, KeepsTheNewestOfALongPause) {
  const auto count = static_cast<std::int64_t>(4 * kInputHistory);
  for (std::int64_t ns = 1; ns <= count; ++ns) Send(ns);
  history_.Take(in_.get());
  EXPECT_EQ(Before(), count - static_cast<std::int64_t>(kInputHistory) + 1);
  history_.DropBefore(count - 2);
  EXPECT_EQ(Before(), count - 2);
}

}  // namespace
}  // namespace fulcrum::physics
