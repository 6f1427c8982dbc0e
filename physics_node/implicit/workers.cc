#include "physics_node/implicit/workers.h"

#include <sched.h>

#include <algorithm>
#include <chrono>

namespace fulcrum::physics::implicit {
namespace {

/// A thread without tasks sleeps after this: longer than most stretches between two phases of a step, or between two
/// steps of a replay. A wake-up takes as long as a phase.
constexpr std::chrono::microseconds kSpinTime{200};
/// Pauses of the processor between two reads of the clock: about a microsecond in all, so a read costs little of it.
constexpr int kPausesPerClockRead = 32;
/// Between two tests of a phase whose last task is late: a scheduler that has taken its core away gives it back in
/// milliseconds, so this delays the phase by little.
constexpr std::chrono::microseconds kLateTaskSleep{20};
/// Of a ticket: bits and mask of a task's number.
constexpr int kTaskBits = 16;
constexpr std::uint64_t kTaskMask = 0xffffu, kOneEnd = std::uint64_t{1} << kTaskBits;

/// Leaves the shared parts of a core to its other thread for a moment.
void Pause() {
#if defined(__x86_64__)
  __builtin_ia32_pause();
#elif defined(__aarch64__)
  asm volatile("isb" ::: "memory");
#endif
}

/// Spins until done() or for kSpinTime, and returns whether done().
template <class Done>
bool SpinUntil(const Done& done) {
  const auto start = std::chrono::steady_clock::now();
  do {
    for (int pause = 0; pause < kPausesPerClockRead; ++pause) {
      if (done()) {
        return true;
      }
      Pause();
    }
  } while (std::chrono::steady_clock::now() - start < kSpinTime);
  return false;
}

/// Restricts the calling thread to the cores that it was allowed at first, except one.
class CpuExclusion {
 public:
  CpuExclusion() { supported_ = ::sched_getaffinity(0, sizeof(allowed_), &allowed_) == 0; }
  void Exclude(int cpu) {
    if (cpu == excluded_ || cpu < 0 || !supported_) {
      return;
    }
    excluded_ = cpu;
    cpu_set_t rest = allowed_;
    CPU_CLR(static_cast<std::size_t>(cpu), &rest);
    if (CPU_COUNT(&rest) > 0) {
      (void)::sched_setaffinity(0, sizeof(rest), &rest);
    }
  }

 private:
  cpu_set_t allowed_{};
  bool supported_ = false;
  int excluded_ = -1;
};

}  // namespace

Workers::Workers(int threads) : tickets_(static_cast<std::size_t>(std::max(threads, 1)) + 1) {
  for (int worker = 1; worker < threads; ++worker) {
    threads_.emplace_back([this, worker] { Loop(worker); });
  }
}

Workers::~Workers() {
  stop_ = true;
  ++phase_;
  phase_.notify_all();
  for (std::thread& thread : threads_) {
    thread.join();
  }
}

void Workers::DoTasks(int worker) {
  if (worker != 0) {
    DoTasksOf(count(), worker);
  }
  for (int i = 0; i < count(); ++i) {
    DoTasksOf((worker + i) % count(), worker);
  }
  DoTasksOf(count(), worker);
}

void Workers::DoTasksOf(int part, int worker) {
  const bool own = part == worker || part == count();
  std::atomic<std::uint64_t>& word = tickets_[static_cast<std::size_t>(part)].word;
  std::uint64_t ticket = word.load(std::memory_order_acquire);
  for (;;) {
    const auto next = static_cast<int>(ticket & kTaskMask), end = static_cast<int>(ticket >> kTaskBits & kTaskMask);
    if (next >= end) {
      return;
    }
    const std::uint64_t claimed = own ? ticket + 1 : ticket - kOneEnd;
    if (!word.compare_exchange_weak(ticket, claimed, std::memory_order_acq_rel, std::memory_order_acquire)) {
      continue;
    }
    const int claim = own ? next : end - 1;
    // The claim acquires what RunShared wrote before it released the ticket, and the phase does not end before this
    // task is done, so none of it changes meanwhile.
    const int shared = shared_.load(std::memory_order_relaxed), split = split_.load(std::memory_order_relaxed);
    int task = shared + claim;
    if (part < count()) {
      const int first = First(split, part), of_first = First(split, part + 1) - first;
      const int second = First(shared - split, part), of_second = First(shared - split, part + 1) - second;
      const int i = backwards_.load(std::memory_order_relaxed) ? of_first + of_second - 1 - claim : claim;
      task = i < of_first ? first + i : split + second + i - of_first;
    }
    call_.load(std::memory_order_relaxed)(body_.load(std::memory_order_relaxed), task, worker);
    done_.fetch_add(1, std::memory_order_release);  // The caller reads the results of the task after acquiring it.
    ticket = word.load(std::memory_order_acquire);
  }
}

void Workers::RunShared(int tasks, int split, int side_tasks, Call call, const void* body) {
  const int shared = tasks - side_tasks;
  // Relaxed: the release of the tickets publishes all of it.
  call_.store(call, std::memory_order_relaxed);
  body_.store(body, std::memory_order_relaxed);
  shared_.store(shared, std::memory_order_relaxed);
  split_.store(split, std::memory_order_relaxed);
  done_.store(0, std::memory_order_relaxed);
  caller_cpu_.store(::sched_getcpu(), std::memory_order_relaxed);
  const std::uint32_t phase = phase_.load(std::memory_order_relaxed) + 1;
  for (int part = 0; part <= count(); ++part) {
    const int own = part == count() ? side_tasks
                                    : First(split, part + 1) - First(split, part) + First(shared - split, part + 1) -
                                          First(shared - split, part);
    tickets_[static_cast<std::size_t>(part)].word.store(
        std::uint64_t{phase} << 2 * kTaskBits | static_cast<std::uint64_t>(own) << kTaskBits,
        std::memory_order_release);
  }
  phase_.store(phase, std::memory_order_release);
  phase_.notify_all();
  DoTasks(0);
  const auto all_done = [&] { return done_.load(std::memory_order_acquire) == tasks; };
  for (bool done = SpinUntil(all_done); !done; done = all_done()) {
    // A thread of lower priority may need this very core to finish its task.
    std::this_thread::sleep_for(kLateTaskSleep);
  }
}

void Workers::Loop(int worker) {
  CpuExclusion cpus;
  std::uint32_t seen = 0;
  while (!stop_.load(std::memory_order_relaxed)) {
    if (!SpinUntil([&] { return phase_.load(std::memory_order_acquire) != seen; })) {
      phase_.wait(seen, std::memory_order_acquire);
    }
    seen = phase_.load(std::memory_order_acquire);
    cpus.Exclude(caller_cpu_.load(std::memory_order_relaxed));
    DoTasks(worker);
  }
}

}  // namespace fulcrum::physics::implicit
