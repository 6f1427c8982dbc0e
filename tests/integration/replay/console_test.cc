// The replayer's console as a program: its commands through a pipe.
#include <gtest/gtest.h>
#include <unistd.h>

#include <memory>
#include <string>
#include <vector>

#include "tests/integration/replay/short_session.h"
#include "tests/support/program.h"

namespace fulcrum::replay {
namespace {

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
    for (int i = 0; i < 600; ++i) {
      if (const auto code = program.Poll()) return {program.Said(), *code};
      ::usleep(50'000);
    }
    return {program.Said(), -1};
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

}  // namespace
}  // namespace fulcrum::replay
