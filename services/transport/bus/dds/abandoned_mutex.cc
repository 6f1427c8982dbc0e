#include "services/transport/bus/dds/abandoned_mutex.h"

#include <pthread.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <ctime>

#include "services/base/core/tick.h"

namespace fulcrum::bus::dds {
namespace {

constexpr std::int64_t kLook_ns = 5'000'000;  // Interval at which the owner is checked.
// A few instructions separate the lock of a mutex from the entry of its owner, and vice versa. A thread that was killed
// between them leaves no owner; one that stays there for this long is taken for dead.
constexpr std::int64_t kNobody_ns = kSecond_ns;
// glibc's mark of a mutex that several processes share, in __kind (nptl: PTHREAD_MUTEX_PSHARED_BIT).
constexpr int kShared = 128;

thread_local int bounded_depth = 0;
std::atomic<std::uint64_t> locked_count{0}, inherited_count{0};

std::int64_t NowNs(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return now.tv_sec * kSecond_ns + now.tv_nsec;
}

timespec TimeOf(std::int64_t ns) { return {ns / kSecond_ns, ns % kSecond_ns}; }

/// @param owner a thread of any process: kill(2) finds threads as well.
bool IsDead(int owner) { return owner > 0 && kill(owner, 0) != 0 && errno == ESRCH; }

/// The mutex stays locked; of several waiting threads one becomes its owner.
bool Inherit(pthread_mutex_t* mutex, int dead) {
  std::atomic_ref<int> owner(mutex->__data.__owner);
  if (!owner.compare_exchange_strong(dead, gettid())) return false;
  inherited_count.fetch_add(1, std::memory_order_relaxed);
  return true;
}

int LockShared(pthread_mutex_t* mutex, std::int64_t patience_ns) {
  const std::int64_t begin = NowNs(CLOCK_MONOTONIC);
  std::int64_t nobody_since = 0;
  for (;;) {
    const std::int64_t now = NowNs(CLOCK_MONOTONIC);
    std::int64_t look = now + kLook_ns;
    if (bounded_depth > 0) look = std::min(look, begin + patience_ns);
    const timespec until = TimeOf(look);
    const int result = pthread_mutex_clocklock(mutex, CLOCK_MONOTONIC, &until);
    if (result != ETIMEDOUT) return result;
    const int owner = std::atomic_ref<int>(mutex->__data.__owner).load();
    if (owner != 0) nobody_since = 0;
    if (owner == 0 && nobody_since == 0) nobody_since = now;
    const bool nobody =
        owner == 0 && now - nobody_since > kNobody_ns && std::atomic_ref<int>(mutex->__data.__lock) != 0;
    if ((nobody || IsDead(owner)) && Inherit(mutex, owner)) return 0;
    if (bounded_depth > 0 && NowNs(CLOCK_MONOTONIC) >= begin + patience_ns) return ETIMEDOUT;
  }
}

}  // namespace

BoundedLocks::BoundedLocks() noexcept { ++bounded_depth; }
BoundedLocks::~BoundedLocks() { --bounded_depth; }

LockCounts SharedLocks() noexcept {
  return {locked_count.load(std::memory_order_relaxed), inherited_count.load(std::memory_order_relaxed)};
}

}  // namespace fulcrum::bus::dds

extern "C" __attribute__((visibility("default"))) int pthread_mutex_timedlock(pthread_mutex_t* mutex,
                                                                              const timespec* deadline) noexcept {
  using namespace fulcrum::bus::dds;
  using fulcrum::kSecond_ns;
  if ((mutex->__data.__kind & kShared) == 0) return pthread_mutex_clocklock(mutex, CLOCK_REALTIME, deadline);
  const std::int64_t left_ns = deadline->tv_sec * kSecond_ns + deadline->tv_nsec - NowNs(CLOCK_REALTIME);
  const int result = LockShared(mutex, std::clamp<std::int64_t>(left_ns, 0, kSecond_ns));
  if (result == 0) locked_count.fetch_add(1, std::memory_order_relaxed);
  return result;
}
