// The score sheet and the trainees' database.
#include <gtest/gtest.h>
#include <sqlite3.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "services/base/core/error.h"
#include "services/session/supervisor/score_sheet.h"
#include "services/session/supervisor/trainee_view.h"
#include "services/session/supervisor/training_log.h"

namespace fulcrum::supervisor {
namespace {

namespace fs = std::filesystem;

ScoreSheet Sheet() {
  ScoreSheet sheet;
  sheet.figures.session.fill(std::nan(""));
  for (auto& values : sheet.figures.tool) values.fill(std::nan(""));
  const auto set = [&](Measure measure, double value) {
    sheet.figures.session[static_cast<std::size_t>(measure)] = value;
  };
  set(Measure::kLineDone, 95);
  set(Measure::kTime, 30);
  set(Measure::kPeakForce, 17.1);
  sheet.figures.tool[1][static_cast<std::size_t>(Measure::kPeakForce)] = 17.1;
  sheet.score = assessment::Evaluate(UsualAssessment(), sheet.figures);
  return sheet;
}

TEST(ScoreSheetTest, SaysValueThresholdAndPointsEverywhere) {
  const ScoreSheet sheet = Sheet();
  EXPECT_EQ(sheet.score.of, 35);
  EXPECT_NEAR(sheet.score.points, 27.5, 1e-4);
  const std::string table = SheetTable(sheet);
  EXPECT_NE(table.find("peak force [N]"), std::string::npos) << table;
  EXPECT_NE(table.find("≤ 11.40 ✗"), std::string::npos) << table;
  EXPECT_NE(table.find("score 79 % (27.5 of 35 points)"), std::string::npos) << table;
  const std::string json = SheetJson(sheet, {"line", "s-1", "Ann \"A\"", ""});
  for (const char* part :
       {"\"score_pct\": 78.5", "\"peak_force_N\": 17.1", "\"peak_force_N.passed\": false",
        "\"peak_force_N.threshold\": 11.3999", "\"tool1.peak_force_N\": 17.1", "\"line_done_pct.passed\": true",
        "\"time_s.points\": 5", "\"trainee\": \"Ann \\\"A\\\"\""}) {
    EXPECT_NE(json.find(part), std::string::npos) << part << " in " << json;
  }
  EXPECT_EQ(json.find("nan"), std::string::npos);
  const std::string html = SheetHtml(sheet, "Ann <b>");
  EXPECT_NE(html.find("Ann &lt;b&gt;"), std::string::npos);
  EXPECT_NE(html.find("<tr class='bad'><td class='text'>peak force [N]</td>"), std::string::npos) << html;
}

std::size_t Count(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (std::size_t at = 0; (at = text.find(part, at)) != std::string::npos; at += part.size()) ++count;
  return count;
}

TEST(ScoreSheetTest, EachValueOfTheReportHasItsHead) {
  ScoreSheet sheet = Sheet();
  for (const std::size_t tools : {std::size_t{1}, std::size_t{2}, std::size_t{kMaxTools}}) {
    for (auto& values : sheet.figures.tool) values.fill(std::nan(""));
    // The last ones of the scene's places: a scene may leave places free.
    for (std::size_t i = kMaxTools - tools; i < kMaxTools; ++i) sheet.figures.tool[i].front() = 1;
    const std::string html = SheetHtml(sheet, "");
    const std::size_t rows = Count(html, "<tr") - 1;  // One of them is the head.
    EXPECT_EQ(rows, sheet.score.items.size());
    EXPECT_EQ(Count(html, "<th>") + Count(html, "<th "), 5 + tools) << html;
    EXPECT_EQ(Count(html, "<td"), rows * (5 + tools)) << html;
    // People count from 1, as the time line does.
    EXPECT_NE(html.find("<th>tool " + std::to_string(kMaxTools - tools + 1) + "</th>"), std::string::npos) << html;
  }
}

class TrainingLogTest : public testing::Test {
 protected:
  TrainingLogTest() { fs::create_directory(folder_); }
  ~TrainingLogTest() override { fs::remove_all(folder_); }

