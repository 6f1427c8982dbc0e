// Courses, accounts and attempts of the page.
#include "services/session/console/training_desk.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "services/base/core/error.h"
#include "services/base/core/tick.h"

namespace fulcrum::console {
namespace {

namespace fs = std::filesystem;
using supervisor::TrainingLog;
using supervisor::TrainingRow;

class TrainingDeskTest : public testing::Test {
 protected:
  TrainingDeskTest() {
    fs::remove_all(folder_);
    fs::create_directories(folder_ / "courses");
    std::ofstream(folder_ / "courses/1.yaml") << "name: One\nexercises:\n  - {scene: line, pass_pct: 70}\n";
  }
  ~TrainingDeskTest() override { fs::remove_all(folder_); }

  void Store(const std::string& trainee, const std::string& session, double score, bool well = true,
             double seconds = 10, const std::string& scene = "line") {
    TrainingLog(database_).Add(
        {trainee, session, scene, "2026-01-0" + session.substr(8, 1), seconds, well, score, {{"time_s", 9.5}}});
    fs::create_directories(folder_ / "out" / session / "frames");
    std::ofstream(folder_ / "out" / session / "assessment.json") << "{\"score_pct\": 1}";
    std::ofstream(folder_ / "out" / session / "frames/frame_0000100.png") << "x";
    std::ofstream(folder_ / "out" / session / "recording.mcap") << "x";
  }
  [[nodiscard]] std::string Overview() { return desk_.OverviewJson({{"line", "Exercise: x", 9, 0, 2}}); }

