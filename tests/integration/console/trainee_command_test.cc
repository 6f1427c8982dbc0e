// `fulcrum trainee NAME --delete` as used by an operator.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "services/session/supervisor/session_folder.h"
#include "services/session/supervisor/training_log.h"
#include "tests/support/cart.h"
#include "tests/support/program.h"

namespace fulcrum::supervisor {
namespace {

namespace fs = std::filesystem;
using fulcrum::testing::Program;
using fulcrum::testing::ReadFile;

class TraineeCommandTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string name = (fs::temp_directory_path() / "fulcrum_trainee_XXXXXX").string();
    ASSERT_NE(::mkdtemp(name.data()), nullptr);
    folder_ = name;
    TrainingLog log(database());
    log.Add({"Ann", "s-1", "line", "2024-05-01 10:00:00 UTC", 20, true, 50, {}});
    log.Add({"Ann", "s-2", "line", "2024-05-02 10:00:00 UTC", 20, true, 60, {}});
    log.Add({"Bob", "s-3", "line", "2024-05-03 10:00:00 UTC", 20, true, 70, {}});
    fs::create_directories(out() / "s-1");
    WriteFile(out() / "s-1" / "assessment.json",
              "{\n  \"session\": \"s-1\",\n  \"trainee\": \"Ann\",\n  \"of\": 1\n}\n");
  }
  void TearDown() override { fs::remove_all(folder_); }

  [[nodiscard]] fs::path database() const { return folder_ / "trainees.sqlite"; }
  [[nodiscard]] fs::path out() const { return folder_ / "out"; }
  /// Exit code of `fulcrum trainee WORDS --database FILE`; its output is in said_.
  int Trainee(std::vector<std::string> words) {
    words.insert(words.begin(), "trainee");
    words.insert(words.end(), {"--database", database().string()});
    Program program("fulcrum", words);
    const int code = program.End(0);
    said_ = program.Said();
    return code;
  }

  fs::path folder_;
  std::string said_;
};

TEST_F(TraineeCommandTest, DeletesRowsAndNameAfterAConfirmation) {
  EXPECT_EQ(Trainee({"Ann", "--delete", "--out", out().string()}), 2) << "no confirmation was given";
  EXPECT_NE(said_.find("--yes"), std::string::npos) << said_;
  EXPECT_EQ(TrainingLog(database()).Trainees().at("Ann"), 2);
  EXPECT_EQ(Trainee({"Ann", "--delete", "--yes", "--out", out().string()}), 0) << said_;
  EXPECT_NE(said_.find("the name is removed from " + (out() / "s-1" / "assessment.json").string()), std::string::npos)
      << said_;
  EXPECT_NE(said_.find("1 of these sessions have no folder in "), std::string::npos) << said_;
  EXPECT_EQ(ReadFile(out() / "s-1" / "assessment.json"), "{\n  \"session\": \"s-1\",\n  \"of\": 1\n}\n");
  EXPECT_EQ(ReadFile(database()).find("Ann"), std::string::npos);
  EXPECT_EQ(Trainee({}), 0);
  EXPECT_EQ(said_, "Bob: 1 session\n");
  EXPECT_EQ(Trainee({"Ann", "--delete", "--yes", "--out", out().string()}), 2) << "nothing is left of Ann";
}

TEST_F(TraineeCommandTest, DeletesAnAccountWithoutSessions) {
  // The only instructor has forgotten the PIN, and no other can be made while the account is there.
  TrainingLog(database()).AddPerson({"Ines", "hash", true});
  EXPECT_EQ(Trainee({"Ines", "--delete", "--yes", "--out", out().string()}), 0) << said_;
  EXPECT_NE(said_.find("the account of \"Ines\" is deleted"), std::string::npos) << said_;
  EXPECT_FALSE(TrainingLog(database()).FindPerson("Ines"));
  EXPECT_FALSE(TrainingLog(database()).HasInstructor());
  EXPECT_EQ(Trainee({"Ines", "--delete", "--yes", "--out", out().string()}), 2);
}

TEST_F(TraineeCommandTest, BadUseChangesNothing) {
  const std::string before = ReadFile(database());
  EXPECT_EQ(Trainee({"--delete", "--yes"}), 2);
  EXPECT_EQ(Trainee({"Ann", "--yes"}), 2);
  EXPECT_EQ(Trainee({"Ann", "--out", out().string()}), 2);
  EXPECT_EQ(Trainee({"Ann", "--delete", "--yes", "--scene", "line"}), 2);
  EXPECT_EQ(ReadFile(database()), before);
}

}  // namespace
}  // namespace fulcrum::supervisor
