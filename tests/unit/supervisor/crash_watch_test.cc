// What the process that watches a supervisor does when that is killed, before and after the end of the session.
#include "services/session/supervisor/crash_watch.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <string>

#include "tests/unit/supervisor/temporary_folder.h"

namespace fulcrum::supervisor {
namespace {

constexpr int kWatchedDomain = 98;

class CrashWatchTest : public ::testing::Test {
 protected:
  void SetUp() override {
    child_ = ::fork();
    if (child_ != 0) return;
    ::setpgid(0, 0);
    for (;;) ::pause();
  }
  void TearDown() override {
    ::kill(child_, SIGKILL);
    ::waitpid(child_, nullptr, 0);
  }

  /// What the watching process of a supervisor with `child_` says when that is killed.
  std::string SaidOf(bool session_has_ended) {
    std::array<int, 2> said{}, ready{};
    EXPECT_EQ(::pipe(said.data()), 0);
    EXPECT_EQ(::pipe(ready.data()), 0);
    const pid_t supervisor = ::fork();
    if (supervisor == 0) {
      ::dup2(said[1], STDERR_FILENO);
      SessionFolder folder;
      folder.path = folder_.path();
      folder.session_id = "a-session";
      CrashWatch watch(kWatchedDomain, folder_.path() / "memory", folder);
      watch.Note(0, child_);
      if (session_has_ended) watch.Done();
      (void)!::write(ready[1], "x", 1);
      for (;;) ::pause();
    }
    ::close(said[1]);
    ::close(ready[1]);
    char byte = 0;
    EXPECT_EQ(::read(ready[0], &byte, 1), 1);
    ::kill(supervisor, SIGKILL);
    ::waitpid(supervisor, nullptr, 0);
    std::string text;
    std::array<char, 512> part{};
    // The watching process has the last writing end: its end ends the text.
    for (ssize_t n = 0; (n = ::read(said[0], part.data(), part.size())) > 0;) text.append(part.data(), n);
    ::close(said[0]);
    ::close(ready[0]);
    return text;
  }
  [[nodiscard]] bool ChildRuns() const { return ::waitpid(child_, nullptr, WNOHANG) == 0; }

  TemporaryFolder folder_;
  pid_t child_ = -1;
};

TEST_F(CrashWatchTest, EndsTheChildrenOfASessionThatRan) {
  EXPECT_NE(SaidOf(false).find("session a-session is over without a report"), std::string::npos);
  EXPECT_FALSE(ChildRuns());
}

TEST_F(CrashWatchTest, EndsNothingAfterTheSession) {
  const std::string said = SaidOf(true);
  EXPECT_NE(said.find("after session a-session had ended"), std::string::npos) << said;
  EXPECT_EQ(said.find("without a report"), std::string::npos) << said;
  EXPECT_TRUE(ChildRuns()) << "its number may belong to another process by then";
}

}  // namespace
}  // namespace fulcrum::supervisor
