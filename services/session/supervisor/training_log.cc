#include "services/session/supervisor/training_log.h"

#include <sqlite3.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdio>
#include <fstream>

#include "services/base/core/error.h"
#include "services/base/runtime/private_file.h"

namespace fulcrum::supervisor {
namespace {

constexpr int kApplication = 0x46554c43;  // "FULC": SQLite's application_id in the file's header.
constexpr int kVersion = 2;               // 1: without accounts.
constexpr int kBusy_ms = 5000;            // Longest wait while another session of the same user writes its row.
constexpr std::size_t kLongestName = 63;

constexpr const char* kTables = R"sql(
CREATE TABLE sessions (
  id INTEGER PRIMARY KEY, trainee TEXT NOT NULL, session TEXT NOT NULL, scene TEXT NOT NULL, started_utc TEXT NOT NULL,
  seconds REAL NOT NULL, well INTEGER NOT NULL, score_pct REAL NOT NULL);
CREATE INDEX sessions_of_trainee ON sessions (trainee, scene);
CREATE TABLE measures (
  session_id INTEGER NOT NULL REFERENCES sessions (id) ON DELETE CASCADE, measure TEXT NOT NULL, value REAL NOT NULL,
  PRIMARY KEY (session_id, measure)) WITHOUT ROWID;
)sql";
constexpr const char* kPeople = R"sql(
CREATE TABLE people (name TEXT PRIMARY KEY, pin_hash TEXT NOT NULL, instructor INTEGER NOT NULL) WITHOUT ROWID;
)sql";

