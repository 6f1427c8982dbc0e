// How the node follows time: pace, and frames at rest.
#include "tests/unit/physics/node_bench.h"

namespace fulcrum::physics {
namespace {

TEST_F(PhysicsNodeTest, SaysHowMuchSlowerThanRealTimeTheTissueIs) {
  Bench bench(scene_, nullptr);
  bench.Step();
  bench.Step();
  const auto error = [&] {
    Health health;
    bench.node_.FillHealth(&health);
    return health.last_error;
  };
  for (int i = 0; i < 300; ++i) {
    bench.tick_.index += 3;  // Each step takes four periods and simulates three.
    bench.Step();
  }
  EXPECT_NE(error().find("75 % of real time"), std::string::npos) << error();
  EXPECT_NEAR(bench.Figure("time_lost_s"), 3.0, 1e-6);
  for (int i = 0; i < 600; ++i) bench.Step();
  EXPECT_EQ(error().find("of real time"), std::string::npos) << error();
  EXPECT_NEAR(bench.Figure("time_lost_s"), 3.0, 1e-6);
}

TEST_F(PhysicsNodeTest, TheFirstStepMayTakeLong) {
  Bench bench(scene_, nullptr);
  bench.Step();
  bench.tick_.index += 30;  // Its caches were initialised meanwhile.
  bench.Step();
  EXPECT_EQ(bench.Figure("time_lost_s"), -1);
}

TEST_F(PhysicsNodeTest, AtRestAFrameEachTwoSecondsIsEnough) {
  Bench bench(scene_, nullptr);
  auto frames = bench.bus_.frames.MakeInput();
  for (int i = 0; i < 700; ++i) bench.Step();
  ASSERT_TRUE(bench.node_.simulation().asleep());
  TissueFrame frame;
  const auto count = [&] { return bench.frame_out_->stats().written; };
  const auto before = count();
  double announced_s = 0;
  for (int i = 0; i < 1000; ++i) {
    bench.Step();
    if (frames->TakeLatest(&frame)) announced_s = frame.header.next_within_s;
  }
  EXPECT_EQ(count() - before, 5u);
  EXPECT_NEAR(announced_s, 2.0, 1e-6);
  // On a busy machine, too: half of the periods missed.
  const auto busy = count();
  for (int i = 0; i < 500; ++i) {
    ++bench.tick_.index;
    bench.Step();
  }
  EXPECT_EQ(count() - busy, 5u);
}

TEST(Pace, SeesWhatIsLostAndNotJitter) {
  Pace pace;
  for (int i = 0; i < 500; ++i) pace.Add(0.01, i % 2 == 0 ? 0.013 : 0.007);
  EXPECT_NEAR(pace.value(), 1, 0.01);
  for (int i = 0; i < 300; ++i) pace.Add(0.03, 0.04);
  EXPECT_NEAR(pace.value(), 0.75, 0.01);
  pace.Add(1, 0);
  pace.Add(-1, 1);
  EXPECT_NEAR(pace.value(), 0.75, 0.01);
}

}  // namespace
}  // namespace fulcrum::physics
