// Counts operations that a real-time loop must not do. A program linked with fulcrum_allocation_guard has the malloc
// family and pthread_mutex_lock replaced by versions that count the calls on guarded threads and then call the
// original.
//
//   AllocationGuard guard;
//   servo.Step(tick);
//   EXPECT_EQ(guard.violations(), 0);
#pragma once

#include <cstdint>

namespace fulcrum::testing {

/// The calling thread is guarded during the lifetime of this object. Guards do not nest.
class AllocationGuard {
 public:
  AllocationGuard();
  ~AllocationGuard();
  AllocationGuard(const AllocationGuard&) = delete;
  AllocationGuard& operator=(const AllocationGuard&) = delete;

  /// Allocations, releases and mutex locks of this thread since the guard was made.
  [[nodiscard]] std::int64_t violations() const;

  /// False where a sanitizer replaces malloc: nothing is counted there.
  [[nodiscard]] static bool active();
};

}  // namespace fulcrum::testing