FileContent ContentOf(const std::filesystem::path& file) {
  struct stat status {};
  if (::stat(file.c_str(), &status) != 0) return {};
  return {status.st_dev, status.st_ino, status.st_size,
          std::int64_t{1'000'000'000} * status.st_mtim.tv_sec + status.st_mtim.tv_nsec};
}

/// The file's header names this program, as bytes 68 to 71 of SQLite's format.
bool IsOurs(const std::filesystem::path& file) {
  std::array<unsigned char, 4> id{};
  std::ifstream stream(file, std::ios::binary);
  stream.seekg(68).read(reinterpret_cast<char*>(id.data()), id.size());
  int application = 0;
  for (const unsigned char byte : id) application = application << 8 | byte;
  return stream && application == kApplication;
}

/// One prepared statement. As in SQLite, indices of parameters begin at 1, those of columns at 0.
class Statement {
 public:
  Statement(sqlite3* database, const char* sql) {
    good_ = sqlite3_prepare_v2(database, sql, -1, &statement_, nullptr) == SQLITE_OK;
  }
  ~Statement() { sqlite3_finalize(statement_); }
  Statement(const Statement&) = delete;
  Statement& operator=(const Statement&) = delete;

  void Bind(int i, const std::string& text) {
    good_ = good_ &&
            sqlite3_bind_text(statement_, i, text.data(), static_cast<int>(text.size()), SQLITE_TRANSIENT) == SQLITE_OK;
  }
  void Bind(int i, double value) { good_ = good_ && sqlite3_bind_double(statement_, i, value) == SQLITE_OK; }
  void Bind(int i, sqlite3_int64 value) { good_ = good_ && sqlite3_bind_int64(statement_, i, value) == SQLITE_OK; }
  /// Steps to the next row; false when there is none. good() then distinguishes the end from a failure.
  bool Next() {
    const int code = good_ ? sqlite3_step(statement_) : SQLITE_ERROR;
    good_ = code == SQLITE_ROW || code == SQLITE_DONE;
    return code == SQLITE_ROW;
  }
  [[nodiscard]] bool good() const { return good_; }
  [[nodiscard]] std::string Text(int i) const {
    const auto* text = reinterpret_cast<const char*>(sqlite3_column_text(statement_, i));
    return text == nullptr ? std::string()
                           : std::string(text, static_cast<std::size_t>(sqlite3_column_bytes(statement_, i)));
  }
  [[nodiscard]] double Number(int i) const { return sqlite3_column_double(statement_, i); }
  [[nodiscard]] sqlite3_int64 Integer(int i) const { return sqlite3_column_int64(statement_, i); }
  void Again() {
    sqlite3_reset(statement_);
    sqlite3_clear_bindings(statement_);
  }

 private:
  sqlite3_stmt* statement_ = nullptr;
  bool good_ = false;
};

}  // namespace

void CheckTraineeName(const std::string& name) {
  const bool blank = std::all_of(name.begin(), name.end(), [](char c) { return c == ' '; });
  const bool control =
      std::any_of(name.begin(), name.end(), [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; });
  if (blank || control || name.size() > kLongestName) {
    throw InputError("trainee \"" + name + "\": must have 1 to 63 bytes, not all blank, no control characters");
  }
}

std::optional<TrainingLog> OpenTrainingLog(const std::string& trainee, const std::filesystem::path& file,
                                           const SceneView& scene) {
  if (trainee.empty()) return std::nullopt;
  if (scene.assessment.on == 0) {
    throw InputError(std::string("--trainee: scene \"") + scene.name +
                     "\" has no section `assessment`, so there is no score to store; choose a scene that has one");
  }
  return std::optional<TrainingLog>(std::in_place, file);
}

TrainingRow TrainingRowOf(const SessionOutcome& outcome) {
  TrainingRow row{outcome.trainee,
                  outcome.session_id,
                  outcome.scene_name,
                  outcome.started_utc,
                  outcome.duration_s,
                  outcome.exit_code == ExitCode::kDone,
                  outcome.sheet->score.percent(),
                  {},
                  0};
  for (const assessment::ScoreItem& item : outcome.sheet->score.items) {
    row.measures.emplace(InfoOf(item.measure).key, item.value);
  }
  return row;
}

void TrainingLog::Closer::operator()(sqlite3* database) const { sqlite3_close(database); }

TrainingLog::~TrainingLog() = default;
TrainingLog::TrainingLog(TrainingLog&&) noexcept = default;
TrainingLog& TrainingLog::operator=(TrainingLog&&) noexcept = default;

TrainingLog::TrainingLog(const std::filesystem::path& file, Access access, FileContent* checked) : file_(file) {
  std::error_code error;
  const bool exists = std::filesystem::exists(file, error);
  if (access != Access::kAdd && !exists) {
    throw InputError(file.string() + ": no such database; make it with fulcrum up SCENE --trainee NAME");
  }
  // An empty file is an empty database; SQLite would make one that other users can read.
  if (!exists) runtime::WritePrivateFile(file, "", "database");
  sqlite3* opened = nullptr;
  const int flags = access == Access::kRead ? SQLITE_OPEN_READONLY : SQLITE_OPEN_READWRITE;
  const int code = sqlite3_open_v2(file.c_str(), &opened, flags, nullptr);
  database_.reset(opened);
  if (code != SQLITE_OK) Fail("cannot be opened");
  // SQLite opens a file without write permission for reading only, without an error.
  if (access != Access::kRead && sqlite3_db_readonly(opened, "main") == 1) Fail("cannot be written to");
  sqlite3_busy_timeout(opened, kBusy_ms);
  if (access == Access::kRead) Recover();
  CheckOrMake(access, checked);
  if (runtime::NarrowToOwner(file)) {
    std::fprintf(stderr, "fulcrum: %s: other users could read it; it is now readable by its owner only\n",
                 file.c_str());
  }
}

void TrainingLog::Recover() {
  const auto read = [](sqlite3* database) {
    return sqlite3_exec(database, "SELECT count(*) FROM sqlite_master", nullptr, nullptr, nullptr);
  };
  // A connection that only reads may not roll back; other errors are found by the checks that follow.
  if (read(database_.get()) == SQLITE_OK || sqlite3_extended_errcode(database_.get()) != SQLITE_READONLY_ROLLBACK) {
    return;
  }
  sqlite3* opened = nullptr;
  bool good = IsOurs(file_) && sqlite3_open_v2(file_.c_str(), &opened, SQLITE_OPEN_READWRITE, nullptr) == SQLITE_OK;
  sqlite3_busy_timeout(opened, kBusy_ms);
  good = good && sqlite3_db_readonly(opened, "main") == 0 && read(opened) == SQLITE_OK;
  sqlite3_close(opened);
  if (good) return;
  throw InputError(file_.string() + ": a crash has left a transaction, which " + file_.filename().string() +
                   "-journal takes back; keep both files together and open the database once as a user who may write "
                   "to them, for example with fulcrum trainee");
}

void TrainingLog::Fail(const std::string& what) const {
  const std::string reason = database_ == nullptr ? "out of memory" : sqlite3_errmsg(database_.get());
  throw InputError(file_.string() + ": " + what + (reason == "not an error" ? "" : " (" + reason + ")") +
                   "; nothing was changed. Give another file with --database, or move this one away");
}

void TrainingLog::Execute(const char* sql) const {
  if (sqlite3_exec(database_.get(), sql, nullptr, nullptr, nullptr) != SQLITE_OK) Fail("cannot be used");
}

int TrainingLog::Ask(const char* sql) const {
  Statement statement(database_.get(), sql);
  if (!statement.Next()) Fail("is not a database of trainees, or damaged");
  return static_cast<int>(statement.Integer(0));
}

void TrainingLog::CheckOrMake(Access access, FileContent* checked) {
  const int tables = Ask("SELECT count(*) FROM sqlite_master");
  const int application = Ask("PRAGMA application_id"), version = Ask("PRAGMA user_version");
  const bool empty = tables == 0 && application == 0 && version == 0;
  if (empty && access == Access::kAdd) {
    // The tables are made in one transaction, because two sessions may start at the same time.
    Execute("BEGIN IMMEDIATE");
    if (Ask("SELECT count(*) FROM sqlite_master") == 0) {
      Execute(kTables);
      Execute(kPeople);
      Execute(("PRAGMA application_id = " + std::to_string(kApplication)).c_str());
      Execute(("PRAGMA user_version = " + std::to_string(kVersion)).c_str());
    }
    Execute("COMMIT");
    return;
  }
  if (!empty && application != kApplication) Fail("is a database of another program");
  if (version > kVersion) {
    Fail("has version " + std::to_string(version) + " of a newer program; this program reads version " +
         std::to_string(kVersion));
  }
  // This program makes none; one made by somebody else would run in place of a table, for ever if it likes.
  if (Ask("SELECT count(*) FROM sqlite_master WHERE type IN ('view', 'trigger')") != 0) Fail("has views or triggers");
  if (const FileContent content = ContentOf(file_); checked == nullptr || *checked != content) {
    // Not quick_check, which does not compare the indexes with the tables: a session would be there and not be found.
    Statement check(database_.get(), "PRAGMA integrity_check(1)");
    if (!check.Next() || check.Text(0) != "ok") Fail("is damaged");
    if (checked != nullptr) *checked = content;
  }
  if (!empty && version < kVersion && access != Access::kRead) {
    Execute("BEGIN IMMEDIATE");
    if (!HasPeople()) Execute(kPeople);
    Execute(("PRAGMA user_version = " + std::to_string(kVersion)).c_str());
    Execute("COMMIT");
  }
}

bool TrainingLog::HasPeople() const {
  return Ask("SELECT count(*) FROM sqlite_master WHERE type = 'table' AND name = 'people'") == 1;
}

void TrainingLog::AddPerson(const Person& person) {
  CheckTraineeName(person.name);
  if (FindPerson(person.name)) throw InputError("\"" + person.name + "\" has an account; enter with its PIN");
  Statement statement(database_.get(), "INSERT INTO people (name, pin_hash, instructor) VALUES (?, ?, ?)");
  statement.Bind(1, person.name);
  statement.Bind(2, person.pin_hash);
  statement.Bind(3, static_cast<sqlite3_int64>(person.instructor));
  (void)statement.Next();
  if (!statement.good()) Fail("the account cannot be added");
}

std::optional<Person> TrainingLog::FindPerson(const std::string& name) const {
  if (!HasPeople()) return std::nullopt;
  Statement statement(database_.get(), "SELECT pin_hash, instructor FROM people WHERE name = ?");
  statement.Bind(1, name);
  if (statement.Next()) return Person{name, statement.Text(0), statement.Integer(1) != 0};
  if (!statement.good()) Fail("cannot be read");
  return std::nullopt;
}

bool TrainingLog::HasInstructor() const {
  return HasPeople() && Ask("SELECT count(*) FROM people WHERE instructor != 0") > 0;
}

void TrainingLog::Add(const TrainingRow& row) {
  const auto require = [&](bool good) {
    if (good) return;
    const std::string reason = sqlite3_errmsg(database_.get());
    sqlite3_exec(database_.get(), "ROLLBACK", nullptr, nullptr, nullptr);
    throw InputError(file_.string() + ": the session could not be added (" + reason +
                     "); its figures are in assessment.json of its folder");
  };
  require(sqlite3_exec(database_.get(), "BEGIN IMMEDIATE", nullptr, nullptr, nullptr) == SQLITE_OK);
  Statement session(database_.get(),
                    "INSERT INTO sessions (trainee, session, scene, started_utc, seconds, well, score_pct) "
                    "VALUES (?, ?, ?, ?, ?, ?, ?)");
  session.Bind(1, row.trainee);
  session.Bind(2, row.session);
  session.Bind(3, row.scene);
  session.Bind(4, row.started_utc);
  session.Bind(5, row.seconds);
  session.Bind(6, static_cast<sqlite3_int64>(row.well));
  session.Bind(7, row.score_pct);
  (void)session.Next();
  require(session.good());
  const sqlite3_int64 id = sqlite3_last_insert_rowid(database_.get());
  Statement measure(database_.get(), "INSERT INTO measures (session_id, measure, value) VALUES (?, ?, ?)");
  for (const auto& [key, value] : row.measures) {
    measure.Bind(1, id);
    measure.Bind(2, key);
    measure.Bind(3, value);
    (void)measure.Next();
    require(measure.good());
    measure.Again();
  }
  require(sqlite3_exec(database_.get(), "COMMIT", nullptr, nullptr, nullptr) == SQLITE_OK);
}

int TrainingLog::Delete(const std::string& trainee) {
  // Deleted content is overwritten, and then the file is built anew, because SQLite may have left copies of rows in
  // unused space when it moved them.
  Execute("PRAGMA secure_delete = ON");
  Execute("BEGIN IMMEDIATE");
  for (const char* sql : {"DELETE FROM measures WHERE session_id IN (SELECT id FROM sessions WHERE trainee = ?)",
                          "DELETE FROM people WHERE name = ?", "DELETE FROM sessions WHERE trainee = ?"}) {
    Statement statement(database_.get(), sql);
    statement.Bind(1, trainee);
    (void)statement.Next();
    if (!statement.good()) Fail("the sessions cannot be deleted");
  }
  const int deleted = sqlite3_changes(database_.get());
  Execute("COMMIT");
  Execute("VACUUM");
  return deleted;
}

std::vector<TrainingRow> TrainingLog::SessionsOf(const std::string& trainee, const std::string& scene,
                                                 Rows wanted) const {
  Statement sessions(database_.get(),
                     "SELECT id, session, scene, started_utc, seconds, well, score_pct FROM sessions "
                     "WHERE trainee = ?1 AND (?2 = '' OR scene = ?2) ORDER BY id");
  sessions.Bind(1, trainee);
  sessions.Bind(2, scene);
  Statement measures(database_.get(), "SELECT measure, value FROM measures WHERE session_id = ?");
  std::vector<TrainingRow> rows;
  while (sessions.Next()) {
    TrainingRow row{trainee,
                    sessions.Text(1),
                    sessions.Text(2),
                    sessions.Text(3),
                    sessions.Number(4),
                    sessions.Integer(5) != 0,
                    sessions.Number(6),
                    {},
                    sessions.Integer(0)};
    if (wanted == Rows::kWithoutMeasures) {
      rows.push_back(std::move(row));
      continue;
    }
    measures.Bind(1, sessions.Integer(0));
    while (measures.Next()) row.measures.emplace(measures.Text(0), measures.Number(1));
    if (!measures.good()) Fail("cannot be read");
    measures.Again();
    rows.push_back(std::move(row));
  }
  if (!sessions.good()) Fail("cannot be read");
  return rows;
}

std::vector<TrainingRow> TrainingLog::RowsOf(const std::string& session) const {
  Statement found(database_.get(),
                  "SELECT trainee, scene, started_utc, seconds, well, score_pct, id FROM sessions WHERE session = ?");
  found.Bind(1, session);
  std::vector<TrainingRow> rows;
  while (found.Next()) {
    rows.push_back({found.Text(0),
                    session,
                    found.Text(1),
                    found.Text(2),
                    found.Number(3),
                    found.Integer(4) != 0,
                    found.Number(5),
                    {},
                    found.Integer(6)});
  }
  if (!found.good()) Fail("cannot be read");
  return rows;
}

std::map<std::string, int> TrainingLog::Trainees() const {
  Statement statement(database_.get(), "SELECT trainee, count(*) FROM sessions GROUP BY trainee");
  std::map<std::string, int> trainees;
  while (statement.Next()) trainees.emplace(statement.Text(0), static_cast<int>(statement.Integer(1)));
  if (!statement.good()) Fail("cannot be read");
  return trainees;
}

}  // namespace fulcrum::supervisor
