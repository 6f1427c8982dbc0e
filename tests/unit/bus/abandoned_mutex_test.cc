// Mutexes of dead and of stopped owners, in memory that two processes share.
#include "services/transport/bus/dds/abandoned_mutex.h"

#include <gtest/gtest.h>
#include <pthread.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <ctime>
#include <thread>

namespace fulcrum::bus::dds {
namespace {

struct Shared {
  pthread_mutex_t mutex;
  std::atomic<int> held, release;
};

/// A mutex and a process that holds it.
class AbandonedMutex : public ::testing::Test {
 protected:
  AbandonedMutex()
      : shared_(static_cast<Shared*>(
            mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0))) {}
  ~AbandonedMutex() override {
    End();
    munmap(shared_, sizeof(Shared));
  }
  void BeginHeld(int type) {
    pthread_mutexattr_t attributes;
    pthread_mutexattr_init(&attributes);
    pthread_mutexattr_setpshared(&attributes, PTHREAD_PROCESS_SHARED);
    pthread_mutexattr_settype(&attributes, type);
    ASSERT_EQ(pthread_mutex_init(&shared_->mutex, &attributes), 0);
    shared_->held = 0;
    shared_->release = 0;
    holder_ = fork();
    if (holder_ == 0) {
      pthread_mutex_lock(&shared_->mutex);
      shared_->held = 1;
      while (shared_->release == 0) usleep(1000);
      pthread_mutex_unlock(&shared_->mutex);
      for (;;) pause();
    }
    while (shared_->held == 0) usleep(100);
  }
  void End() {
    if (holder_ <= 0) return;
    kill(holder_, SIGKILL);
    waitpid(holder_, nullptr, 0);
    holder_ = 0;
  }
  /// Releases the mutex after more than the shortest limit.
  [[nodiscard]] std::jthread ReleaseLater() {
    return std::jthread([this] {
      usleep(100'000);
      shared_->release = 1;
    });
  }
  /// Locks as the library does: with a limit on the wall clock.
  int Lock(std::int64_t limit_ns) {
    timespec until{};
    clock_gettime(CLOCK_REALTIME, &until);
    const std::int64_t ns = until.tv_nsec + limit_ns;
    until.tv_sec += ns / 1'000'000'000;
    until.tv_nsec = ns % 1'000'000'000;
    return pthread_mutex_timedlock(&shared_->mutex, &until);
  }

  Shared* shared_;
  pid_t holder_ = 0;
};

constexpr std::int64_t kLimit_ns = 1'000'000'000, kShort_ns = 20'000'000;

TEST_F(AbandonedMutex, OfADeadOwnerPassesOnAndIsAMutexAgain) {
  for (const int type : {PTHREAD_MUTEX_NORMAL, PTHREAD_MUTEX_RECURSIVE}) {
    ASSERT_NO_FATAL_FAILURE(BeginHeld(type));
    End();
    const LockCounts before = SharedLocks();
    ASSERT_EQ(Lock(kLimit_ns), 0);
    EXPECT_EQ(SharedLocks().inherited, before.inherited + 1);
    EXPECT_EQ(SharedLocks().locked, before.locked + 1);
    EXPECT_EQ(pthread_mutex_unlock(&shared_->mutex), 0);
    ASSERT_EQ(Lock(kLimit_ns), 0);
    EXPECT_EQ(pthread_mutex_unlock(&shared_->mutex), 0);
    EXPECT_EQ(SharedLocks().inherited, before.inherited + 1) << "no owner had died";
  }
}

TEST_F(AbandonedMutex, OfALivingOwnerIsWaitedForButNotByAWriter) {
  ASSERT_NO_FATAL_FAILURE(BeginHeld(PTHREAD_MUTEX_NORMAL));
  const LockCounts before = SharedLocks();
  {
    const BoundedLocks bounded;
    EXPECT_EQ(Lock(kShort_ns), ETIMEDOUT);
  }
  const std::jthread later = ReleaseLater();
  EXPECT_EQ(Lock(kShort_ns), 0);
  EXPECT_EQ(SharedLocks().inherited, before.inherited);
  EXPECT_EQ(pthread_mutex_unlock(&shared_->mutex), 0);
}

TEST_F(AbandonedMutex, AStepOfTheWallClockIsNoLimit) {
  ASSERT_NO_FATAL_FAILURE(BeginHeld(PTHREAD_MUTEX_NORMAL));
  const std::jthread later = ReleaseLater();
  EXPECT_EQ(Lock(-3600 * kLimit_ns), 0) << "the wall clock was set forward after the limit was chosen";
  EXPECT_EQ(pthread_mutex_unlock(&shared_->mutex), 0);
}

TEST_F(AbandonedMutex, WhereTheOwnerDiedBeforeItSaidSo) {
  ASSERT_NO_FATAL_FAILURE(BeginHeld(PTHREAD_MUTEX_NORMAL));
  End();
  shared_->mutex.__data.__owner = 0;
  EXPECT_EQ(Lock(kLimit_ns), 0);
  EXPECT_EQ(pthread_mutex_unlock(&shared_->mutex), 0);
}

}  // namespace
}  // namespace fulcrum::bus::dds
