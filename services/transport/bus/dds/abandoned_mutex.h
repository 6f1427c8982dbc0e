// Mutexes in shared memory whose owner was killed. Internal to services/transport/bus/dds.
//
// The library (2.9.1) guards what writers and readers share (data-sharing notifications) with mutexes that are not
// robust: who dies while he holds one leaves it locked. Whoever wants it next gives up after a second of the wall clock
// and throws; on the thread that listens for data nobody catches that, and the process ends (later versions catch it,
// Fast DDS pull request 5468). A writer that the reader it has just woken displaces holds such a mutex as long as it
// waits for a processor, so on a busy machine a kill finds one held now and then.
//
// Linking this defines pthread_mutex_timedlock for the process, which only the library calls:
//   - a mutex of a dead owner passes to the one that waits for it. What these mutexes guard bears it: a flag, and a
//     list that only the reader changes that lives;
//   - limits are measured on CLOCK_MONOTONIC, so a step of the wall clock is none;
//   - of a living owner a thread of the library waits for as long as it takes, a thread of ours that is writing no
//     longer than the library says.
#pragma once

#include <cstdint>

namespace fulcrum::bus::dds {

/// While one lives, its thread waits for a living owner no longer than the library says: write() then fails.
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
/// Of this process. Calling it also makes sure that the definition above is linked.
[[nodiscard]] LockCounts SharedLocks() noexcept;

}  // namespace fulcrum::bus::dds
