// Courses, people and attempts, as the page shows them. One person at a time is at the cart.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "services/session/console/library.h"
#include "services/session/console/training_group.h"
#include "services/session/supervisor/training_log.h"
#include "services/session/training/course.h"

namespace fulcrum::console {

class TrainingDesk {
 public:
  /// @param database may be missing: the first account or session makes it. @param out folder of the session folders.
  TrainingDesk(std::filesystem::path database, std::filesystem::path courses, std::filesystem::path out)
      : database_(std::move(database)), courses_(std::move(courses)), out_(std::move(out)) {}

  /// Checks the PIN. Throws InputError: a wrong name or PIN, or too soon after a wrong one.
  void Enter(const std::string& name, const std::string& pin, std::int64_t now_ns);
  /// Makes an account and enters. An instructor must be made by an instructor, but for the first.
  void Create(const std::string& name, const std::string& pin, bool instructor);
  void Leave() { Seat({}); }

  /// Name of the person at the cart; empty: none. All other functions let go of a person whose account was deleted or
  /// made anew meanwhile.
  [[nodiscard]] std::string person() const { return person_ ? person_->name : std::string(); }
  /// Number of times that the person was set.
  [[nodiscard]] std::uint64_t person_changes() const { return person_changes_; }
  /// Throws InputError if nobody is at the cart, or another person than the page shows. @param shown empty: any.
  void Expect(const std::string& shown);

  /// Person, courses with the person's scores beside those of the others, and the attempts that the person may see.
  /// Throws InputError.
  [[nodiscard]] std::string OverviewJson(const std::vector<SceneChoice>& scenes);
  /// The same as CSV, with all measures.
  [[nodiscard]] std::string Csv();
  /// A session's folder; empty: the person may not see it.
  [[nodiscard]] std::filesystem::path FolderOf(const std::string& session);
  /// Sheet of an attempt, and the name of the newest complete demonstration of its exercise.
  [[nodiscard]] std::string AttemptJson(const std::string& session);

 private:
  void Seat(std::optional<supervisor::Person> person);
  /// The database for reading; nullopt: none was made yet. Lets go of a person without the account.
  [[nodiscard]] std::optional<supervisor::TrainingLog> Open();
  /// A session's row; nullopt: the person may not see it.
  [[nodiscard]] std::optional<supervisor::TrainingRow> Find(const supervisor::TrainingLog& log,
                                                            const std::string& session) const;
  /// Name of the newest complete demonstration of a scene that has a recording, of those that ended well if there are
  /// any; empty: none.
  [[nodiscard]] std::string DemonstrationOf(const supervisor::TrainingLog& log, const std::string& scene) const;

  std::filesystem::path database_, courses_, out_;
  supervisor::FileContent checked_;
  std::optional<supervisor::Person> person_;
  std::uint64_t person_changes_ = 0;
  std::int64_t locked_until_ns_ = 0;  ///< After a wrong PIN.
};

}  // namespace fulcrum::console
