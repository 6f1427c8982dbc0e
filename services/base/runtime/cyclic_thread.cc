#include "services/base/runtime/cyclic_thread.h"

#include <pthread.h>
#include <sched.h>
#include <sys/prctl.h>
#include <time.h>

#include <algorithm>
#include <cerrno>
#include <thread>

#include "services/base/runtime/realtime.h"

namespace fulcrum::runtime {
namespace {

// The kernel may delay a timer of a normal thread by 50 us to batch wake-ups; a cyclic thread requests no such delay.
constexpr unsigned long kTimerSlackNs = 1;
// A long period is slept in slices, so that Stop() need not wait for its end.
constexpr std::int64_t kMaxSleepNs = 50'000'000;

void SleepUntil(std::int64_t wake_ns) {
  const timespec until{static_cast<time_t>(wake_ns / 1'000'000'000), static_cast<long>(wake_ns % 1'000'000'000)};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr) == EINTR) {
  }
}

}  // namespace

std::int64_t MonotonicNs() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

NextPeriod PlanNextPeriod(std::int64_t previous_wake_ns, std::int64_t period_ns, std::int64_t now_ns) {
  const std::int64_t next = previous_wake_ns + period_ns;
  if (now_ns <= next) return {next, 0};
  const std::int64_t skipped = (now_ns - next + period_ns - 1) / period_ns;
  return {next + skipped * period_ns, static_cast<std::uint64_t>(skipped)};
}

void SpinMargin::Add(std::int64_t late_ns) {
  // Steps in the ratio of 99 to 1 balance where one wake-up of a hundred is later than the margin. From 50 us down to
  // 20 us takes 3,000 periods.
  constexpr std::int64_t kDown_ns = 10, kUp_ns = 99 * kDown_ns;
  margin_ns_ = std::clamp(margin_ns_ + (late_ns > margin_ns_ ? kUp_ns : -kDown_ns), std::int64_t{0}, longest_ns_);
}

struct CyclicThread::Impl {
  CyclicThreadSettings settings;
  std::int64_t grid_ns = 0;  ///< Argument of Start().
  Callback callback;
  std::thread thread;
  std::atomic<bool> stop{false};
  // Written by the cyclic thread only; relaxed, since readers need recent figures and no order between them.
  std::atomic<std::uint64_t> ticks{0};
  std::atomic<std::uint64_t> overruns{0};
  Histogram wake;
  Histogram step;

  void SetUpThread() const {
    pthread_setname_np(pthread_self(), settings.name.substr(0, 15).c_str());
    prctl(PR_SET_TIMERSLACK, kTimerSlackNs, 0, 0, 0);
    if (settings.cpu >= 0) {
      cpu_set_t cpus;
      CPU_ZERO(&cpus);
      CPU_SET(settings.cpu, &cpus);
      if (pthread_setaffinity_np(pthread_self(), sizeof(cpus), &cpus) != 0) {
        Log(LogLevel::kWarning, settings.name + ": there is no CPU " + std::to_string(settings.cpu) +
                                    " to pin to: running on any; see cpu in the cart file");
      }
    }
    if (settings.fifo_priority > 0) {
      const std::string warning = SetFifoPriority(settings.fifo_priority);
      // Once per process: the message of every further thread would be the same.
      static std::atomic<bool> done{false};
      if (!done.exchange(true)) {
        for (const std::string& problem : {warning, LockMemory()}) {
          if (!problem.empty()) Log(LogLevel::kWarning, settings.name + ": " + problem);
        }
      }
    } else {
      // A thread inherits its creator's policy: without this a helper of a FIFO thread would be FIFO too.
      const sched_param normal{};
      pthread_setschedparam(pthread_self(), SCHED_OTHER, &normal);
    }
  }

