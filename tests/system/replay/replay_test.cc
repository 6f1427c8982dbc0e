// The replay described in the README: record, kill, replay, equal states.
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <filesystem>
#include <string>
#include <thread>

#include "tests/support/cart.h"
#include "tests/support/replay_run.h"

namespace fulcrum {
namespace {

/// The process of the cart that was started with these two arguments in sequence; 0: none.
pid_t ProcessWith(const testing::Cart& cart, const std::string& option, const std::string& value) {
  const std::string session = std::filesystem::canonical(cart.session()).filename();
  const std::string wanted = option + '\0' + value + '\0';
  for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
    const std::string arguments = testing::ReadFile(entry.path() / "cmdline");
    if (arguments.find(session) != std::string::npos && arguments.find(wanted) != std::string::npos) {
      return std::stoi(entry.path().filename());
    }
  }
  return 0;
}

TEST(ReplayOfTheCart, ComesToTheSameStatesThroughKillsAndATakeover) {
  testing::Cart cart("small", 57, {"--record", "--standby"});
  // While the cart pulls and cuts.
  ASSERT_TRUE(testing::WaitFor(60, [&] { return cart.PictureTime() >= 2.4; })) << cart.Said();
  for (const char* node : {"haptics_node", "thermal_node", "physics_node"}) {
    const auto nodes = cart.nodes();
    ASSERT_TRUE(nodes.contains(node)) << cart.Said();
    ::kill(nodes.at(node), SIGKILL);
    std::this_thread::sleep_for(std::chrono::milliseconds(500));
  }
  EXPECT_EQ(cart.FaultAtEnd(60), "");
  const auto run = testing::Replay(cart.session() / "recording.mcap", {"--into", "physics", "thermal", "haptics"}, 60);
  // A sample is sent to each reader separately. A process that is killed between two of these sends may have reached a
  // node but not the recorder; no recording can contain such a sample. Any other missing sample is a failure.
  if (run.said.find("the last of its process") != std::string::npos) GTEST_SKIP() << run.said;
  EXPECT_EQ(run.exit_code, 0) << run.said;
  EXPECT_GT(run.figures.at("physics_node.compared"), 200) << run.said;
  EXPECT_GT(run.figures.at("thermal_node.compared"), 200) << run.said;
  // Each death is in the recording: the standby took over physics, the other nodes were restarted. If the machine
  // delays a leader beyond its deadline, physics changes once more.
  EXPECT_GE(run.figures.at("physics_node.starts"), 2) << run.said;
  EXPECT_EQ(run.figures.at("thermal_node.starts"), 2) << run.said;
  EXPECT_EQ(run.figures.at("haptics_node.starts"), 2) << run.said;
}

TEST(ReplayOfTheCart, ALeaderThatWasHeldUpFollowsAndTakesOverAgain) {
  testing::Cart cart("small", 57, {"--record", "--standby"});
  ASSERT_TRUE(testing::WaitFor(60, [&] { return cart.PictureTime() >= 1; })) << cart.Said();
  const pid_t first = ProcessWith(cart, "--pair", "a"), second = ProcessWith(cart, "--pair", "b");
  ASSERT_GT(first, 0) << cart.Said();
  ASSERT_GT(second, 0) << cart.Said();
  ::kill(first, SIGSTOP);
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  ::kill(first, SIGCONT);
  std::this_thread::sleep_for(std::chrono::milliseconds(1000));
  EXPECT_EQ(ProcessWith(cart, "--pair", "a"), first) << "it continues as the follower";
  ::kill(second, SIGKILL);
  EXPECT_EQ(cart.FaultAtEnd(60), "");
  const auto run = testing::Replay(cart.session() / "recording.mcap", {"--into", "physics"}, 60);
  if (run.said.find("the last of its process") != std::string::npos) GTEST_SKIP() << run.said;
  EXPECT_EQ(run.exit_code, 0) << run.said;
  EXPECT_GE(run.figures.at("physics_node.starts"), 3) << run.said;
}

}  // namespace
}  // namespace fulcrum
