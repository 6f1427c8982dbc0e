// Removal of a trainee: nothing remains in the bytes of the database, no name in the session folders, and no file of a
// session that other users can read.
#include <gtest/gtest.h>
#include <sqlite3.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "services/base/core/error.h"
#include "services/base/runtime/private_file.h"
#include "services/session/supervisor/flat_json.h"
#include "services/session/supervisor/score_sheet.h"
#include "services/session/supervisor/session_folder.h"
#include "services/session/supervisor/trainee_traces.h"
#include "services/session/supervisor/training_log.h"

namespace fulcrum::supervisor {
namespace {

namespace fs = std::filesystem;

constexpr const char* kName = "Zsuzsanna Quux-Müller";

std::string Bytes(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}
unsigned ModeOf(const fs::path& file) {
  struct stat status {};
  return ::stat(file.c_str(), &status) == 0 ? status.st_mode & 07777u : 0u;
}

class TraineeDeleteTest : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = (fs::temp_directory_path() / "fulcrum_trainee_XXXXXX").string();
    ASSERT_NE(::mkdtemp(name.data()), nullptr);
    folder_ = name;
  }
  void TearDown() override { fs::remove_all(folder_); }

  static void Fill(TrainingLog* log, const std::string& trainee, int sessions) {
    for (int i = 0; i < sessions; ++i) {
      log->Add({trainee,
                "s-" + trainee + std::to_string(i),
                "line",
                "2024-05-01 10:00:00 UTC",
                20,
                true,
                50,
                {{"time_s", 20.0 + i}, {"peak_force_N", 1.25}}});
    }
  }

  fs::path folder_;
};

TEST_F(TraineeDeleteTest, NothingOfTheRowsRemainsInTheBytes) {
  const fs::path file = folder_ / "trainees.sqlite";
  {
    TrainingLog log(file);
    // Enough rows that pages are split and rows move.
    for (int round = 0; round < 20; ++round) {
      Fill(&log, kName, 10);
      Fill(&log, "Ann", 10);
    }
  }
  ASSERT_NE(Bytes(file).find(kName), std::string::npos);
  TrainingLog log(file, TrainingLog::Access::kDelete);
  EXPECT_EQ(log.Delete(kName), 200);
  EXPECT_EQ(Bytes(file).find("Quux"), std::string::npos);
  for (const auto& entry : fs::directory_iterator(folder_)) {
    EXPECT_EQ(Bytes(entry.path()).find("Quux"), std::string::npos) << entry.path();
  }
  EXPECT_EQ(log.Trainees(), (std::map<std::string, int>{{"Ann", 200}}));
  EXPECT_EQ(log.SessionsOf("Ann", "")[0].measures.size(), 2u);
  sqlite3* database = nullptr;
  ASSERT_EQ(sqlite3_open(file.c_str(), &database), SQLITE_OK);
  sqlite3_stmt* statement = nullptr;
  sqlite3_prepare_v2(database, "SELECT count(*) FROM measures", -1, &statement, nullptr);
  ASSERT_EQ(sqlite3_step(statement), SQLITE_ROW);
  EXPECT_EQ(sqlite3_column_int(statement, 0), 400) << "measures of the deleted sessions are left";
  sqlite3_finalize(statement);
  sqlite3_close(database);
  EXPECT_EQ(log.Delete("Bob"), 0);
}

TEST_F(TraineeDeleteTest, TheDatabaseIsItsOwnersAlone) {
  const fs::path file = folder_ / "deep" / "trainees.sqlite";
  { TrainingLog log(file); }
  EXPECT_EQ(ModeOf(file), 0600u);
  ::chmod(file.c_str(), 0664);
  testing::internal::CaptureStderr();
  { const TrainingLog log(file, TrainingLog::Access::kRead); }
  EXPECT_NE(testing::internal::GetCapturedStderr().find("other users could read it"), std::string::npos);
  EXPECT_EQ(ModeOf(file), 0600u);
  testing::internal::CaptureStderr();
  { TrainingLog log(file); }
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  EXPECT_THROW(TrainingLog(folder_ / "none.sqlite", TrainingLog::Access::kDelete), InputError);
  EXPECT_FALSE(fs::exists(folder_ / "none.sqlite"));
}

TEST_F(TraineeDeleteTest, TheNameGoesFromTheSessionFoldersAndNothingElse) {
  ScoreSheet sheet;
  const auto write = [&](const std::string& session, const std::string& trainee) {
    fs::create_directory(folder_ / session);
    WriteFile(folder_ / session / "assessment.json", SheetJson(sheet, {"line", session, trainee, ""}));
    WriteFile(folder_ / session / "report.html", "<p>Annual</p>" + SheetHtml(sheet, trainee));
  };
  write("1", "Ann");
  write("2", "Ann B");
  write("3", "Ann");
  write("4", "");
  const std::string strange = "<b>\"x\"</b>\\";
  write("5", strange);
  fs::create_directory_symlink("1", folder_ / "latest");

  const std::vector<fs::path> traces = FindTraces(folder_, "Ann");
  EXPECT_EQ(traces, (std::vector<fs::path>{folder_ / "1" / "assessment.json", folder_ / "1" / "report.html",
                                           folder_ / "3" / "assessment.json", folder_ / "3" / "report.html"}));
  const std::string other = Bytes(folder_ / "2" / "assessment.json");
  for (const fs::path& file : traces) RemoveName(file, "Ann");
  EXPECT_TRUE(FindTraces(folder_, "Ann").empty());
  // The rest equals that of a session without a trainee's name.
  EXPECT_EQ(Bytes(folder_ / "1" / "assessment.json"), SheetJson(sheet, {"line", "1", "", ""}));
  EXPECT_EQ(Bytes(folder_ / "1" / "report.html"), Bytes(folder_ / "4" / "report.html"));
  EXPECT_EQ(Bytes(folder_ / "2" / "assessment.json"), other);
  EXPECT_EQ(FindTraces(folder_, "Ann B").size(), 2u);
  ASSERT_EQ(FindTraces(folder_, strange).size(), 2u);
  for (const fs::path& file : FindTraces(folder_, strange)) RemoveName(file, strange);
  EXPECT_EQ(Bytes(folder_ / "5" / "assessment.json").find("x\\\""), std::string::npos);
  EXPECT_TRUE(FindTraces(folder_ / "nowhere", "Ann").empty());
}

TEST_F(TraineeDeleteTest, FilesAndFoldersAreMadeForTheirOwner) {
  const mode_t before = ::umask(0);
  EXPECT_TRUE(runtime::MakePrivateFolder(folder_ / "a" / "session"));
  EXPECT_FALSE(runtime::MakePrivateFolder(folder_ / "a" / "session"));
  WriteFile(folder_ / "a" / "session" / "report.html", "x");
  ::umask(before);
  EXPECT_EQ(ModeOf(folder_ / "a" / "session"), 0700u);
  EXPECT_EQ(ModeOf(folder_ / "a" / "session" / "report.html"), 0600u);
  std::ofstream(folder_ / "plain") << "x";
  EXPECT_THROW(runtime::MakePrivateFolder(folder_ / "plain"), InputError);
}

}  // namespace
}  // namespace fulcrum::supervisor
