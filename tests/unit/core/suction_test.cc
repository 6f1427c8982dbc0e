// The valve of a suction and irrigation tube.
#include "services/base/core/suction.h"

#include <gtest/gtest.h>

#include <limits>

namespace fulcrum {
namespace {

constexpr float kOpen = 0.7f, kClosed = 0;

/// An open handle, squeezed from `begin_s` to `end_s`.
TrumpetValve SqueezedOnce(double begin_s, double end_s) {
  TrumpetValve valve;
  (void)valve.Step(begin_s - 0.5, kOpen);
  (void)valve.Step(begin_s, kClosed);
  (void)valve.Step(end_s, kOpen);
  return valve;
}

TEST(TrumpetValve, ASqueezeAspiratesWhileItLasts) {
  TrumpetValve valve;
  EXPECT_EQ(valve.Step(0, kOpen), TubeFlow::kNone);
  EXPECT_EQ(valve.Step(1, kClosed), TubeFlow::kAspirates);
  EXPECT_EQ(valve.Step(9, kClosed), TubeFlow::kAspirates);
  EXPECT_EQ(valve.Step(9.1, kOpen), TubeFlow::kNone);
}

TEST(TrumpetValve, ASecondSqueezeSoonAfterIrrigates) {
  TrumpetValve valve = SqueezedOnce(1.0, 1.2);
  EXPECT_EQ(valve.Step(1.4, kClosed), TubeFlow::kIrrigates);
  EXPECT_EQ(valve.Step(5.0, kClosed), TubeFlow::kIrrigates);
  EXPECT_EQ(valve.Step(5.1, kOpen), TubeFlow::kNone);
  EXPECT_EQ(valve.Step(5.2, kClosed), TubeFlow::kAspirates) << "the last squeeze began 3.8 s ago";
}

TEST(TrumpetValve, ALateSecondSqueezeAspirates) {
  TrumpetValve valve = SqueezedOnce(1.0, 1.2);
  EXPECT_EQ(valve.Step(1.0 + TrumpetValve::kTwice_s, kClosed), TubeFlow::kAspirates);
}

TEST(TrumpetValve, BetweenTheTwoAnglesNothingChanges) {
  constexpr float kBetween = 0.5f * (TrumpetValve::kSqueezed_rad + TrumpetValve::kLetGo_rad);
  TrumpetValve valve;
  EXPECT_EQ(valve.Step(0, kBetween), TubeFlow::kNone);
  (void)valve.Step(0.5, kOpen);
  EXPECT_EQ(valve.Step(0.7, kBetween), TubeFlow::kNone);
  EXPECT_EQ(valve.Step(1, kClosed), TubeFlow::kAspirates);
  EXPECT_EQ(valve.Step(2, kBetween), TubeFlow::kAspirates);
  EXPECT_EQ(valve.Step(3, kOpen), TubeFlow::kNone);
  EXPECT_EQ(valve.Step(4, kBetween), TubeFlow::kNone);
}

TEST(TrumpetValve, AHandleThatIsGoneOrUnreadableShutsNothingOpen) {
  TrumpetValve valve;
  (void)valve.Step(0, kOpen);
  EXPECT_EQ(valve.Step(1, kClosed), TubeFlow::kAspirates);
  valve.Shut();
  EXPECT_EQ(valve.flow(), TubeFlow::kNone);
  EXPECT_EQ(valve.Step(5, std::numeric_limits<float>::quiet_NaN()), TubeFlow::kNone);
}

TEST(TrumpetValve, StartedDuringASqueezeItOpensWithTheNextOne) {
  TrumpetValve valve;
  EXPECT_EQ(valve.Step(1, kClosed), TubeFlow::kNone) << "the squeeze may have been one that irrigates";
  EXPECT_EQ(valve.Step(2, kClosed), TubeFlow::kNone);
  EXPECT_EQ(valve.Step(3, kOpen), TubeFlow::kNone);
  EXPECT_EQ(valve.Step(4, kClosed), TubeFlow::kAspirates);
}

TEST(TrumpetValve, ASqueezeAspiratesWhereTheClockHasGoneBack) {
  TrumpetValve valve = SqueezedOnce(100, 101);
  EXPECT_EQ(valve.Step(7, kClosed), TubeFlow::kAspirates);
  (void)valve.Step(7.2, kOpen);
  EXPECT_EQ(valve.Step(7.4, kClosed), TubeFlow::kIrrigates);
}

}  // namespace
}  // namespace fulcrum
