// Preloaded into the programs of a cart: shifts the wall clock (CLOCK_REALTIME) by the offset in a page shared with the
// test, as if the clock had been set. Steady clocks are unchanged. Waits for a wall time are counted: a program with
// such a wait would hang or spin when the clock is really set, which the shim cannot show. A mutex with a wall time as
// its limit does not count: it is locked at once unless its holder is delayed.
#include <dlfcn.h>
#include <fcntl.h>
#include <pthread.h>
#include <semaphore.h>
#include <sys/mman.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>

#include <cstdlib>

#include "tests/system/chaos/clock_page.h"

namespace {

using fulcrum::testing::ClockPage;

ClockPage* Page() {
  static ClockPage* const page = [] {
    static ClockPage none;
    const char* file = std::getenv("FULCRUM_TEST_CLOCK");
    const int fd = file == nullptr ? -1 : ::open(file, O_RDWR | O_CLOEXEC);
    void* map = fd < 0 ? MAP_FAILED : ::mmap(nullptr, sizeof(ClockPage), PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
    if (fd >= 0) ::close(fd);
    return map == MAP_FAILED ? &none : static_cast<ClockPage*>(map);
  }();
  return page;
}

template <class Function>
Function* Real(const char* name) {
  return reinterpret_cast<Function*>(::dlsym(RTLD_NEXT, name));
}

timespec Shifted(timespec t, std::int64_t seconds) {
  t.tv_sec += static_cast<time_t>(seconds);
  return t;
}

/// Time of the real clock when the shifted one shows `t`.
timespec Unshifted(const timespec* t) { return Shifted(*t, -Page()->offset_s.load()); }

timespec NoteWait(const timespec* t) {
  Page()->waits.fetch_add(1);
  return Unshifted(t);
}

bool IsWallClock(clockid_t clock) { return clock == CLOCK_REALTIME || clock == CLOCK_REALTIME_COARSE; }

}  // namespace

extern "C" {

int clock_gettime(clockid_t clock, timespec* t) noexcept {
  static auto* const real = Real<int(clockid_t, timespec*)>("clock_gettime");
  const int result = real(clock, t);
  if (result == 0 && IsWallClock(clock)) {
    Page()->readings.fetch_add(1);
    *t = Shifted(*t, Page()->offset_s.load());
  }
  return result;
}

int gettimeofday(timeval* t, void*) noexcept {
  timespec now{};
  const int result = clock_gettime(CLOCK_REALTIME, &now);
  *t = {now.tv_sec, now.tv_nsec / 1000};
  return result;
}

time_t time(time_t* t) noexcept {
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  if (t != nullptr) *t = now.tv_sec;
  return now.tv_sec;
}

int pthread_cond_timedwait(pthread_cond_t* condition, pthread_mutex_t* mutex, const timespec* t) {
  static auto* const real = Real<int(pthread_cond_t*, pthread_mutex_t*, const timespec*)>("pthread_cond_timedwait");
  const timespec until = NoteWait(t);
  return real(condition, mutex, &until);
}

int pthread_mutex_timedlock(pthread_mutex_t* mutex, const timespec* t) noexcept {
  static auto* const real = Real<int(pthread_mutex_t*, const timespec*)>("pthread_mutex_timedlock");
  const timespec until = Unshifted(t);
  return real(mutex, &until);
}

int sem_timedwait(sem_t* semaphore, const timespec* t) {
  static auto* const real = Real<int(sem_t*, const timespec*)>("sem_timedwait");
  const timespec until = NoteWait(t);
  return real(semaphore, &until);
}

int clock_nanosleep(clockid_t clock, int flags, const timespec* t, timespec* rest) {
  static auto* const real = Real<int(clockid_t, int, const timespec*, timespec*)>("clock_nanosleep");
  if (!IsWallClock(clock) || (flags & TIMER_ABSTIME) == 0) return real(clock, flags, t, rest);
  const timespec until = NoteWait(t);
  return real(clock, flags, &until, rest);
}

}  // extern "C"
