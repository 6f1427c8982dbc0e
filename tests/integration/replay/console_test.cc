// The replayer's console as a program: its commands through a pipe.
#include <gtest/gtest.h>
#include <poll.h>
#include <pty.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <iterator>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tests/integration/replay/short_session.h"
#include "tests/support/cart.h"
#include "tests/support/program.h"

namespace fulcrum::replay {
namespace {

namespace fs = std::filesystem;

/// Number of entries of a folder.
std::ptrdiff_t CountIn(const fs::path& folder) {
  return std::distance(fs::directory_iterator(folder), fs::directory_iterator());
}

/// A replay of which a person types the commands; what it prints is read until it ends.
class Typed {
 public:
  Typed(const fs::path& recording, const std::string& keys) {
    const std::string program = fs::path(FULCRUM_BIN_DIR) / "replayer", file = recording;
    pid_ = ::forkpty(&terminal_, nullptr, nullptr, nullptr);
    if (pid_ == 0) {
      ::prctl(PR_SET_PDEATHSIG, SIGKILL);
      ::execl(program.c_str(), "replayer", file.c_str(), "--into", "physics", "--console", nullptr);
      ::_exit(127);
    }
    Type(keys);
  }
  ~Typed() { ::close(terminal_); }
  Typed(const Typed&) = delete;
  Typed& operator=(const Typed&) = delete;

  void Type(const std::string& keys) const {
    EXPECT_EQ(::write(terminal_, keys.data(), keys.size()), static_cast<ssize_t>(keys.size()));
  }
  [[nodiscard]] pid_t pid() const { return pid_; }
  /// Exit code, or minus the signal; what it printed is in `said`. A replay that is silent for long is ended.
  int End(std::string* said) {
    constexpr int kLongestSilence_ms = 60'000;
    std::array<char, 1024> part{};
    for (;;) {
      pollfd printed{terminal_, POLLIN, 0};
      const bool silent = ::poll(&printed, 1, kLongestSilence_ms) == 0;
      const ssize_t n = silent ? 0 : ::read(terminal_, part.data(), part.size());
      if (silent) ::kill(pid_, SIGKILL);
      if (n <= 0) break;
      said->append(part.data(), static_cast<std::size_t>(n));
    }
    int status = 0;
    ::waitpid(pid_, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  }

 private:
  int terminal_ = -1;
  pid_t pid_ = -1;
};

class ConsoleTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    // From 3 s on the recorded tools are altered.
    testing::CartStory story{.seconds = 3.2};
    story.tool_change = [](ToolState* tools) {
      if (tools->stamp.stamp_ns >= testing::kCartStart_ns + 3 * kSecond_ns) tools->tools[0].p_WT.x() += 1e-3f;
      return true;
    };
    session_ = std::make_unique<testing::ShortSession>("console_test", story, [](scene::SceneData*) {});
  }
  static void TearDownTestSuite() { session_.reset(); }

  struct Answer {
    std::string text;
    int code = -1;
  };
  static Answer Ask(const std::string& commands, const std::string& into = "physics") {
    fulcrum::testing::Program program("replayer", {session_->recording(), "--into", into, "--console"}, commands);
    constexpr double kPatience_s = 120;
    std::optional<int> code;
    (void)fulcrum::testing::WaitFor(kPatience_s, [&] { return (code = program.Poll()).has_value(); });
    return {program.Said(), code.value_or(-1)};
  }