  const fs::path folder_ = fs::temp_directory_path() / ("fulcrum_desk_test_" + std::to_string(::getpid()));
  const fs::path database_ = folder_ / "trainees.sqlite";
  TrainingDesk desk_{database_, folder_ / "courses", folder_ / "out"};
};

TEST_F(TrainingDeskTest, ShowsCoursesToAnybodyAndAttemptsToTheirTraineeOnly) {
  EXPECT_NE(Overview().find("\"person\":\"\""), std::string::npos) << Overview();
  EXPECT_NE(Overview().find("\"scene\":\"line\""), std::string::npos);
  Store("Ann", "2026010-1-line", 60);
  Store("Ann", "2026010-2-line", 80);
  Store("Bob", "2026010-3-line", 90);
  EXPECT_EQ(Overview().find("Ann"), std::string::npos) << "without a person no attempt is shown";
  desk_.Create("Ann", "2468", false);
  EXPECT_NE(Overview().find("\"scores\":[60,80],\"cohort\":[]"), std::string::npos) << Overview();
  EXPECT_EQ(Overview().find("Bob"), std::string::npos);
  EXPECT_EQ(desk_.FolderOf("2026010-2-line"), folder_ / "out/2026010-2-line");
  EXPECT_EQ(desk_.FolderOf("2026010-3-line"), fs::path()) << "another trainee's";
  EXPECT_EQ(desk_.FolderOf("../2026010-2-line"), fs::path());
  EXPECT_THROW((void)desk_.AttemptJson("2026010-3-line"), InputError);
  const std::string csv = desk_.Csv();
  EXPECT_EQ(csv,
            "trainee,session,scene,started_utc,seconds,well,score_pct,attempt,pass_pct,passed,cohort_people,"
            "cohort_low_pct,cohort_median_pct,cohort_high_pct,time_s\r\n"
            "\"Ann\",\"2026010-2-line\",\"line\",\"2026-01-02\",10,1,80,2,70,1,,,,,9.5\r\n"
            "\"Ann\",\"2026010-1-line\",\"line\",\"2026-01-01\",10,1,60,1,70,0,,,,,9.5\r\n");
  EXPECT_EQ(csv.find("Bob"), std::string::npos);
  desk_.Leave();
  EXPECT_EQ(desk_.person(), "");
}

TEST_F(TrainingDeskTest, ComparesWithTheNewestDemonstration) {
  Store("Ann", "2026010-1-line", 60);
  Store(kExpert, "2026010-2-line", 100);
  desk_.Create("Ann", "2468", false);
  const std::string attempt = desk_.AttemptJson("2026010-1-line");
  EXPECT_NE(attempt.find("\"expert\":\"2026010-2-line\""), std::string::npos) << attempt;
  EXPECT_NE(attempt.find("\"time_s\":\"time from first to last movement [s]\""), std::string::npos) << attempt;
  EXPECT_THROW(desk_.Create(kExpert, "2468", false), InputError) << "an account has the demonstrations' name";
}

TEST_F(TrainingDeskTest, ADemonstrationThatIsNotCompleteReplacesNone) {
  desk_.Create("Ann", "2468", false);
  // A session's folder gets "-2" when two begin in one second.
  Store("Ann", "2026010-1-line-2", 60);
  Store(kExpert, "2026010-1-line", 100, false, 20);
  EXPECT_NE(desk_.AttemptJson("2026010-1-line-2").find("\"expert\":\"2026010-1-line\""), std::string::npos)
      << "better than none";
  Store(kExpert, "2026010-2-line", 100, true, 20);
  Store(kExpert, "2026010-3-line", 100, true, 19);
  Store(kExpert, "2026010-4-line", 0, true, 2);  // Stopped by hand.
  Store(kExpert, "2026010-5-line", 100, false, 30);
  Store(kExpert, "2026010-6-line", 100, true, 30);
  fs::remove_all(folder_ / "out/2026010-6-line");
  Store(kExpert, "2026010-7-my-line", 100, true, 30, "my-line");
  const std::string attempt = desk_.AttemptJson("2026010-1-line-2");
  EXPECT_NE(attempt.find("\"expert\":\"2026010-3-line\""), std::string::npos) << attempt;
}

TEST_F(TrainingDeskTest, TheNewestIsTheLastThatEndedWhateverTheClockSaid) {
  desk_.Create("Ann", "2468", false);
  Store("Ann", "2026010-9-line", 60);
  Store("Ann", "2026010-1-line", 80);  // The cart was started with a wrong clock.
  Store(kExpert, "2026010-8-line", 100);
  Store(kExpert, "2026010-2-line", 100);
  EXPECT_NE(Overview().find("\"scores\":[60,80]"), std::string::npos) << Overview();
  EXPECT_LT(Overview().find("2026010-1-line"), Overview().find("2026010-9-line")) << Overview();
  EXPECT_NE(desk_.AttemptJson("2026010-1-line").find("\"expert\":\"2026010-2-line\""), std::string::npos);
}

TEST_F(TrainingDeskTest, AnotherPersonThanThePageShowsIsRefused) {
  EXPECT_THROW(desk_.Expect(""), InputError) << "nobody";
  desk_.Create("Ann", "2468", false);
  EXPECT_NO_THROW(desk_.Expect("Ann"));
  const std::uint64_t changes = desk_.person_changes();
  desk_.Create("Bob", "2468", false);  // On another page.
  EXPECT_GT(desk_.person_changes(), changes);
  EXPECT_NO_THROW(desk_.Expect(""));
  try {
    desk_.Expect("Ann");
    ADD_FAILURE() << "Ann's page begins a session for Bob";
  } catch (const InputError& refusal) {
    EXPECT_STREQ(refusal.what(), "Bob is at the cart now");
  }
}

TEST_F(TrainingDeskTest, WhoIsDeletedIsAtTheCartNoMore) {
  Store("Bob", "2026010-1-line", 60);
  desk_.Create("Ines", "2468", true);
  EXPECT_FALSE(desk_.FolderOf("2026010-1-line").empty());
  const std::uint64_t changes = desk_.person_changes();
  (void)TrainingLog(database_, TrainingLog::Access::kDelete).Delete("Ines");
  EXPECT_TRUE(desk_.FolderOf("2026010-1-line").empty());
  EXPECT_EQ(desk_.person(), "");
  EXPECT_GT(desk_.person_changes(), changes);
  EXPECT_EQ(Overview().find("Bob"), std::string::npos) << Overview();
  EXPECT_THROW(desk_.Expect("Ines"), InputError);
  // An account that was made anew is another person's.
  desk_.Create("Ann", "2468", true);
  TrainingLog log(database_, TrainingLog::Access::kDelete);
  (void)log.Delete("Ann");
  log.AddPerson({"Ann", "x", false});
  EXPECT_EQ(desk_.Csv().find("Bob"), std::string::npos);
  EXPECT_EQ(desk_.person(), "");
  fs::remove(database_);
  EXPECT_EQ(Overview().find("Bob"), std::string::npos) << Overview();
}

TEST_F(TrainingDeskTest, TheCohortHasNoNamesAndAtLeastThreeOthers) {
  Store("Ann", "2026010-1-line", 60);
  Store("Bob", "2026010-2-line", 10);
  Store("Cy", "2026010-3-line", 20);
  Store("Dee", "2026010-4-line", 99, false);  // The cart failed.
  desk_.Create("Ines", "2468", true);
  Store("Ines", "2026010-5-line", 100);
  Store(kExpert, "2026010-6-line", 100);
  desk_.Create("Ann", "2468", false);
  EXPECT_NE(Overview().find("\"cohort\":[]"), std::string::npos) << Overview();
  Store("Dee", "2026010-7-line", 40);
  const std::string cohort = R"("cohort":[{"people":3,"low":15,"median":20,"high":30}])";
  EXPECT_NE(Overview().find(cohort), std::string::npos) << Overview();
  EXPECT_NE(Overview().find("\"group\":[]"), std::string::npos) << "the table is the instructor's";
  for (const char* name : {"Bob", "Cy", "Dee", "Ines"}) {
    EXPECT_EQ(Overview().find(name), std::string::npos) << Overview();
    EXPECT_EQ(desk_.Csv().find(name), std::string::npos) << desk_.Csv();
  }
  EXPECT_NE(desk_.Csv().find(",60,1,70,0,3,15,20,30,9.5\r\n"), std::string::npos) << desk_.Csv();
}

TEST_F(TrainingDeskTest, TheInstructorsTableHasEachTraineesBest) {
  Store("Ann", "2026010-1-line", 60);
  Store("Ann", "2026010-2-line", 71);
  Store("Bob", "2026010-3-line", 10);
  Store("Bob", "2026010-4-line", 100, false);
  desk_.Create("Ines", "2468", true);
  Store("Ines", "2026010-5-line", 100);
  const std::string table =
      R"("group":[{"trainee":"Ann","results":[{"scene":"line","attempts":2,"best":71,"passed":true}]},)"
      R"({"trainee":"Bob","results":[{"scene":"line","attempts":1,"best":10,"passed":false}]}])";
  EXPECT_NE(Overview().find(table), std::string::npos) << Overview();
  EXPECT_NE(desk_.Csv().find("\"Bob\",\"2026010-4-line\",\"line\",\"2026-01-04\",10,0,100,,70,,,,,,9.5\r\n"),
            std::string::npos)
      << "a session of a failed cart is no attempt: " << desk_.Csv();
}

TEST_F(TrainingDeskTest, ARoundedScoreDoesNotPass) {
  desk_.Create("Ann", "2468", false);
  Store("Ann", "2026010-1-line", 69.97);
  EXPECT_NE(Overview().find(R"("pass":70,"passed":false,"scores":[69.97])"), std::string::npos) << Overview();
  Store("Ann", "2026010-2-line", 70);
  EXPECT_NE(Overview().find("\"passed\":true"), std::string::npos) << Overview();
}

TEST_F(TrainingDeskTest, RefusesWrongPinsAndWaitsAfterThem) {
  desk_.Create("Ann", "2468", false);
  desk_.Leave();
  EXPECT_THROW(desk_.Enter("Ann", "2469", 0), InputError);
  EXPECT_EQ(desk_.person(), "");
  EXPECT_THROW(desk_.Enter("Ann", "2468", kSecond_ns), InputError) << "too soon";
  desk_.Enter("Ann", "2468", 3 * kSecond_ns);
  EXPECT_EQ(desk_.person(), "Ann");
  EXPECT_THROW(desk_.Create("Ann", "1111", false), InputError) << "the name has an account";
  EXPECT_THROW(desk_.Create("Cy", "12a4", false), InputError);
  EXPECT_THROW(desk_.Create("Cy", "123", false), InputError);
  std::ifstream file(database_, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  EXPECT_EQ(bytes.find("2468"), std::string::npos) << "the PIN is in the file";
}

TEST_F(TrainingDeskTest, InstructorSeesAllAndOnlyAnInstructorMakesAnother) {
  Store("Ann", "2026010-1-line", 60);
  desk_.Create("Ines", "2468", true);
  EXPECT_NE(Overview().find("\"trainee\":\"Ann\""), std::string::npos) << Overview();
  EXPECT_FALSE(desk_.FolderOf("2026010-1-line").empty());
  desk_.Create("Ivo", "1357", true);
  desk_.Leave();
  desk_.Create("Bob", "1357", false);
  EXPECT_THROW(desk_.Create("Eve", "1357", true), InputError);
}

TEST_F(TrainingDeskTest, AnAccountGoesWithItsSessions) {
  Store("Ann", "2026010-1-line", 60);
  EXPECT_FALSE(TrainingLog(database_, TrainingLog::Access::kRead).FindPerson("Ann"));
  TrainingLog log(database_);
  log.AddPerson({"Ann", "x", false});
  EXPECT_TRUE(log.FindPerson("Ann"));
  EXPECT_EQ(TrainingLog(database_, TrainingLog::Access::kDelete).Delete("Ann"), 1);
  EXPECT_FALSE(TrainingLog(database_).FindPerson("Ann")) << "the account is deleted with the sessions";
}

TEST_F(TrainingDeskTest, CsvKeepsFormulasAway) {
  Store("=cmd()", "2026010-1-line", 60);
  desk_.Create("=cmd()", "2468", false);
  EXPECT_NE(desk_.Csv().find("\"'=cmd()\""), std::string::npos) << desk_.Csv();
}

}  // namespace
}  // namespace fulcrum::console
