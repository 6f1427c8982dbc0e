// One step of a node's clock. Solvers and nodes take a Tick and never read the clock of the operating system, so that
// the same class runs live, in a test and in a replay.
#pragma once

#include <cstdint>

namespace fulcrum {

inline constexpr std::int64_t kSecond_ns = 1'000'000'000;

struct Tick {
  std::uint64_t index = 0;      ///< Counts periods since the node's epoch began; skipped periods are counted too.
  double session_time_s = 0.0;  ///< Time since the session started [s]; negative before a session is known.
  double dt_s = 0.0;            ///< Nominal period [s].
  std::int64_t stamp_ns = 0;    ///< CLOCK_MONOTONIC at the start of the tick [ns].
};

}  // namespace fulcrum
