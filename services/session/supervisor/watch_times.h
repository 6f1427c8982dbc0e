// Times of the loop that watches nodes, shared by the supervisor and `fulcrum host`.
#pragma once

#include <chrono>
#include <cstdint>

#include "services/base/core/tick.h"

namespace fulcrum::supervisor {

inline constexpr auto kLoopPeriod = std::chrono::milliseconds(5);
/// Of the supervisor while the session runs. Deaths of children and commands interrupt it, a Health may wait, and what
/// a script does to the generator is published ahead.
inline constexpr auto kSessionPeriod = std::chrono::milliseconds(20);
/// From a death to the sweep of shared memory [ns]. The sweep removes names only: a process that has files of the dead
/// process open keeps them until their lease expires.
inline constexpr std::int64_t kSweepAfter_ns = 2 * kSecond_ns;
/// A longer gap in the loop [ns] means that the machine or this process was suspended: missing Health during the gap is
/// not attributed to a node.
inline constexpr std::int64_t kHeldUp_ns = kSecond_ns;
/// After a gap near the lease of participants (8 s) the nodes have removed this process and find it again: no silence
/// is attributed to a node for this long after it [ns].
inline constexpr std::int64_t kNearLease_ns = 7 * kSecond_ns, kRematch_ns = 10 * kSecond_ns;
/// Time from which the timeouts of nodes are measured after a gap in the loop.
[[nodiscard]] constexpr std::int64_t TimeoutsFrom(std::int64_t now_ns, std::int64_t gap_ns) {
  return now_ns + (gap_ns > kNearLease_ns ? kRematch_ns : 0);
}

}  // namespace fulcrum::supervisor
