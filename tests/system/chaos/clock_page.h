// Memory shared by a test and the clock shim in the programs.
#pragma once

#include <atomic>
#include <cstdint>

namespace fulcrum::testing {

struct ClockPage {
  std::atomic<std::int64_t> offset_s{0};  ///< Offset of the shown wall clock from the real one.
  std::atomic<std::uint64_t> readings{0}, waits{0};
};

}  // namespace fulcrum::testing