  static TrainingRow Row(const std::string& trainee, int day, double score) {
    return {trainee,
            "s-" + std::to_string(day),
            day % 2 == 0 ? "line" : "traction",
            "2024-05-0" + std::to_string(day) + " 10:00:00 UTC",
            20.5,
            true,
            score,
            {{"time_s", 20.0 + day}, {"peak_force_N", 1.25}}};
  }
  template <class Do>
  static std::string Refusal(const Do& act) {
    try {
      act();
      return "";
    } catch (const InputError& error) {
      return error.what();
    }
  }
  static std::string Bytes(const fs::path& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  void Sql(const fs::path& file, const std::string& sql) const {
    sqlite3* database = nullptr;
    ASSERT_EQ(sqlite3_open(file.c_str(), &database), SQLITE_OK);
    EXPECT_EQ(sqlite3_exec(database, sql.c_str(), nullptr, nullptr, nullptr), SQLITE_OK);
    sqlite3_close(database);
  }

  const fs::path folder_ = fs::path(testing::TempDir()) / ("training_" + std::to_string(getpid()));
  const fs::path file_ = folder_ / "deep" / "trainees.sqlite";
};

TEST_F(TrainingLogTest, KeepsWhatIsAddedInItsOrder) {
  {
    TrainingLog log(file_);
    log.Add(Row("Ann", 3, 70));
    log.Add(Row("Ann", 2, 60));
    log.Add(Row("O'Neil; DROP TABLE sessions", 4, 10));
  }
  TrainingLog again(file_);
  again.Add(Row("Ann", 5, 90));
  const TrainingLog log(file_, TrainingLog::Access::kRead);
  EXPECT_EQ(log.Trainees(), (std::map<std::string, int>{{"Ann", 3}, {"O'Neil; DROP TABLE sessions", 1}}));
  const auto rows = log.SessionsOf("Ann", "");
  ASSERT_EQ(rows.size(), 3u);
  // The clock may have been wrong at the start of a session.
  EXPECT_EQ(rows[0].session, "s-3");
  EXPECT_EQ(rows[2].score_pct, 90);
  EXPECT_LT(rows[1].id, rows[2].id);
  EXPECT_TRUE(rows[0].well);
  EXPECT_EQ(rows[0].measures, (std::map<std::string, double>{{"time_s", 23}, {"peak_force_N", 1.25}}));
  EXPECT_EQ(log.SessionsOf("Ann", "line").size(), 1u);
  const auto short_rows = log.SessionsOf("Ann", "", TrainingLog::Rows::kWithoutMeasures);
  ASSERT_EQ(short_rows.size(), 3u);
  EXPECT_EQ(short_rows[2].score_pct, 90);
  EXPECT_TRUE(short_rows[2].measures.empty());
  EXPECT_TRUE(log.SessionsOf("Bob", "").empty());
  const auto found = log.RowsOf("s-5");
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].trainee, "Ann");
  EXPECT_EQ(found[0].scene, "traction");
  EXPECT_EQ(found[0].score_pct, 90);
  EXPECT_TRUE(log.RowsOf("s-9").empty());
}

TEST_F(TrainingLogTest, ATransactionThatACrashHasLeftIsRolledBackByAReader) {
  TrainingLog{file_}.Add(Row("Ann", 1, 50));
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    // More than the cache holds is written to the file before the commit, and the process dies there.
    sqlite3* database = nullptr;
    sqlite3_open(file_.c_str(), &database);
    sqlite3_exec(database,
                 "PRAGMA cache_size = 2; BEGIN IMMEDIATE; UPDATE sessions SET score_pct = 0;"
                 "WITH RECURSIVE n (i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < 3000)"
                 "INSERT INTO measures SELECT 1, 'm' || i || hex(zeroblob(50)), i FROM n",
                 nullptr, nullptr, nullptr);
    kill(getpid(), SIGKILL);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFSIGNALED(status));
  ASSERT_TRUE(fs::exists(file_.string() + "-journal"));
  const TrainingLog log(file_, TrainingLog::Access::kRead);
  const auto rows = log.SessionsOf("Ann", "");
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_EQ(rows[0].score_pct, 50);
  EXPECT_EQ(rows[0].measures.size(), 2u);
}

TEST_F(TrainingLogTest, AReaderExaminesTheSameContentOnce) {
  {
    TrainingLog log(file_);
    for (int i = 0; i < 80; ++i) log.Add(Row("Ann", 1 + i % 9, 50));
  }
  FileContent checked;
  (void)TrainingLog(file_, TrainingLog::Access::kRead, &checked);
  EXPECT_EQ(checked.bytes, static_cast<std::int64_t>(fs::file_size(file_)));
  const FileContent first = checked;
  (void)TrainingLog(file_, TrainingLog::Access::kRead, &checked);
  EXPECT_EQ(checked, first);
  std::string bytes = Bytes(file_);
  for (std::size_t i = 8192; i < 12288; ++i) bytes[i] = 'x';
  std::ofstream(file_, std::ios::binary) << bytes << std::string(4096, 'x');
  EXPECT_NE(Refusal([&] { (void)TrainingLog(file_, TrainingLog::Access::kRead, &checked); }).find("damaged"),
            std::string::npos);
}

TEST_F(TrainingLogTest, WhatIsNotOursIsRefusedAndLeftAsItIs) {
  EXPECT_NE(Refusal([&] { TrainingLog(file_, TrainingLog::Access::kRead); }).find("no such database"),
            std::string::npos);
  fs::create_directories(file_.parent_path());
  std::ofstream(file_) << std::string(5000, 'x');
  const std::string text = Bytes(file_);
  for (const auto access : {TrainingLog::Access::kAdd, TrainingLog::Access::kRead}) {
    const std::string refusal = Refusal([&] { TrainingLog(file_, access); });
    EXPECT_NE(refusal.find(file_.string() + ": is not a database of trainees, or damaged"), std::string::npos)
        << refusal;
    EXPECT_NE(refusal.find("--database"), std::string::npos);
  }
  EXPECT_EQ(Bytes(file_), text);
  const fs::path other = folder_ / "other.sqlite";
  Sql(other, "CREATE TABLE t (x); INSERT INTO t VALUES (1)");
  const std::string bytes = Bytes(other);
  EXPECT_NE(Refusal([&] { TrainingLog{other}; }).find("of another program"), std::string::npos);
  EXPECT_EQ(Bytes(other), bytes);
}

