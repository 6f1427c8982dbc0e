// `fulcrum test-node` as used by QA: exit codes, output, the JUnit file.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tests/integration/replay/short_session.h"
#include "tests/support/cart.h"
#include "tests/support/program.h"

namespace fulcrum::replay {
namespace {

namespace fs = std::filesystem;
constexpr double kVerdictPatience_s = 60;

class TestNodeTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() { session_ = std::make_unique<testing::ShortSession>("test_node_test"); }
  static void TearDownTestSuite() { session_.reset(); }

  struct Answer {
    int code = -1;
    std::string said;
  };
  static Answer Run(const std::vector<std::string>& words) {
    std::vector<std::string> all{"test-node"};
    all.insert(all.end(), words.begin(), words.end());
    fulcrum::testing::Program program("fulcrum", all);
    std::optional<int> code;
    fulcrum::testing::WaitFor(kVerdictPatience_s, [&] { return (code = program.Poll()).has_value(); });
    return {code.value_or(-1), program.Said()};
  }
  static Answer Test(const std::string& node, const std::vector<std::string>& more = {}) {
    std::vector<std::string> words{node, "--inputs", session_->recording()};
    words.insert(words.end(), more.begin(), more.end());
    return Run(words);
  }
  static fs::path JUnit() { return session_->folder() / "result.xml"; }

  static std::unique_ptr<testing::ShortSession> session_;
};
std::unique_ptr<testing::ShortSession> TestNodeTest::session_;

TEST_F(TestNodeTest, EachNodeComesToItsRecordedStates) {
  for (const char* node : {"physics", "thermal_node", "haptics"}) {
    const Answer answer = Test(node);
    EXPECT_EQ(answer.code, 0) << answer.said;
    EXPECT_NE(answer.said.find("ok     hash_mismatches == 0"), std::string::npos) << answer.said;
  }
  ASSERT_GT(session_->cut_length_m(), 1e-3f);
}

TEST_F(TestNodeTest, TheHashThatOneRunPrintsIsTheOneThatTheNextExpects) {
  const Answer first = Test("thermal");
  const std::size_t at = first.said.find("state hash");
  ASSERT_NE(at, std::string::npos) << first.said;
  std::string hash = first.said.substr(first.said.find('\n', at) - 16, 16);
  const Answer same = Test("thermal", {"--expect", hash});
  EXPECT_EQ(same.code, 0) << same.said;
  hash[0] = hash[0] == '0' ? '1' : '0';
  const Answer other = Test("thermal", {"--expect", hash});
  EXPECT_EQ(other.code, 1) << other.said;
  EXPECT_NE(other.said.find("FAILED state_hash == " + hash), std::string::npos) << other.said;
}

TEST_F(TestNodeTest, AssertionsAreJudgedOverTheFiguresOfHealth) {
  const double cut_mm = 1e3 * static_cast<double>(session_->cut_length_m());
  const std::string below = "cut_length_mm > " + std::to_string(0.99 * cut_mm);
  const std::string above = "cut_length_mm > " + std::to_string(1.01 * cut_mm);
  const Answer good = Test("thermal", {"--assert", below, "--assert", "hash_mismatches == 0", "--junit", JUnit()});
  EXPECT_EQ(good.code, 0) << good.said;
  EXPECT_NE(fulcrum::testing::ReadFile(JUnit()).find("tests=\"3\" failures=\"0\" errors=\"0\""), std::string::npos)
      << fulcrum::testing::ReadFile(JUnit());
  const Answer bad = Test("thermal", {"--assert", below, "--assert", above, "--junit", JUnit()});
  EXPECT_EQ(bad.code, 1) << bad.said;
  EXPECT_NE(fulcrum::testing::ReadFile(JUnit()).find("tests=\"3\" failures=\"1\" errors=\"0\""), std::string::npos)
      << fulcrum::testing::ReadFile(JUnit());
  const Answer felt = Test("haptics", {"--assert", "peak_hand_force_N <= 3.3", "--assert", "peak_hand_force_N > 0"});
  EXPECT_EQ(felt.code, 0) << felt.said;
}

TEST_F(TestNodeTest, BadUseAndBadFilesAreToldApart) {
  struct Case {
    std::vector<std::string> words;
    const char* expected;
  };
  const std::string log = session_->recording();
  const Case cases[] = {
      {{}, "--inputs LOG is missing"},
      {{"physics"}, "--inputs LOG is missing"},
      {{"kitchen", "--inputs", log}, "--test kitchen: no such node here; valid: physics_node"},
      {{"physics", "--inputs", "/nonexistent.mcap"}, "/nonexistent.mcap: no such file"},
      {{"physics", "--inputs", log, "--assert", "max_displacement_mm"}, "a comparison is missing"},
      {{"physics", "--inputs", log, "--assert", "speed > 3"}, "physics_node has no figure \"speed\""},
      {{"physics", "--inputs", log, "--expect", "abc"}, "16 hexadecimal digits"},
      {{"render", "--inputs", log, "--expect", "0123456789abcdef"}, "render_node has no state hash"},
      {{"physics", "--inputs", log, "--asert", "x > 1"}, "asert"},
      {{"physics", "--inputs", log, "--junit", "/nonexistent/x.xml"}, "/nonexistent/x.xml: cannot be written"},
  };
  for (const Case& c : cases) {
    const Answer answer = Run(c.words);
    EXPECT_EQ(answer.code, 2) << c.expected << '\n' << answer.said;
    EXPECT_NE(answer.said.find(c.expected), std::string::npos) << answer.said;
  }
}

TEST_F(TestNodeTest, ALogOfAnotherSceneIsAMismatchAndStandsInTheFile) {
  scene::SceneData data = scene::BuildProcedural(scene::Small());
  scene::WriteSceneFile(data, "", session_->folder() / "other.fulcrum");
  const Answer answer = Test("physics", {"--scene", session_->folder() / "other.fulcrum", "--junit", JUnit()});
  EXPECT_EQ(answer.code, 3) << answer.said;
  EXPECT_NE(answer.said.find("was recorded with another scene"), std::string::npos) << answer.said;
  EXPECT_NE(fulcrum::testing::ReadFile(JUnit()).find("errors=\"1\""), std::string::npos);
}

// A CI system that reads the file must not find the result of an earlier test in it.
TEST_F(TestNodeTest, WhatPreventsATestStandsInItsFile) {
  const fs::path lonely = session_->folder() / "lonely" / "recording.mcap";
  fs::create_directories(lonely.parent_path());
  fs::copy_file(session_->recording(), lonely);
  const std::string log = session_->recording();
  const std::vector<std::pair<std::vector<std::string>, std::string>> cases{
      {{"thermal", "--inputs", "/nonexistent.mcap"}, "/nonexistent.mcap: no such file"},
      {{"thermal", "--inputs", lonely}, "no scene.fulcrum beside"},
      {{"thermal", "--inputs", log, "--assert", "cut_length_mm"}, "a comparison is missing"},
      {{"kitchen", "--inputs", log}, "no such node here"}};
  for (auto [words, expected] : cases) {
    std::ofstream(JUnit()) << "<testsuites tests=\"1\" failures=\"0\" errors=\"0\"/>";
    words.insert(words.end(), {"--junit", JUnit()});
    const Answer answer = Run(words);
    EXPECT_EQ(answer.code, 2) << answer.said;
    const std::string file = fulcrum::testing::ReadFile(JUnit());
    EXPECT_NE(file.find("errors=\"1\""), std::string::npos) << expected << file;
    EXPECT_NE(file.find(expected), std::string::npos) << file;
  }
}

}  // namespace
}  // namespace fulcrum::replay
