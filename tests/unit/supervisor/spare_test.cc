// A spare replaces a node that has died, and no other. The node is a shell that writes its events to a file.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "services/base/core/tick.h"
#include "services/session/supervisor/node_process.h"

namespace fulcrum::supervisor {
namespace {

namespace fs = std::filesystem;

constexpr const char* kNode = R"sh(
case "$*" in *--spare*)
  echo waits
  [ -n "$(head -c 1 | od -A n -t x1)" ] || { echo not needed; exit 0; }
  echo needed;;
esac
echo runs
exec sleep 60)sh";

class SpareTest : public ::testing::Test {
 protected:
  SpareTest()
      : folder_(fs::temp_directory_path() / ("spare_test." + std::to_string(::getpid()))), node_(CommandOfNode()) {
    node_.Start(now_ns_);
    Report();
  }
  ~SpareTest() override { fs::remove_all(folder_); }

  NodeCommand CommandOfNode() const {
    fs::create_directories(folder_);
    NodeCommand command;
    command.id = NodeId::kRender;
    command.program = "/bin/sh";
    command.arguments = {"-c", kNode, "node"};
    command.log = folder_ / "log";
    command.has_spare = true;
    return command;
  }
  std::string Log() const {
    std::ifstream stream(folder_ / "log");
    return {std::istreambuf_iterator<char>(stream), {}};
  }
  /// False after a time limit that only a fault can exceed.
  bool SaysUntil(const std::string& what) const {
    for (int i = 0; i < 10'000; ++i) {
      if (Log().find(what) != std::string::npos) return true;
      ::usleep(1000);
    }
    return false;
  }
  void Report() {
    Health health;
    health.node = NodeId::kRender;
    health.pid = node_.pid();
    node_.OnHealth(health, now_ns_);
  }
  /// Waits until the node has died and runs again.
  void WaitForRestart() {
    for (int i = 0; i < 10'000 && !node_.Update(now_ns_); ++i) ::usleep(1000);
    (void)node_.Update(now_ns_);
    EXPECT_TRUE(node_.running());
  }
  void StartSpare() {
    now_ns_ += 2 * kSecond_ns;
    EXPECT_FALSE(node_.Update(now_ns_));
    EXPECT_TRUE(SaysUntil("runs\nwaits\n")) << Log();
  }

  const fs::path folder_;
  std::int64_t now_ns_ = kSecond_ns;
  NodeProcess node_;
};

TEST_F(SpareTest, TakesThePlaceOfANodeThatDies) {
  ASSERT_TRUE(SaysUntil("runs\n"));
  StartSpare();
  ::kill(node_.pid(), SIGKILL);
  WaitForRestart();
  EXPECT_TRUE(SaysUntil("runs\nwaits\nneeded\nruns\n")) << Log();
}

TEST_F(SpareTest, IsNotStartedForANodeThatHasNotReportedOrHasJustBegun) {
  ASSERT_TRUE(SaysUntil("runs\n"));
  EXPECT_FALSE(node_.Update(now_ns_ + kSecond_ns / 2));
  ::kill(node_.pid(), SIGKILL);
  WaitForRestart();
  now_ns_ += 2 * kSecond_ns;
  EXPECT_FALSE(node_.Update(now_ns_));
  ASSERT_TRUE(SaysUntil("runs\nruns\n"));
  EXPECT_EQ(Log(), "runs\nruns\n");
}

TEST_F(SpareTest, OfTheProgramAsItWasIsNotUsedForARestartByCommand) {
  ASSERT_TRUE(SaysUntil("runs\n"));
  StartSpare();
  node_.AskRestart(now_ns_);
  WaitForRestart();
  EXPECT_TRUE(SaysUntil("runs\nwaits\nruns\n")) << Log();
}

TEST_F(SpareTest, ThatDiedIsReplacedByAStartAsUsual) {
  ASSERT_TRUE(SaysUntil("runs\n"));
  StartSpare();
  // A process group of its own, as for every child: the shell and its children.
  for (const auto& entry : fs::directory_iterator("/proc/self/task/" + std::to_string(::getpid()))) {
    if (entry.path().filename() != "children") continue;
    std::ifstream children(entry.path());
    for (pid_t child = 0; children >> child;) {
      if (child == node_.pid()) continue;
      ::kill(-child, SIGKILL);
      siginfo_t end;
      ASSERT_EQ(::waitid(P_PID, static_cast<id_t>(child), &end, WEXITED | WNOWAIT), 0);
    }
  }
  ::kill(node_.pid(), SIGKILL);
  WaitForRestart();
  EXPECT_TRUE(SaysUntil("runs\nwaits\nruns\n")) << Log();
}

TEST_F(SpareTest, EndsWithTheSession) {
  ASSERT_TRUE(SaysUntil("runs\n"));
  StartSpare();
  node_.Stop();
  for (int i = 0; i < 10'000 && !node_.HasEnded(); ++i) ::usleep(1000);
  EXPECT_TRUE(node_.HasEnded());
  std::ifstream children("/proc/self/task/" + std::to_string(::getpid()) + "/children");
  pid_t left = 0;
  EXPECT_FALSE(children >> left);
}

}  // namespace
}  // namespace fulcrum::supervisor
