// Times of the loop that watches nodes: the same in the supervisor and on a second host.
#pragma once

#include <chrono>
#include <cstdint>

#include "services/base/core/tick.h"

namespace fulcrum::supervisor {

inline constexpr auto kLoopPeriod = std::chrono::milliseconds(5);
/// From a death to the sweep of shared memory [ns]. The sweep removes names only: a process that has the files of the
/// dead one open keeps them until its lease is over.
inline constexpr std::int64_t kSweepAfter_ns = 2 * kSecond_ns;
/// A longer gap in the loop [ns] means that the machine or the loop's process was suspended: silence of a node during
/// the gap proves nothing.
inline constexpr std::int64_t kHeldUp_ns = kSecond_ns;

}  // namespace fulcrum::supervisor
