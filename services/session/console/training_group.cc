#include "services/session/console/training_group.h"

#include <algorithm>
#include <functional>
#include <iterator>
#include <optional>
#include <sstream>
#include <tuple>
#include <utility>

#include "services/session/console/json.h"

namespace fulcrum::console {
namespace {

using supervisor::TrainingLog;
using supervisor::TrainingRow;

/// A field of CSV (RFC 4180). A leading character that a spreadsheet would take for a formula gets an apostrophe.
std::string Quoted(std::string text) {
  if (!text.empty() && std::string_view("=+-@").find(text.front()) != std::string_view::npos) text.insert(0, "'");
  std::string quoted = "\"";
  for (const char c : text) quoted.append(c == '"' ? 2 : 1, c);
  return quoted + "\"";
}

/// Score that passes an exercise [%]; of several courses with it the first counts.
std::optional<double> PassOf(const std::string& scene, const std::vector<training::Course>& courses) {
  for (const training::Course& course : courses) {
    const auto found = std::ranges::find(course.exercises, scene, &training::Exercise::scene);
    if (found != course.exercises.end()) return found->pass_pct;
  }
  return {};
}

}  // namespace

TrainingGroup::TrainingGroup(const TrainingLog* log, TrainingLog::Rows rows) {
  if (log == nullptr) return;
  for (const auto& [trainee, count] : log->Trainees()) {
    if (trainee == kExpert) continue;
    sessions_[trainee] = log->SessionsOf(trainee, "", rows);
    if (const auto person = log->FindPerson(trainee); person && person->instructor) instructors_.insert(trainee);
  }
}

std::vector<double> TrainingGroup::ScoresOf(const std::string& trainee, const std::string& scene) const {
  std::vector<double> scores;
  const auto found = sessions_.find(trainee);
  if (found == sessions_.end()) return scores;
  for (const TrainingRow& row : found->second) {
    if (row.well && row.scene == scene) scores.push_back(row.score_pct);
  }
  return scores;
}

std::vector<training::Spread> TrainingGroup::CohortOf(const std::string& scene, const std::string& except) const {
  std::vector<std::vector<double>> scores;
  for (const auto& [trainee, rows] : sessions_) {
    if (trainee != except && !IsInstructor(trainee)) scores.push_back(ScoresOf(trainee, scene));
  }
  return training::CohortOf(scores);
}

std::string TrainingGroup::TableJson(const std::vector<training::Course>& courses) const {
  Json table('[');
  for (const auto& [trainee, rows] : sessions_) {
    if (IsInstructor(trainee)) continue;
    Json results('[');
    for (const training::Course& course : courses) {
      for (const training::Exercise& exercise : course.exercises) {
        const std::vector<double> scores = ScoresOf(trainee, exercise.scene);
        if (scores.empty()) continue;
        const double best = std::ranges::max(scores);
        Json one('{');
        one.Text("scene", exercise.scene).Raw("attempts", std::to_string(scores.size())).Number("best", best, 0.1);
        results.Item(one.Flag("passed", best >= exercise.pass_pct).Done());
      }
    }
    table.Item(Json('{').Text("trainee", trainee).Raw("results", results.Done()).Done());
  }
  return table.Done();
}

std::string TrainingGroup::Csv(const std::string& trainee, const std::vector<training::Course>& courses) const {
  struct Line {
    const TrainingRow* row;
    std::size_t attempt;  ///< From 1; 0: it does not count.
  };
  std::vector<Line> lines;
  std::set<std::string> measures;
  std::map<std::pair<std::string, std::string>, std::vector<training::Spread>> cohorts;  // By trainee and scene.
  for (const auto& [name, rows] : sessions_) {
    if (!trainee.empty() && name != trainee) continue;
    std::map<std::string, std::size_t> attempts;
    for (const TrainingRow& row : rows) {
      lines.push_back({&row, row.well ? ++attempts[row.scene] : 0});
      const auto [cohort, is_new] = cohorts.try_emplace({name, row.scene});
      if (is_new) cohort->second = CohortOf(row.scene, name);
      for (const auto& [key, value] : row.measures) measures.insert(key);
    }
  }
  std::ranges::sort(lines, std::greater<>(), [](const Line& line) { return line.row->id; });
  std::ostringstream csv;
  csv << "trainee,session,scene,started_utc,seconds,well,score_pct,attempt,pass_pct,passed,cohort_people,cohort_low_"
         "pct,"
         "cohort_median_pct,cohort_high_pct";
  for (const std::string& measure : measures) csv << ',' << measure;
  csv << "\r\n";
  for (const auto& [row, attempt] : lines) {
    csv << Quoted(row->trainee) << ',' << Quoted(row->session) << ',' << Quoted(row->scene) << ','
        << Quoted(row->started_utc) << ',' << row->seconds << ',' << (row->well ? 1 : 0) << ',' << row->score_pct
        << ',';
    if (attempt > 0) csv << attempt;
    const std::optional<double> pass = PassOf(row->scene, courses);
    csv << ',';
    if (pass) csv << *pass;
    csv << ',';
    if (pass && attempt > 0) csv << (row->score_pct >= *pass ? 1 : 0);
    const std::vector<training::Spread>& cohort = cohorts.at({row->trainee, row->scene});
    if (attempt > 0 && attempt <= cohort.size()) {
      const training::Spread& spread = cohort[attempt - 1];
      csv << ',' << spread.people << ',' << spread.low << ',' << spread.median << ',' << spread.high;
    } else {
      csv << ",,,,";
    }
    for (const std::string& measure : measures) {
      const auto found = row->measures.find(measure);
      csv << ',';
      if (found != row->measures.end()) csv << found->second;
    }
    csv << "\r\n";
  }
  return csv.str();
}

}  // namespace fulcrum::console
