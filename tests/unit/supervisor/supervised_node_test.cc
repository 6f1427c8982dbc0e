// One node under the supervisor: its process, its restarts, and a node that systemd runs.
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "services/base/core/error.h"
#include "services/base/runtime/child_process.h"
#include "services/session/supervisor/attached_node.h"
#include "services/session/supervisor/node_process.h"
#include "services/session/supervisor/restart_policy.h"
#include "services/session/supervisor/session_nodes.h"
#include "tests/unit/supervisor/temporary_folder.h"

namespace fulcrum::supervisor {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kMs = 1'000'000;

// ------------------------------------------------------------------------------------------------- attached node

/// A sleeping process in place of a node that systemd runs.
class AttachedNodeTest : public ::testing::Test {
 protected:
  AttachedNodeTest() : node_(Command(), folder_.path() / "nodes", [this](NodeId, const char* verb) { order_ = verb; }) {
    node_.Start(kStart);
  }
  static NodeCommand Command() {
    NodeCommand command;
    command.id = NodeId::kPhysics;
    command.arguments = {"--scene", "/run/scene.fulcrum"};
    return command;
  }
  runtime::ChildProcess Sleeper() const {
    return runtime::ChildProcess::Start("/bin/sleep", {"600"}, folder_.path() / "log");
  }
  bool Report(pid_t pid, HealthState state = HealthState::kRunning) {
    Health health;
    health.node = NodeId::kPhysics;
    health.pid = pid;
    health.state = state;
    return node_.OnHealth(health, kStart);
  }
  static void Kill(runtime::ChildProcess* process) {
    process->Signal(SIGKILL);
    while (!process->Poll()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }

  static constexpr std::int64_t kStart = 1'000'000'000'000;
  TemporaryFolder folder_;
  std::string order_;
  AttachedNode node_;
};

TEST_F(AttachedNodeTest, WritesWhatItsServiceIsGiven) {
  std::ifstream file(folder_.path() / "nodes" / "physics_node");
  std::string line;
  std::getline(file, line);
  EXPECT_EQ(line, "FULCRUM_ARGUMENTS=\"--scene /run/scene.fulcrum\"");
  EXPECT_THROW((void)AttachedNode::ArgumentsFile({"--file", "/my recordings/a.mcap"}), InputError);
  EXPECT_THROW((void)AttachedNode::ArgumentsFile({"$HOME"}), InputError);
  node_.Stop();
  EXPECT_FALSE(fs::exists(folder_.path() / "nodes" / "physics_node"))
      << "otherwise it would be started after the session";
}

TEST_F(AttachedNodeTest, NoticesADeathAndTheReturn) {
  runtime::ChildProcess first = Sleeper(), other = Sleeper();
  EXPECT_TRUE(Report(first.pid()));
  EXPECT_FALSE(Report(other.pid())) << "the first process runs";
  EXPECT_FALSE(node_.Update(kStart).has_value());
  const pid_t dead = first.pid();
  Kill(&first);
  EXPECT_FALSE(node_.Update(kStart).has_value()) << "its last Health may still arrive";
  const auto death = node_.Update(kStart + 300 * kMs);
  ASSERT_TRUE(death.has_value());
  EXPECT_FALSE(death->for_good);
  EXPECT_FALSE(death->asked);
  EXPECT_EQ(death->at_ns, kStart);
  EXPECT_FALSE(node_.running());
  EXPECT_FALSE(Report(dead)) << "a late sample of the dead process";
  EXPECT_FALSE(node_.Update(kStart + 400 * kMs).has_value()) << "reported once";
  EXPECT_TRUE(Report(other.pid()));
  EXPECT_TRUE(node_.running());
}

TEST_F(AttachedNodeTest, DoesNotWaitForLastWordsWhenTheNextOneSpeaks) {
  runtime::ChildProcess first = Sleeper(), second = Sleeper();
  ASSERT_TRUE(Report(first.pid()));
  Kill(&first);
  EXPECT_FALSE(node_.Update(kStart).has_value());
  EXPECT_FALSE(Report(second.pid())) << "Update() reports the death before the new process counts";
  EXPECT_TRUE(node_.Update(kStart).has_value());
  EXPECT_TRUE(Report(second.pid()));
}

TEST_F(AttachedNodeTest, LastWordsMayComeAfterTheEnd) {
  runtime::ChildProcess first = Sleeper();
  ASSERT_TRUE(Report(first.pid()));
  const pid_t dead = first.pid();
  Kill(&first);
  EXPECT_FALSE(node_.Update(kStart).has_value());
  EXPECT_TRUE(Report(dead, HealthState::kStopping));
  EXPECT_FALSE(node_.Update(kStart + 300 * kMs).has_value()) << "it was stopped and did not die";
}

TEST_F(AttachedNodeTest, OneThatWasStoppedIsReportedWhenItIsBack) {
  runtime::ChildProcess first = Sleeper(), second = Sleeper();
  node_.AskRestart(kStart);
  EXPECT_EQ(order_, "restart");
  ASSERT_TRUE(Report(first.pid()));
  ASSERT_TRUE(Report(first.pid(), HealthState::kStopping));
  Kill(&first);
  EXPECT_FALSE(node_.Update(kStart).has_value());
  ASSERT_TRUE(Report(second.pid()));
  const auto death = node_.Update(kStart + kMs);
  ASSERT_TRUE(death.has_value());
  EXPECT_TRUE(death->asked);
  EXPECT_EQ(death->at_ns, kStart) << "the time of the restart counts from its end";
}

TEST_F(AttachedNodeTest, HasFailedForGoodWhenItStaysAway) {
  EXPECT_FALSE(node_.Update(kStart + 59'000 * kMs).has_value());
  const auto death = node_.Update(kStart + 61'000 * kMs);
  ASSERT_TRUE(death.has_value());
  EXPECT_TRUE(death->for_good);
  EXPECT_TRUE(node_.failed());
}

// -------------------------------------------------------------------------------------------------- standby pair

TEST(StandbyPair, ACommandReachesTheProcessThatLeads) {
  const TemporaryFolder folder;
  std::vector<std::unique_ptr<SupervisedNode>> nodes;
  for (const char* seat : {"a", "b"}) {
    NodeCommand command;
    command.id = NodeId::kPhysics;
    command.program = "/bin/sleep";
    command.arguments = {"600"};
    command.log = folder.path() / seat;
    nodes.push_back(std::make_unique<NodeProcess>(command));
    nodes.back()->Start(kMs);
  }
  const auto report = [&](std::size_t seat, HealthState state) {
    Health health;
    health.node = NodeId::kPhysics;
    health.pid = nodes[seat]->pid();
    health.state = state;
    EXPECT_TRUE(nodes[seat]->OnHealth(health, 2 * kMs));
  };
  EXPECT_EQ(FindRunning(nodes, "physics_node"), nodes[0].get()) << "none leads yet";
  report(0, HealthState::kRunning);
  report(1, HealthState::kWaiting);
  EXPECT_EQ(FindRunning(nodes, "physics_node"), nodes[0].get());
  report(0, HealthState::kWaiting);
  report(1, HealthState::kDegraded);
  EXPECT_EQ(FindRunning(nodes, "physics_node"), nodes[1].get());
  EXPECT_EQ(FindRunning(nodes, "thermal_node"), nullptr);
  report(0, HealthState::kRunning);
  nodes[0]->StopWaiting();
  while (!nodes[0]->HasEnded()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_EQ(FindRunning(nodes, "physics_node"), nodes[1].get()) << "the other one is dead";
}

// ------------------------------------------------------------------------------------------------ restart policy

TEST(RestartPolicyTest, FirstDeathIsRestartedAtOnce) {
  RestartPolicy policy;
  EXPECT_EQ(policy.OnDeath(10 * kMs), 0);
}

TEST(RestartPolicyTest, CrashLoopBacksOffAndThenGivesUp) {
  RestartPolicy policy(
      {.healthy_ns = 1000 * kMs, .first_delay_ns = 100 * kMs, .longest_delay_ns = 250 * kMs, .most_quick_deaths = 6});
  EXPECT_EQ(policy.OnDeath(kMs), 0);
  EXPECT_EQ(policy.OnDeath(kMs), 100 * kMs);
  EXPECT_EQ(policy.OnDeath(kMs), 200 * kMs);
  EXPECT_EQ(policy.OnDeath(kMs), 250 * kMs);
  EXPECT_EQ(policy.OnDeath(kMs), 250 * kMs);
  EXPECT_EQ(policy.OnDeath(kMs), std::nullopt);
}

TEST(RestartPolicyTest, LongLifeStartsTheCountAnew) {
  const RestartSettings settings;
  RestartPolicy policy(settings);
  for (int i = 0; i < 100; ++i) {
    EXPECT_EQ(policy.OnDeath(settings.healthy_ns), 0);
  }
}

// ------------------------------------------------------------------------------------------------ child process

runtime::ProcessEnd WaitFor(runtime::ChildProcess* child) {
  for (;;) {
    if (const auto end = child->Poll()) return *end;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

TEST(ChildProcessTest, ReportsExitCodeAndKeepsTheOutput) {
  const TemporaryFolder folder;
  runtime::ChildProcess child =
      runtime::ChildProcess::Start("/bin/sh", {"-c", "echo out; echo err >&2; exit 3"}, folder.path() / "log");
  const runtime::ProcessEnd end = WaitFor(&child);
  EXPECT_EQ(end.exit_code, 3);
  EXPECT_EQ(end.Describe(), "ended with exit code 3 (scene or schema mismatch)");
  EXPECT_FALSE(child.running());
  std::ifstream log(folder.path() / "log");
  std::string first, second;
  EXPECT_TRUE(log >> first >> second);
  EXPECT_EQ(first + second, "outerr");
}

TEST(ChildProcessTest, ReportsTheSignal) {
  const TemporaryFolder folder;
  runtime::ChildProcess child = runtime::ChildProcess::Start("/bin/sleep", {"100"}, folder.path() / "log");
  EXPECT_FALSE(child.Poll().has_value());
  child.Signal(SIGKILL);
  EXPECT_EQ(WaitFor(&child).Describe(), "killed by signal 9 (Killed)");
}

TEST(ChildProcessTest, MissingProgramIsRefusedByName) {
  const TemporaryFolder folder;
  try {
    (void)runtime::ChildProcess::Start(folder.path() / "nothing", {}, folder.path() / "log");
    FAIL() << "a missing program was started";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("nothing: No such file"), std::string::npos) << error.what();
  }
}

TEST(ChildProcessTest, DestructionLeavesNoProcess) {
  const TemporaryFolder folder;
  pid_t pid = 0;
  {
    const runtime::ChildProcess child = runtime::ChildProcess::Start("/bin/sleep", {"100"}, folder.path() / "log");
    pid = child.pid();
    EXPECT_EQ(::kill(pid, 0), 0);
  }
  EXPECT_NE(::kill(pid, 0), 0);
}

}  // namespace
}  // namespace fulcrum::supervisor
