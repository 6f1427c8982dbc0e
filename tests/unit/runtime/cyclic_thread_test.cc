#include "services/base/runtime/cyclic_thread.h"

#include <gtest/gtest.h>
#include <pthread.h>
#include <signal.h>

#include <array>
#include <string>
#include <vector>

#include "services/base/runtime/realtime.h"

namespace fulcrum::runtime {
namespace {

constexpr std::int64_t kPeriod = 1'000'000;

TEST(PlanNextPeriod, PunctualCycleGoesToTheNextPeriod) {
  const NextPeriod plan = PlanNextPeriod(5 * kPeriod, kPeriod, 5 * kPeriod + 200'000);
  EXPECT_EQ(plan.wake_ns, 6 * kPeriod);
  EXPECT_EQ(plan.skipped, 0u);
}

TEST(PlanNextPeriod, EndingExactlyAtTheNextPeriodIsNotLate) {
  const NextPeriod plan = PlanNextPeriod(5 * kPeriod, kPeriod, 6 * kPeriod);
  EXPECT_EQ(plan.wake_ns, 6 * kPeriod);
  EXPECT_EQ(plan.skipped, 0u);
}

TEST(PlanNextPeriod, OneNanosecondLateSkipsOnePeriod) {
  const NextPeriod plan = PlanNextPeriod(5 * kPeriod, kPeriod, 6 * kPeriod + 1);
  EXPECT_EQ(plan.wake_ns, 7 * kPeriod);
  EXPECT_EQ(plan.skipped, 1u);
}

// For any lateness: the plan is on the grid, not before now, after a delay less than a period ahead, and the skipped
// periods account for the whole distance.
TEST(PlanNextPeriod, KeepsThePhaseForAnyLateness) {
  const std::int64_t previous = 123'456'789;
  for (std::int64_t late = 0; late < 20 * kPeriod; late += 97'003) {
    const std::int64_t now = previous + late;
    const NextPeriod plan = PlanNextPeriod(previous, kPeriod, now);
    EXPECT_EQ((plan.wake_ns - previous) % kPeriod, 0);
    EXPECT_GE(plan.wake_ns, now);
    EXPECT_LE(plan.wake_ns - now, kPeriod);
    EXPECT_EQ(plan.wake_ns, previous + kPeriod * static_cast<std::int64_t>(1 + plan.skipped));
  }
}

TEST(CyclicThread, IndexCountsSkippedPeriodsAndStampsGrow) {
  std::vector<Tick> seen;
  seen.reserve(1000);
  CyclicThread thread({.name = "test", .period_ns = kPeriod}, [&](const Tick& tick) {
    if (seen.size() < 20) seen.push_back(tick);
    // The fifth cycle takes more than three periods.
    if (seen.size() == 5) {
      const std::int64_t end = MonotonicNs() + 3 * kPeriod + kPeriod / 2;
      while (MonotonicNs() < end) {
      }
    }
  });
  thread.Start();
  while (thread.stats().ticks < 20) {
  }
  thread.Stop();
  const CyclicStats stats = thread.stats();
  ASSERT_EQ(seen.size(), 20u);
  EXPECT_EQ(seen[0].index, 0u);
  EXPECT_DOUBLE_EQ(seen[0].dt_s, 1e-3);
  for (std::size_t i = 1; i < seen.size(); ++i) {
    EXPECT_GT(seen[i].index, seen[i - 1].index);
    EXPECT_GT(seen[i].stamp_ns, seen[i - 1].stamp_ns);
  }
  EXPECT_GE(seen[5].index, seen[4].index + 4);  // The stall lasts at least as long as the busy loop.
  EXPECT_GE(stats.overruns, 3u);
  EXPECT_EQ(stats.step.count, stats.ticks);
  EXPECT_EQ(stats.wake.count, stats.ticks);
  EXPECT_GE(stats.step.max_ns, 3 * kPeriod);
}

TEST(CyclicThread, StopsAndStartsAgain) {
  std::atomic<int> calls{0};
  CyclicThread thread({.name = "test", .period_ns = kPeriod}, [&](const Tick&) { ++calls; });
  thread.Stop();  // Not started: nothing to do.
  thread.Start();
  while (calls < 3) {
  }
  thread.Stop();
  const int after_stop = calls;
  thread.Start();
  while (calls < after_stop + 3) {
  }
}

TEST(CyclicThread, CarriesItsName) {
  std::atomic<bool> done{false};
  std::array<char, 16> name{};
  CyclicThread thread({.name = "a_name_longer_than_linux_permits", .period_ns = kPeriod}, [&](const Tick&) {
    if (!done) pthread_getname_np(pthread_self(), name.data(), name.size());
    done = true;
  });
  thread.Start();
  while (!done) {
  }
  thread.Stop();
  EXPECT_EQ(std::string(name.data()), "a_name_longer_t");
}

// Permission depends on the machine; the advice in a refusal must not.
TEST(RealTime, ARefusalSaysHowToPermitIt) {
  std::string fifo;
  CyclicThread thread({.name = "test", .period_ns = kPeriod}, [&](const Tick& tick) {
    if (tick.index == 0) fifo = SetFifoPriority(10);
  });
  thread.Start();
  while (thread.stats().ticks == 0) {
  }
  thread.Stop();
  if (!fifo.empty()) {
    EXPECT_NE(fifo.find("rtprio"), std::string::npos);
    EXPECT_EQ(fifo.find('\n'), std::string::npos);
  }
}

TEST(RealTime, DenormalsAreFlushed) {
  std::atomic<bool> done{false};
  double product = 1.0;
  CyclicThread thread({.name = "test", .period_ns = kPeriod}, [&](const Tick&) {
    FlushDenormals();
    volatile double tiny = 1e-200;
    product = tiny * 1e-110;
    done = true;
  });
  thread.Start();
  while (!done) {
  }
  thread.Stop();
  EXPECT_EQ(product, 0.0);
}

TEST(Signals, SigtermSetsTheStopFlag) {
  InstallStopSignals();
  EXPECT_FALSE(ShouldStop());
  raise(SIGPIPE);  // Ignored.
  EXPECT_FALSE(ShouldStop());
  raise(SIGTERM);
  EXPECT_TRUE(ShouldStop());
}

}  // namespace
}  // namespace fulcrum::runtime
