#include "services/base/runtime/cyclic_thread.h"

#include <gtest/gtest.h>
#include <pthread.h>
#include <signal.h>
#include <time.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <random>
#include <string>
#include <thread>
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

TEST(SpinMargin, IsLateInOneOfAHundredPeriodsAndNeverLongerThanSet) {
  std::mt19937_64 random(1);
  std::exponential_distribution<double> more(1 / 4e3);
  const auto late_ns = [&] { return 10'000 + static_cast<std::int64_t>(more(random)); };
  SpinMargin margin(100'000);
  EXPECT_EQ(margin.value_ns(), 100'000) << "before anything is known";
  for (int i = 0; i < 10'000; ++i) margin.Add(late_ns());
  int late = 0;
  double sum_ns = 0;
  constexpr int kPeriods = 100'000;
  for (int i = 0; i < kPeriods; ++i) {
    const std::int64_t ns = late_ns();
    late += ns > margin.value_ns() ? 1 : 0;
    sum_ns += static_cast<double>(margin.value_ns());
    margin.Add(ns);
  }
  EXPECT_NEAR(late, 0.01 * kPeriods, 0.001 * kPeriods);
  EXPECT_NEAR(sum_ns / kPeriods, 10e3 + 4e3 * std::log(100), 2e3);
  for (int i = 0; i < 1000; ++i) margin.Add(1'000'000);
  EXPECT_EQ(margin.value_ns(), 100'000);
  SpinMargin none(0);
  none.Add(5'000);
  EXPECT_EQ(none.value_ns(), 0);
}

TEST(CyclicThread, SpinsBeforeAPeriodUnlessItRests) {
  // Before a period the thread reads the clock without pause: nearly all of a long spin is processor time.
  const auto cpu_of = [](bool resting) {
    std::atomic<bool> rests{resting};
    double begin_s = 0, end_s = 0;
    int ticks = 0;
    CyclicThread thread(
        {.name = "test", .period_ns = kPeriod, .spin_ns = kPeriod / 2, .rests = &rests}, [&](const Tick&) {
          timespec now{};
          ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
          (ticks++ == 0 ? begin_s : end_s) = static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
        });
    thread.Start();
    while (thread.stats().ticks < 200) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    thread.Stop();
    return (end_s - begin_s) / ticks;
  };
  EXPECT_LT(cpu_of(true), 0.5 * cpu_of(false));
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

TEST(CyclicThread, OmitsThePeriodsOfARestAndKeepsItsGrid) {
  Bell bell;
  std::vector<Tick> seen;
  seen.reserve(1000);
  constexpr std::int64_t kRest = 20 * kPeriod;
  std::int64_t stamp_ns = 0;
  const std::int64_t grid_ns = MonotonicNs();
  CyclicThread thread({.name = "test",
                       .period_ns = kPeriod,
                       .rests_until = [&] { return seen.size() >= 3 ? stamp_ns + kRest : stamp_ns; },
                       .bell = &bell},
                      [&](const Tick& tick) {
                        stamp_ns = tick.stamp_ns;
                        if (seen.size() < seen.capacity()) seen.push_back(tick);
                      });
  thread.Start(grid_ns);
  while (thread.stats().ticks < 200) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  thread.Stop();
  ASSERT_GE(seen.size(), 8u);
  EXPECT_LT(seen.size(), 20u) << "of 200 periods";
  EXPECT_LT(seen[2].stamp_ns - seen[1].stamp_ns, kRest);
  for (std::size_t i = 3; i < seen.size(); ++i) {
    EXPECT_GT(seen[i].stamp_ns - seen[i - 1].stamp_ns, kRest - kPeriod);
    // Each omitted period counts in the index: stamps stay on the grid, each within the lateness of its wake-up.
    const auto periods = static_cast<std::int64_t>(seen[i].index - seen[0].index);
    EXPECT_GE(seen[i].stamp_ns - grid_ns, periods * kPeriod);
  }
  EXPECT_GE(thread.stats().ticks, seen.back().index + 1 - thread.stats().overruns) << "omitted periods are ticks";
  EXPECT_EQ(thread.stats().step.count, seen.size());
}

TEST(CyclicThread, ABellEndsARest) {
  Bell bell;
  std::atomic<int> calls{0};
  std::atomic<std::int64_t> begun_ns{0};
  constexpr std::int64_t kLong = 30'000'000'000;
  CyclicThread thread(
      {.name = "test", .period_ns = kPeriod, .rests_until = [&] { return begun_ns + kLong; }, .bell = &bell},
      [&](const Tick& tick) {
        begun_ns = tick.stamp_ns;
        ++calls;
      });
  thread.Start();
  while (calls < 1) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  std::this_thread::sleep_for(std::chrono::milliseconds(120));  // Longer than a slice of its sleep.
  EXPECT_EQ(calls, 1);
  bell.Ring();
  while (calls < 2) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_LT(MonotonicNs() - begun_ns, kLong / 2);
  thread.Stop();  // Within a slice, not at the end of the rest.
  EXPECT_EQ(calls, 2);
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
