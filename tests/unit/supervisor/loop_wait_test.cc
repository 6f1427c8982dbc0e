// What ends the pause between two turns of the supervisor: the test fails if one of these does not end it.
#include "services/session/supervisor/loop_wait.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <thread>

namespace fulcrum::supervisor {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr auto kPause = 20s, kSoon = 10s;  // Far apart: the machine may be busy.

TEST(LoopWait, TheEndOfAChildEndsIt) {
  const LoopWait wait;
  const pid_t child = ::fork();
  if (child == 0) {
    ::usleep(200'000);
    ::_exit(0);
  }
  const auto begin = Clock::now();
  wait.Wait({}, kPause);
  EXPECT_LT(Clock::now() - begin, kSoon);
  EXPECT_EQ(::waitpid(child, nullptr, 0), child);
}

TEST(LoopWait, AReadableDescriptorEndsIt) {
  const LoopWait wait;
  std::array<int, 2> ends{};
  ASSERT_EQ(::pipe(ends.data()), 0);
  std::jthread writer([&] {
    std::this_thread::sleep_for(100ms);
    ASSERT_EQ(::write(ends[1], "x", 1), 1);
  });
  const auto begin = Clock::now();
  wait.Wait({ends[0]}, kPause);
  EXPECT_LT(Clock::now() - begin, kSoon);
  ::close(ends[0]);
  ::close(ends[1]);
}

TEST(LoopWait, OtherwiseItLastsAsLongAsAsked) {
  const LoopWait wait;
  const auto begin = Clock::now();
  wait.Wait({}, 50ms);
  EXPECT_GE(Clock::now() - begin, 50ms);
}

}  // namespace
}  // namespace fulcrum::supervisor
