// What becomes of a node that ends by itself. The node is a shell that does.
#include "services/supervisor/node_process.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <optional>
#include <string>

#include "services/core/tick.h"

namespace fulcrum::supervisor {
namespace {

namespace fs = std::filesystem;

class NodeProcessTest : public ::testing::Test {
 protected:
  NodeProcessTest() : folder_(fs::temp_directory_path() / ("node_process_test." + std::to_string(::getpid()))) {
    fs::create_directories(folder_);
  }
  ~NodeProcessTest() override { fs::remove_all(folder_); }

  NodeProcess ThatEndsWith(int exit_code, bool of_pair) const {
    NodeCommand command;
    command.id = NodeId::kPhysics;
    command.program = "/bin/sh";
    command.arguments = {"-c", "exit " + std::to_string(exit_code)};
    command.log = folder_ / "log";
    command.of_pair = of_pair;
    return NodeProcess(command);
  }
  /// Deaths until it is given up, at most ten.
  static int Deaths(NodeProcess* node) {
    std::int64_t now_ns = kSecond_ns;
    node->Start(now_ns);
    for (int deaths = 1; deaths <= 10; ++deaths) {
      std::optional<SupervisedNode::Death> death;
      for (int i = 0; i < 10'000 && !(death = node->Update(now_ns)); ++i) ::usleep(1000);
      if (!death || death->for_good) return deaths;
      now_ns += 3 * kSecond_ns;  // Past every delay, and still a short life.
      (void)node->Update(now_ns);
    }
    return 10;
  }

  const fs::path folder_;
};

TEST_F(NodeProcessTest, OneThatFailsAgainAndAgainIsGivenUp) {
  NodeProcess node = ThatEndsWith(1, true);
  EXPECT_EQ(Deaths(&node), RestartSettings{}.most_quick_deaths);
  EXPECT_TRUE(node.failed());
}

TEST_F(NodeProcessTest, OneOfAPairMayBeRelievedAnyNumberOfTimes) {
  NodeProcess node = ThatEndsWith(0, true);
  EXPECT_EQ(Deaths(&node), 10);
  EXPECT_FALSE(node.failed());
}

TEST_F(NodeProcessTest, WithoutAPairNobodyHasRelievedIt) {
  NodeProcess node = ThatEndsWith(0, false);
  EXPECT_EQ(Deaths(&node), RestartSettings{}.most_quick_deaths);
}

}  // namespace
}  // namespace fulcrum::supervisor