  static std::unique_ptr<testing::ShortSession> session_;
};
std::unique_ptr<testing::ShortSession> ConsoleTest::session_;

TEST_F(ConsoleTest, Steps) {
  const Answer answer = Ask("step\nstep 9\nquit\n");
  EXPECT_EQ(answer.code, 0) << answer.text;
  EXPECT_NE(answer.text.find("tick 0 at 0.000 s"), std::string::npos) << answer.text;
  EXPECT_NE(answer.text.find("tick 9 at 0.090 s"), std::string::npos) << answer.text;
  EXPECT_NE(answer.text.find("as recorded; 10 compared"), std::string::npos) << answer.text;
}

TEST_F(ConsoleTest, SeeksBackAsOftenAsOneLikes) {
  const Answer answer = Ask("go 2.5\nseek 1.2\nseek 2.1\nseek 0.5\nstep\nseek 2.9\nquit\n");
  EXPECT_EQ(answer.code, 0) << answer.text;
  std::vector<std::string> wanted{"tick 249", "tick 119", "tick 209", "tick 49", "tick 50", "tick 289"};
  std::size_t at = 0;
  for (const std::string& tick : wanted) {
    at = answer.text.find(tick, at);
    ASSERT_NE(at, std::string::npos) << tick << " is missing or out of order:\n" << answer.text;
  }
  EXPECT_EQ(answer.text.find("DIFFERENT"), std::string::npos) << answer.text;
}

TEST_F(ConsoleTest, StopsWhereItDiffers) {
  const Answer answer = Ask("go\nseek 2.5\ngo\nquit\n");
  EXPECT_EQ(answer.code, 1) << answer.text;
  const std::size_t first = answer.text.find("physics_node differs from tick 300 on: TissueFrame.xyz[");
  ASSERT_NE(first, std::string::npos) << answer.text;
  EXPECT_NE(answer.text.find("physics_node differs from tick 300 on", first + 1), std::string::npos)
      << "the same after going back:\n"
      << answer.text;
}

TEST_F(ConsoleTest, EnterPausesAlsoAtFullSpeed) {
  Typed typed(session_->recording(), "step\ngo\n\nquit\n");
  std::string said;
  EXPECT_EQ(typed.End(&said), 0) << said;
  EXPECT_NE(said.find("tick 0 at 0.000 s"), std::string::npos) << said;
  EXPECT_EQ(said.find("differs from tick 300"), std::string::npos) << "it went on: " << said;
}

/// TMPDIR is an empty folder while this exists.
class EmptyTemporaryFolder {
 public:
  explicit EmptyTemporaryFolder(const fs::path& folder) : folder_(folder) {
    fs::create_directory(folder_);
    ::setenv("TMPDIR", folder_.c_str(), 1);
  }
  ~EmptyTemporaryFolder() { ::unsetenv("TMPDIR"); }
  EmptyTemporaryFolder(const EmptyTemporaryFolder&) = delete;
  EmptyTemporaryFolder& operator=(const EmptyTemporaryFolder&) = delete;
  [[nodiscard]] std::ptrdiff_t count() const { return CountIn(folder_); }
  void AwaitEntry() const {
    for (int i = 0; i < 400 && count() == 0; ++i) ::usleep(50'000);
    ASSERT_EQ(count(), 1);
    ::usleep(300'000);
  }

 private:
  fs::path folder_;
};

TEST_F(ConsoleTest, ASignalLeavesNoTemporaryFiles) {
  const EmptyTemporaryFolder temporary(session_->folder() / "tmp");
  for (const int signal : {SIGINT, SIGTERM}) {
    fulcrum::testing::Program slow("replayer", {session_->recording(), "--into", "physics", "--rate", "0.2"});
    temporary.AwaitEntry();
    EXPECT_EQ(slow.End(signal), 1) << slow.Said();
    EXPECT_NE(slow.Said().find("replayer: stopped"), std::string::npos) << slow.Said();
    EXPECT_EQ(temporary.count(), 0);

    Typed waits(session_->recording(), "");
    temporary.AwaitEntry();
    ::kill(waits.pid(), signal);
    std::string said;
    EXPECT_EQ(waits.End(&said), 1) << said;
    EXPECT_EQ(temporary.count(), 0);
  }
  // Ctrl-C reaches all processes of the replay.
  Typed typed(session_->recording(), "go 1.5\n");
  temporary.AwaitEntry();
  typed.Type("\x03");
  std::string said;
  EXPECT_EQ(typed.End(&said), 1) << said;
  EXPECT_EQ(temporary.count(), 0);
}

}  // namespace
}  // namespace fulcrum::replay
