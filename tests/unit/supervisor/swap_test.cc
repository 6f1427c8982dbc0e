// Programs that `fulcrum swap` may start.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "services/base/core/error.h"
#include "services/session/supervisor/node_starter.h"

namespace fulcrum::supervisor {
namespace {

namespace fs = std::filesystem;

class Swap : public ::testing::Test {
 protected:
  void SetUp() override {
    root_ = fs::temp_directory_path() / ("swap_test." + std::to_string(::getpid()));
    settings_.programs = root_ / "own";
    settings_.cart.builds = root_ / "builds";
    Program(root_ / "own" / "thermal_node");
    Program(root_ / "own" / "replayer");
    Program(root_ / "builds" / "candidate" / "bin" / "thermal_node");
    Program(root_ / "elsewhere" / "bin" / "thermal_node");
    std::ofstream(root_ / "session.mcap") << "x";
  }
  void TearDown() override { fs::remove_all(root_); }

  static void Program(const fs::path& file) {
    fs::create_directories(file.parent_path());
    std::ofstream(file) << "#!/bin/true\n";
    fs::permissions(file, fs::perms::owner_all);
  }
  NodeCommand Replaced(const std::vector<std::string>& words) const {
    return starter_.Replacement(starter_.Usual(NodeId::kThermal), words);
  }
  /// Message of the refusal; empty: it was not refused.
  std::string Refusal(const std::vector<std::string>& words) const {
    try {
      (void)Replaced(words);
      return {};
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find("nothing was changed"), std::string::npos) << error.what();
      return error.what();
    }
  }

  fs::path root_;
  UpSettings settings_;
  SessionFolder folder_;
  fs::path recording_;
  NodeStarter starter_{settings_, folder_, recording_};
};

TEST_F(Swap, ANamedBuildGetsTheNodesArguments) {
  const NodeCommand usual = starter_.Usual(NodeId::kThermal);
  const NodeCommand candidate = Replaced({"build", "candidate"});
  EXPECT_EQ(candidate.program, root_ / "builds" / "candidate" / "bin" / "thermal_node");
  EXPECT_EQ(candidate.arguments, usual.arguments);
  EXPECT_EQ(Replaced({"build", "own"}).program, usual.program);
}

TEST_F(Swap, APathIsNoBuild) {
  for (const std::string name : {"../elsewhere", "candidate/../../elsewhere", "/bin", "", ".", ".."}) {
    EXPECT_NE(Refusal({"build", name}).find("no build \"" + name + "\""), std::string::npos)
        << Refusal({"build", name});
  }
  EXPECT_NE(Refusal({"build", "unknown"}).find("Valid: own, candidate"), std::string::npos);
}

TEST_F(Swap, WithoutAFolderOfBuildsThereIsOnlyTheOwn) {
  settings_.cart.builds.clear();
  EXPECT_NE(Refusal({"build", "candidate"}).find("names no folder of builds"), std::string::npos);
  EXPECT_EQ(Refusal({"build", "own"}), "");
}

TEST_F(Swap, ACommandLineNeedsTheSessionsPermission) {
  const std::vector<std::string> words{"command", "/bin/sh", "-c", "touch /tmp/x"};
  EXPECT_NE(Refusal(words).find("--allow-swap-command"), std::string::npos);
  settings_.allow_swap_command = true;
  const NodeCommand command = Replaced(words);
  EXPECT_EQ(command.program, "/bin/sh");
  EXPECT_TRUE(command.foreign);
}

TEST_F(Swap, ARecordingIsPlayedByTheOwnReplayer) {
  const NodeCommand command = Replaced({"recording", (root_ / "session.mcap").string()});
  EXPECT_EQ(command.program, root_ / "own" / "replayer");
  EXPECT_TRUE(command.foreign);
  EXPECT_NE(Refusal({"recording", (root_ / "none.mcap").string()}).find("is no recording"), std::string::npos);
}

TEST_F(Swap, OneOfTwoPhysicsNodesIsNotReplaced) {
  Program(root_ / "own" / "physics_node");
  EXPECT_NO_THROW((void)starter_.Replacement(starter_.Usual(NodeId::kPhysics), {"build", "own"}));
  settings_.standby = true;
  try {
    (void)starter_.Replacement(starter_.InPair("a", false), {"build", "own"});
    ADD_FAILURE() << "the replacement would follow and change nothing";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("--standby"), std::string::npos) << error.what();
  }
  EXPECT_EQ(Refusal({"build", "own"}), "") << "other nodes are replaced as ever";
}

TEST_F(Swap, NothingElseIsTaken) {
  for (const std::vector<std::string>& words : {std::vector<std::string>{},
                                                {"build"},
                                                {"build", "candidate", "-x"},
                                                {"shell", "x"},
                                                {"/bin/sh"},
                                                {"command"}}) {
    EXPECT_NE(Refusal(words), "");
  }
}

}  // namespace
}  // namespace fulcrum::supervisor
