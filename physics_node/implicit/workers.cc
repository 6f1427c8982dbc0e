#include "physics_node/implicit/workers.h"

#include <sched.h>

#include <algorithm>
#include <chrono>

namespace fulcrum::physics::implicit {
namespace {

/// A thread without work sleeps after this: longer than most stretches between two phases of a step, or between two
/// steps of a replay. To be woken takes as long as a phase.
constexpr std::chrono::microseconds kPatience{200};
/// Pauses between two looks at the clock.
constexpr int kPauses = 32;

/// Leaves the processor's shared parts to the other thread of a core for a moment.
void Pause() {
#if defined(__x86_64__)
  __builtin_ia32_pause();
#elif defined(__aarch64__)
  asm volatile("isb" ::: "memory");
#endif
}

/// Spins until done() or out of patience, and returns whether done().
template <class Done>
bool SpinUntil(const Done& done) {
  const auto start = std::chrono::steady_clock::now();
  do {
    for (int pause = 0; pause < kPauses; ++pause) {
      if (done()) {
        return true;
      }
      Pause();
    }
  } while (std::chrono::steady_clock::now() - start < kPatience);
  return false;
}

/// Where the calling thread may run: all that it might at first, but one.
class OtherCpus {
 public:
  OtherCpus() { known_ = ::sched_getaffinity(0, sizeof(all_), &all_) == 0; }
  void KeepOff(int cpu) {
    if (cpu == kept_off_ || cpu < 0 || !known_) {
      return;
    }
    kept_off_ = cpu;
    cpu_set_t others = all_;
    CPU_CLR(static_cast<std::size_t>(cpu), &others);
    if (CPU_COUNT(&others) > 0) {
      (void)::sched_setaffinity(0, sizeof(others), &others);
    }
  }

 private:
  cpu_set_t all_{};
  bool known_ = false;
  int kept_off_ = -1;
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

void Workers::Help(int worker) {
  if (worker != 0) {
    HelpPart(count(), worker);
  }
  for (int i = 0; i < count(); ++i) {
    HelpPart((worker + i) % count(), worker);
  }
  HelpPart(count(), worker);
}

void Workers::HelpPart(int part, int worker) {
  const bool own = part == worker || part == count();
  std::atomic<std::uint64_t>& word = tickets_[static_cast<std::size_t>(part)].word;
  std::uint64_t ticket = word.load(std::memory_order_acquire);
  for (;;) {
    const auto next = static_cast<int>(ticket & 0xffffu), end = static_cast<int>(ticket >> 16 & 0xffffu);
    if (next >= end) {
      return;
    }
    const std::uint64_t claimed = own ? ticket + 1 : ticket - 0x10000u;
    if (!word.compare_exchange_weak(ticket, claimed, std::memory_order_acq_rel, std::memory_order_acquire)) {
      continue;
    }
    const int claim = own ? next : end - 1;
    // The phase cannot end before this task has, so all of this is its own.
    const int shared = shared_.load(std::memory_order_relaxed), split = split_.load(std::memory_order_relaxed);
    int task = shared + claim;
    if (part < count()) {
      const int first = First(split, part), of_first = First(split, part + 1) - first;
      const int second = First(shared - split, part), of_second = First(shared - split, part + 1) - second;
      const int i = backwards_.load(std::memory_order_relaxed) ? of_first + of_second - 1 - claim : claim;
      task = i < of_first ? first + i : split + second + i - of_first;
    }
    call_.load(std::memory_order_relaxed)(body_.load(std::memory_order_relaxed), task, worker);
    done_.fetch_add(1, std::memory_order_release);
    ticket = word.load(std::memory_order_acquire);
  }
}

void Workers::RunShared(int tasks, int split, int errands, Call call, const void* body) {
  const int shared = tasks - errands;
  call_.store(call, std::memory_order_relaxed);
  body_.store(body, std::memory_order_relaxed);
  shared_.store(shared, std::memory_order_relaxed);
  split_.store(split, std::memory_order_relaxed);
  done_.store(0, std::memory_order_relaxed);
  caller_cpu_.store(::sched_getcpu(), std::memory_order_relaxed);
  const std::uint32_t phase = phase_.load(std::memory_order_relaxed) + 1;
  for (int part = 0; part <= count(); ++part) {
    const int own = part == count() ? errands
                                    : First(split, part + 1) - First(split, part) + First(shared - split, part + 1) -
                                          First(shared - split, part);
    tickets_[static_cast<std::size_t>(part)].word.store(
        std::uint64_t{phase} << 32 | static_cast<std::uint64_t>(own) << 16, std::memory_order_release);
  }
  phase_.store(phase, std::memory_order_release);
  phase_.notify_all();
  Help(0);
  const auto all_done = [&] { return done_.load(std::memory_order_acquire) == tasks; };
  for (bool done = SpinUntil(all_done); !done; done = all_done()) {
    // A thread of lower priority may need this very core to finish its task.
    std::this_thread::sleep_for(std::chrono::microseconds(20));
  }
}

void Workers::Loop(int worker) {
  OtherCpus cpus;
  std::uint32_t seen = 0;
  while (!stop_.load(std::memory_order_relaxed)) {
    if (!SpinUntil([&] { return phase_.load(std::memory_order_acquire) != seen; })) {
      phase_.wait(seen, std::memory_order_acquire);
    }
    seen = phase_.load(std::memory_order_acquire);
    cpus.KeepOff(caller_cpu_.load(std::memory_order_relaxed));
    Help(worker);
  }
}

}  // namespace fulcrum::physics::implicit
