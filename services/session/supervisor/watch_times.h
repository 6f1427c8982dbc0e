// Times of the loop that watches nodes, shared by the supervisor and `fulcrum host`.
#pragma once

#include <chrono>
#include <cstdint>

#include "services/base/core/tick.h"

namespace fulcrum::supervisor {

inline constexpr auto kLoopPeriod = std::chrono::milliseconds(5);
/// From a death to the sweep of shared memory [ns]. The sweep removes names only: a process that has files of the dead
/// process open keeps them until their lease expires.
inline constexpr std::int64_t kSweepAfter_ns = 2 * kSecond_ns;
/// A longer gap in the loop [ns] means that the machine or this process was suspended: missing Health during the gap is
/// not attributed to a node.
inline constexpr std::int64_t kHeldUp_ns = kSecond_ns;

}  // namespace fulcrum::supervisor
