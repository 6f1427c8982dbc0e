// Wakes a thread from its rest.
#pragma once

#include <semaphore.h>

#include <atomic>
#include <cstdint>
#include <ctime>

namespace fulcrum::runtime {

/// Ring() may be called on any thread, also a real-time one: it neither waits nor allocates.
class Bell {
 public:
  Bell() { ::sem_init(&semaphore_, 0, 0); }
  ~Bell() { ::sem_destroy(&semaphore_); }
  Bell(const Bell&) = delete;
  Bell& operator=(const Bell&) = delete;

  void Ring() noexcept {
    if (!rung_.exchange(true)) ::sem_post(&semaphore_);
  }

  /// Waits until Ring() has been called since the last wait, at most until `until_ns` (CLOCK_MONOTONIC). One thread.
  /// Returns whether it has been called.
  bool WaitUntil(std::int64_t until_ns) noexcept {
    constexpr std::int64_t kSecond_ns = 1'000'000'000;
    const timespec until{static_cast<time_t>(until_ns / kSecond_ns), static_cast<long>(until_ns % kSecond_ns)};
    if (::sem_clockwait(&semaphore_, CLOCK_MONOTONIC, &until) != 0) return false;
    // A call before this store is not counted again: what it tells of is there already.
    rung_.store(false);
    return true;
  }

 private:
  std::atomic<bool> rung_{false};  ///< The semaphore has been posted and not been waited for.
  sem_t semaphore_;
};

}  // namespace fulcrum::runtime