TEST_F(TrainingLogTest, ANewerVersionIsRefusedAndLeftAsItIs) {
  TrainingLog{file_}.Add(Row("Ann", 1, 50));
  Sql(file_, "PRAGMA user_version = 3");
  const std::string bytes = Bytes(file_);
  const std::string refusal = Refusal([&] { TrainingLog{file_}; });
  EXPECT_NE(refusal.find("has version 3 of a newer program; this program reads version 2"), std::string::npos)
      << refusal;
  EXPECT_EQ(Bytes(file_), bytes);
}

TEST_F(TrainingLogTest, ADatabaseOfTheVersionWithoutAccountsIsReadAndThenGetsThem) {
  TrainingLog{file_}.Add(Row("Ann", 1, 50));
  Sql(file_, "DROP TABLE people; PRAGMA user_version = 1");
  const std::string bytes = Bytes(file_);
  EXPECT_FALSE(TrainingLog(file_, TrainingLog::Access::kRead).FindPerson("Ann"));
  EXPECT_FALSE(TrainingLog(file_, TrainingLog::Access::kRead).HasInstructor());
  EXPECT_EQ(Bytes(file_), bytes) << "reading has changed the file";
  TrainingLog log(file_);
  log.AddPerson({"Ann", "hash", true});
  EXPECT_TRUE(log.HasInstructor());
  EXPECT_EQ(log.SessionsOf("Ann", "").size(), 1u);
}

TEST_F(TrainingLogTest, ADamagedPageIsFoundBeforeTheSessionBegins) {
  {
    TrainingLog log(file_);
    for (int i = 0; i < 80; ++i) log.Add(Row("Ann", 1 + i % 9, 50));
  }
  std::string bytes = Bytes(file_);
  ASSERT_GE(bytes.size(), 12288u);
  for (std::size_t i = 8192; i < 12288; ++i) bytes[i] = 'x';
  std::ofstream(file_, std::ios::binary) << bytes;
  const std::string refusal = Refusal([&] { TrainingLog{file_}; });
  EXPECT_NE(refusal.find("damaged"), std::string::npos) << refusal;
  EXPECT_EQ(Bytes(file_), bytes);
}

TEST_F(TrainingLogTest, ARowThatCannotBeWrittenIsSaidSo) {
  TrainingLog log(file_);
  Sql(file_, "CREATE TRIGGER full BEFORE INSERT ON measures BEGIN SELECT RAISE(ABORT, 'no room'); END");
  const std::string refusal = Refusal([&] { log.Add(Row("Ann", 1, 50)); });
  EXPECT_NE(refusal.find("could not be added (no room)"), std::string::npos) << refusal;
  EXPECT_NE(refusal.find("assessment.json"), std::string::npos);
  EXPECT_TRUE(log.SessionsOf("Ann", "").empty()) << "added as a whole or not at all";
}

TEST(TraineeNameTest, IsChecked) {
  EXPECT_NO_THROW(CheckTraineeName("Ann Müller"));
  for (const std::string& bad : {std::string(), std::string("  "), std::string("a\nb"), std::string(64, 'a')}) {
    EXPECT_THROW(CheckTraineeName(bad), InputError);
  }
}

TEST(TraineeViewTest, TableAndPlotsShowEachSession) {
  std::vector<TrainingRow> rows;
  for (int i = 1; i <= 4; ++i) {
    rows.push_back({"Ann",
                    "s",
                    "line",
                    "2024-05-01 10:00:00 UTC",
                    20,
                    i != 2,
                    40.0 + 10 * i,
                    {{"time_s", 30.0 - i}, {"path_length_mm", 200.0 - 20 * i}}});
  }
  const std::string table = TraineeTable(rows);
  EXPECT_NE(table.find("4  2024-05-01 10:00:00 UTC  line"), std::string::npos) << table;
  EXPECT_NE(table.find("the session ended with a failure"), std::string::npos);
  const std::string svg = TraineeSvg("A & B", rows);
  EXPECT_NE(svg.find("A &amp; B, 4 sessions"), std::string::npos);
  std::size_t dots = 0;
  for (std::size_t at = svg.find("<circle"); at != std::string::npos; at = svg.find("<circle", at + 1)) ++dots;
  EXPECT_EQ(dots, 9u) << "score, time and path length of the three sessions that ended well";
  EXPECT_TRUE(TraineeSvg("Ann", {}).empty());
}

}  // namespace
}  // namespace fulcrum::supervisor
