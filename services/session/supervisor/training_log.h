// The trainees' database: a row for each assessed session and its measures, in SQLite.
#pragma once

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
  bool well = false;  ///< The session itself ended well: a trainee's score says nothing of a cart that failed.
  double score_pct = 0;
  std::map<std::string, double> measures;  ///< By key of kMeasures; those that mean something in the scene.
};
/// @pre outcome.sheet
[[nodiscard]] TrainingRow TrainingRowOf(const SessionOutcome& outcome);

/// Throws InputError that names the file and says what to do. A file that is damaged, another program's, or of a newer
/// version is never written to.
class TrainingLog {
 public:
  enum class Access { kRead, kAdd };
  /// kAdd makes file and folder where there are none; kRead refuses then.
  explicit TrainingLog(const std::filesystem::path& file, Access access = Access::kAdd);
  ~TrainingLog();
  TrainingLog(TrainingLog&&) noexcept;
  TrainingLog& operator=(TrainingLog&&) noexcept;

  void Add(const TrainingRow& row);
  /// Oldest first. `scene` empty: of all.
  [[nodiscard]] std::vector<TrainingRow> SessionsOf(const std::string& trainee, const std::string& scene) const;
  /// Names and how many sessions each has.
  [[nodiscard]] std::map<std::string, int> Trainees() const;

 private:
  struct Closer {
    void operator()(sqlite3* database) const;
  };
  [[noreturn]] void Fail(const std::string& what) const;
  void Execute(const char* sql) const;
  [[nodiscard]] int Ask(const char* sql) const;
  void CheckOrMake(Access access);

  std::filesystem::path file_;
  std::unique_ptr<sqlite3, Closer> database_;
};

/// Of a session, before anything of it is started: one that cannot be remembered is better not begun. None without a
/// trainee. Throws InputError, also when the scene is not assessed.
[[nodiscard]] std::optional<TrainingLog> OpenTrainingLog(const std::string& trainee, const std::filesystem::path& file,
                                                         const SceneView& scene);

/// Throws InputError unless 1 to 63 bytes without control characters, not all blank.
void CheckTraineeName(const std::string& name);

}  // namespace fulcrum::supervisor
