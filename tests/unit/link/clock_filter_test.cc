#include "services/transport/link/codec/clock_filter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace fulcrum::link {
namespace {

constexpr std::int64_t kMilli = 1'000'000, kSecond = 1'000'000'000;

/// Two clocks and a wire between them.
struct World {
  std::int64_t offset_ns = 5'000 * kSecond;
  double drift = 0;
  std::int64_t there_ns = kMilli / 4, back_ns = kMilli / 4;
  double jitter_ns = 0;
  std::mt19937 random{5};

  [[nodiscard]] std::int64_t Theirs(std::int64_t ours_ns) const {
    return ours_ns + offset_ns + std::llround(drift * static_cast<double>(ours_ns));
  }
  ClockFilter::Trip Trip(std::int64_t t1_ns) {
    std::exponential_distribution<double> held_up(1.0);
    const auto extra = [&] { return std::llround(jitter_ns * held_up(random)); };
    const std::int64_t heard = t1_ns + there_ns + extra(), answered = heard + 20 * kMilli;
    return {t1_ns, Theirs(heard), Theirs(answered), answered + back_ns + extra()};
  }
};

/// Pulses each 50 ms from `from_s` to `to_s`; the largest error after `settled_s` [ns].
double Follow(World* world, ClockFilter* filter, double from_s, double to_s, double settled_s) {
  double worst = 0;
  for (auto t = std::llround(1e9 * from_s); t < std::llround(1e9 * to_s); t += 50 * kMilli) {
    filter->Add(world->Trip(t));
    const std::int64_t now = t + 30 * kMilli;
    const auto error = static_cast<double>(filter->OffsetAt(now) - (world->Theirs(now) - now));
    if (1e-9 * static_cast<double>(t) > settled_s) worst = std::max(worst, std::abs(error));
  }
  return worst;
}

TEST(ClockFilter, ExactWhenTheWaysAreAlike) {
  World world;
  ClockFilter filter;
  EXPECT_FALSE(filter.known());
  EXPECT_EQ(Follow(&world, &filter, 0.1, 3, 0), 0);
  EXPECT_TRUE(filter.known());
  EXPECT_EQ(filter.delay_ns(), kMilli / 2);
}

TEST(ClockFilter, OffByHalfTheDifferenceOfTheWays) {
  World world;
  world.there_ns = 5 * kMilli;
  world.back_ns = 1 * kMilli;
  ClockFilter filter;
  EXPECT_NEAR(Follow(&world, &filter, 0.1, 3, 0), 2e6, 1);
}

TEST(ClockFilter, QuickTripsCountAndHeldUpOnesDoNot) {
  World world;
  world.jitter_ns = 1e6;
  ClockFilter filter;
  EXPECT_LT(Follow(&world, &filter, 0.1, 40, 5), 150e3);
}

TEST(ClockFilter, FollowsDrift) {
  World world;
  world.drift = 60e-6;  // 1.8 ms within the memory of the filter.
  world.jitter_ns = 20e3;
  ClockFilter filter;
  EXPECT_LT(Follow(&world, &filter, 0.1, 60, 15), 40e3);
  EXPECT_NEAR(filter.drift_ppm(), 60, 3);
}

TEST(ClockFilter, CorrectsSmoothlyAndJumpsOnlyFromFarOff) {
  World world;
  ClockFilter filter;
  (void)Follow(&world, &filter, 0.1, 2, 0);
  const std::int64_t before = filter.OffsetAt(2 * kSecond);
  world.offset_ns += kMilli;
  std::int64_t last = before;
  for (std::int64_t t = 2 * kSecond; t < 40 * kSecond; t += 50 * kMilli) {
    filter.Add(world.Trip(t));
    const std::int64_t now = filter.OffsetAt(t + 30 * kMilli);
    EXPECT_LE(std::abs(now - last), std::llround(ClockFilter::kLargestSlew * 85e6) + 1);
    last = now;
  }
  EXPECT_NEAR(static_cast<double>(last - before), 1e6, 1e3);
  world.offset_ns += 3600 * kSecond;
  EXPECT_EQ(Follow(&world, &filter, 41, 80, 72), 0);
}

// CLOCK_MONOTONIC of a suspended machine stands still.
TEST(ClockFilter, FollowsAtOnceWhenAMachineWasSuspended) {
  for (const std::int64_t jump_ns : {60 * kSecond, -60 * kSecond, kSecond / 10}) {
    World world;
    world.drift = 60e-6;
    world.jitter_ns = 20e3;
    ClockFilter filter;
    EXPECT_LT(Follow(&world, &filter, 0.1, 40, 15), 40e3);
    world.offset_ns += jump_ns;
    // A trip during which a machine slept is slow and says little.
    filter.Add({40 * kSecond, world.Theirs(40 * kSecond), world.Theirs(40 * kSecond) + kMilli, 45 * kSecond});
    EXPECT_LT(Follow(&world, &filter, 45.1, 80, 45.3), 1e6) << jump_ns;
  }
}

TEST(ClockFilter, TripsThatCannotBeAreDisregarded) {
  ClockFilter filter;
  constexpr std::int64_t kMost = std::numeric_limits<std::int64_t>::max(),
                         kLeast = std::numeric_limits<std::int64_t>::min();
  for (const ClockFilter::Trip& trip :
       {ClockFilter::Trip{10, 5, 4, 20}, ClockFilter::Trip{20, 5, 6, 10}, ClockFilter::Trip{10, 5, 105, 20},
        ClockFilter::Trip{kLeast, kMost, kLeast, kMost}, ClockFilter::Trip{0, 1, 2, 20 * kSecond}}) {
    filter.Add(trip);
    EXPECT_FALSE(filter.known());
  }
  filter.Add({10, kMost, kMost, 20});
  (void)filter.OffsetAt(30);
}

}  // namespace
}  // namespace fulcrum::link
