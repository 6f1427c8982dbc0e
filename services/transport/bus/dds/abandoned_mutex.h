// Takeover of mutexes in shared memory whose owner was killed. Internal to services/transport/bus/dds.
//
// The library (2.9.1) guards data that writers and readers share (data-sharing notifications) with mutexes that are not
// robust: a process that is killed while it holds one leaves it locked. The next locker then fails after a second of
// the wall clock with an exception. On the thread that receives data nothing catches it, and the process ends (later
// versions catch it, Fast DDS pull request 5468). A writer that is preempted by the reader it has just woken holds such
// a mutex until it is scheduled again, so on a busy machine a kill sometimes happens while a mutex is held.
//
// Linking this file defines pthread_mutex_timedlock for the process; only the library calls it:
//   - A mutex of a dead owner passes to a thread that waits for it. The data under these mutexes tolerates this: a
//   flag,
//     and a list that only the surviving reader changes.
//   - Limits are measured on CLOCK_MONOTONIC, so a step of the wall clock has no effect.
//   - If the owner lives, a thread of the library waits without limit, and a thread of ours that is writing waits no
//     longer than the library's limit.
#pragma once

#include <cstdint>

namespace fulcrum::bus::dds {

/// While an object exists, its thread waits for a living owner no longer than the library's limit: write() then fails.
class BoundedLocks {
 public:
  BoundedLocks() noexcept;
  ~BoundedLocks();
  BoundedLocks(const BoundedLocks&) = delete;
  BoundedLocks& operator=(const BoundedLocks&) = delete;
};

struct LockCounts {
  std::uint64_t locked = 0;     ///< Shared mutexes that were locked.
  std::uint64_t inherited = 0;  ///< Of them, those whose owner had died.
};
/// Counts of this process. Calling it also makes sure that the definition above is linked.
[[nodiscard]] LockCounts SharedLocks() noexcept;

}  // namespace fulcrum::bus::dds