  /// False if the thread must stop. `*begin_ns`: the last reading of the clock before the return.
  bool WaitFor(std::int64_t wake_ns, SpinMargin* spin, std::int64_t* begin_ns) const {
    const bool rests = settings.rests != nullptr && settings.rests->load(std::memory_order_relaxed);
    const std::int64_t sleep_end = wake_ns - (rests ? 0 : spin->value_ns());
    bool slept = false;
    for (*begin_ns = MonotonicNs(); *begin_ns < sleep_end; *begin_ns = MonotonicNs()) {
      if (stop.load(std::memory_order_relaxed)) return false;
      SleepUntil(std::min(sleep_end, *begin_ns + kMaxSleepNs));
      slept = true;
    }
    if (slept) spin->Add(*begin_ns - sleep_end);
    do {
      *begin_ns = MonotonicNs();
    } while (*begin_ns < wake_ns);
    return !stop.load(std::memory_order_relaxed);
  }

  /// Waits as long as the callback's owner rests, and moves `*wake_ns` to the next period. Returns the periods omitted.
  std::uint64_t Rest(std::int64_t* wake_ns) const {
    if (!settings.rests_until) return 0;
    const std::int64_t periods = (settings.rests_until() - *wake_ns) / settings.period_ns;
    if (periods <= 0) return 0;
    const std::int64_t end_ns = *wake_ns + periods * settings.period_ns;
    for (std::int64_t now_ns = MonotonicNs(); now_ns < end_ns; now_ns = MonotonicNs()) {
      const bool rung = settings.bell->WaitUntil(std::min(end_ns, now_ns + kMaxSleepNs));
      if (!rung && !stop.load(std::memory_order_relaxed)) continue;
      const NextPeriod next = PlanNextPeriod(*wake_ns - settings.period_ns, settings.period_ns, MonotonicNs());
      *wake_ns = next.wake_ns;
      return next.skipped;
    }
    *wake_ns = end_ns;
    return static_cast<std::uint64_t>(periods);
  }

  void Loop() {
    SetUpThread();
    Tick tick;
    tick.dt_s = 1e-9 * static_cast<double>(settings.period_ns);
    const std::int64_t start_ns = MonotonicNs();
    std::int64_t wake_ns =
        grid_ns == 0 ? start_ns + settings.period_ns : PlanNextPeriod(grid_ns, settings.period_ns, start_ns).wake_ns;
    SpinMargin spin(settings.spin_ns);
    std::int64_t begin = 0;
    while (WaitFor(wake_ns, &spin, &begin)) {
      wake.Add(begin - wake_ns);
      tick.stamp_ns = begin;
      callback(tick);
      const std::int64_t end = MonotonicNs();
      step.Add(end - begin);
      const NextPeriod next = PlanNextPeriod(wake_ns, settings.period_ns, end);
      overruns.store(overruns.load(std::memory_order_relaxed) + next.skipped, std::memory_order_relaxed);
      wake_ns = next.wake_ns;
      const std::uint64_t omitted = Rest(&wake_ns);
      ticks.store(ticks.load(std::memory_order_relaxed) + 1 + omitted, std::memory_order_relaxed);
      tick.index += 1 + next.skipped + omitted;
    }
  }
};

CyclicThread::CyclicThread(const CyclicThreadSettings& settings, Callback callback) : impl_(std::make_unique<Impl>()) {
  impl_->settings = settings;
  impl_->callback = std::move(callback);
}

CyclicThread::~CyclicThread() { Stop(); }

void CyclicThread::Start(std::int64_t grid_ns) {
  if (impl_->thread.joinable()) return;
  impl_->grid_ns = grid_ns;
  impl_->stop.store(false, std::memory_order_relaxed);
  impl_->thread = std::thread([impl = impl_.get()] { impl->Loop(); });
}

void CyclicThread::Stop() {
  if (!impl_->thread.joinable()) return;
  impl_->stop.store(true, std::memory_order_relaxed);  // join() below is the synchronisation.
  impl_->thread.join();
}

CyclicStats CyclicThread::stats() const {
  CyclicStats result;
  result.ticks = impl_->ticks.load(std::memory_order_relaxed);
  result.overruns = impl_->overruns.load(std::memory_order_relaxed);
  result.wake = impl_->wake.snapshot();
  result.step = impl_->step.snapshot();
  return result;
}

}  // namespace fulcrum::runtime
