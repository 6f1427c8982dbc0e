// The trainees' database: a row for each assessed session and its measures, in SQLite.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "services/base/core/scene_view.h"
#include "services/session/supervisor/outcome.h"

struct sqlite3;

namespace fulcrum::supervisor {

struct TrainingRow {
  std::string trainee, session, scene, started_utc;
  double seconds = 0;
  bool well = false;  ///< The session ended without failure; a score of a failed cart does not assess the trainee.
  double score_pct = 0;
  std::map<std::string, double> measures;  ///< By key of kMeasures; only those that apply to the scene.
  std::int64_t id = 0;                     ///< Grows with each row of a database; set by reading only.
};
/// Row of an assessed session. @pre outcome.sheet has a value.
[[nodiscard]] TrainingRow TrainingRowOf(const SessionOutcome& outcome);

/// Who may enter on the console's page.
struct Person {
  std::string name;
  std::string pin_hash;     ///< services/session/training/pin.h
  bool instructor = false;  ///< Sees the sessions of all trainees.
};

/// Content of a file, as far as its attributes tell.
struct FileContent {
  std::uint64_t device = 0, inode = 0;
  std::int64_t bytes = -1, changed_ns = 0;
  bool operator==(const FileContent&) const = default;
};

/// An open database. All functions throw an InputError that names the file and the remedy. A file that is damaged, of
/// another program or of a newer version is never written to.
class TrainingLog {
 public:
  enum class Access { kRead, kAdd, kDelete };
  /// kAdd makes a missing file (mode 0600) and its folder; the others throw when the file is missing. A database that
  /// other users can read is narrowed to its owner, with a line to stderr, or refused if it is another user's. A
  /// transaction that a crash has left is rolled back, also for kRead.
  /// @param checked of a reader that opens the file again and again: content that was found undamaged is not examined
  /// once more while it is the same.
  explicit TrainingLog(const std::filesystem::path& file, Access access = Access::kAdd, FileContent* checked = nullptr);
  ~TrainingLog();
  TrainingLog(TrainingLog&&) noexcept;
  TrainingLog& operator=(TrainingLog&&) noexcept;

  void Add(const TrainingRow& row);
  /// Deletes account and all sessions of a trainee; nothing of them remains in the file's bytes. @return their number.
  int Delete(const std::string& trainee);
  enum class Rows { kWhole, kWithoutMeasures };
  /// Sessions of a trainee in the order in which they ended, whatever the clock said. `scene` empty: of all scenes.
  [[nodiscard]] std::vector<TrainingRow> SessionsOf(const std::string& trainee, const std::string& scene,
                                                    Rows rows = Rows::kWhole) const;
  /// Rows of a session's name, without measures.
  [[nodiscard]] std::vector<TrainingRow> RowsOf(const std::string& session) const;
  /// Number of sessions by trainee.
  [[nodiscard]] std::map<std::string, int> Trainees() const;

  /// Adds an account. Throws InputError if the name has one.
  void AddPerson(const Person& person);
  /// The account of a name; nullopt: it has none.
  [[nodiscard]] std::optional<Person> FindPerson(const std::string& name) const;
  /// An instructor has an account.
  [[nodiscard]] bool HasInstructor() const;

 private:
  struct Closer {
    void operator()(sqlite3* database) const;
  };
  [[noreturn]] void Fail(const std::string& what) const;
  void Execute(const char* sql) const;
  [[nodiscard]] int Ask(const char* sql) const;
  /// Rolls a transaction back that a crash has left.
  void Recover();
  void CheckOrMake(Access access, FileContent* checked);
  [[nodiscard]] bool HasPeople() const;

  std::filesystem::path file_;
  std::unique_ptr<sqlite3, Closer> database_;
};

/// Opens the database before a session starts any node, so that a session whose score cannot be stored does not begin.
/// nullopt without a trainee. Throws InputError, also when the scene has no assessment.
[[nodiscard]] std::optional<TrainingLog> OpenTrainingLog(const std::string& trainee, const std::filesystem::path& file,
                                                         const SceneView& scene);

/// Throws InputError unless 1 to 63 bytes without control characters, not all blank.
void CheckTraineeName(const std::string& name);

}  // namespace fulcrum::supervisor
