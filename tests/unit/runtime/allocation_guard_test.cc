#include "tests/unit/runtime/allocation_guard.h"

#include <gtest/gtest.h>

#include <memory>
#include <mutex>
#include <thread>

namespace fulcrum::testing {
namespace {

TEST(AllocationGuard, SeesAllocationsReleasesAndLocksOfItsThreadOnly) {
  if (!AllocationGuard::active()) GTEST_SKIP() << "a sanitizer replaces malloc in this build";
  std::mutex mutex;
  std::int64_t nothing = 0;
  std::int64_t allocation = 0;
  std::int64_t lock = 0;
  std::unique_ptr<int> kept;
  {
    const AllocationGuard guard;
    nothing = guard.violations();
    kept = std::make_unique<int>(3);
    allocation = guard.violations();
    const std::lock_guard held(mutex);
    lock = guard.violations();
  }
  EXPECT_EQ(nothing, 0);
  EXPECT_EQ(allocation, 1);
  EXPECT_EQ(lock, 2);
  std::thread other([&] { *kept = *std::make_unique<int>(4); });
  const AllocationGuard guard;
  // The other thread allocates while this one is guarded; join itself needs no memory.
  other.join();
  EXPECT_EQ(guard.violations(), 0);
}

}  // namespace
}  // namespace fulcrum::testing
