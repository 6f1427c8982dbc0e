// All trainees of the database with their sessions: own results, and those of the others without names.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "services/session/supervisor/training_log.h"
#include "services/session/training/cohort.h"
#include "services/session/training/course.h"

namespace fulcrum::console {

/// Trainee under whose name the scripted demonstration of an exercise is stored. No account can have it.
inline constexpr const char* kExpert = "Expert (script)";

class TrainingGroup {
 public:
  /// Reads the database; null: as a database without sessions. Throws InputError.
  explicit TrainingGroup(const supervisor::TrainingLog* log,
                         supervisor::TrainingLog::Rows rows = supervisor::TrainingLog::Rows::kWhole);

  /// Sessions by trainee, oldest first; without the demonstrations.
  [[nodiscard]] const std::map<std::string, std::vector<supervisor::TrainingRow>>& sessions() const {
    return sessions_;
  }
  [[nodiscard]] bool IsInstructor(const std::string& trainee) const { return instructors_.contains(trainee); }

  /// Scores of a trainee in an exercise, oldest first [%]. A session that did not end well assesses the cart and is
  /// left out, here and in all that follows.
  [[nodiscard]] std::vector<double> ScoresOf(const std::string& trainee, const std::string& scene) const;
  /// The other trainees' attempts at an exercise; instructors do not count.
  [[nodiscard]] std::vector<training::Spread> CohortOf(const std::string& scene, const std::string& except) const;

  /// For an instructor, as JSON: `trainee` and `results` (`scene`, `attempts`, `best` [%], `passed`) of each trainee,
  /// for the exercises that the trainee has tried.
  [[nodiscard]] std::string TableJson(const std::vector<training::Course>& courses) const;
  /// Sessions of one trainee, or of all (empty), newest first, with all measures, the level that passes and the cohort,
  /// as CSV (RFC 4180).
  [[nodiscard]] std::string Csv(const std::string& trainee, const std::vector<training::Course>& courses) const;

 private:
  std::map<std::string, std::vector<supervisor::TrainingRow>> sessions_;
  std::set<std::string> instructors_;
};

}  // namespace fulcrum::console
