// Memory that a test and the clock shim in the programs share.
#pragma once

#include <atomic>
#include <cstdint>

namespace fulcrum::testing {

struct ClockPage {
  std::atomic<std::int64_t> offset_s{0};  ///< The wall clock shows this much more than it should.
  std::atomic<std::uint64_t> readings{0}, waits{0};
};

}  // namespace fulcrum::testing
