#include "services/session/console/training_desk.h"

#include <algorithm>
#include <fstream>
#include <iterator>

#include "services/base/core/error.h"
#include "services/base/core/tick.h"
#include "services/session/console/form.h"
#include "services/session/console/json.h"
#include "services/session/console/training_group.h"
#include "services/session/training/pin.h"

namespace fulcrum::console {
namespace {

namespace fs = std::filesystem;
using supervisor::TrainingLog;
using supervisor::TrainingRow;

/// 43,000 guesses a day: a PIN of four digits is no secret from who stands at the cart, but takes hours.
constexpr std::int64_t kAfterWrongPin = 2 * kSecond_ns;
constexpr std::size_t kMostAttempts = 500;

std::string JsonOf(const TrainingRow& row) {
  Json json('{');
  json.Text("trainee", row.trainee).Text("session", row.session).Text("scene", row.scene);
  json.Text("started", row.started_utc).Number("score", row.score_pct, 0.1).Flag("well", row.well);
  return json.Done();
}

std::string TextOf(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

}  // namespace

void TrainingDesk::Enter(const std::string& name, const std::string& pin, std::int64_t now_ns) {
  if (now_ns < locked_until_ns_) throw InputError("too soon after a wrong PIN; wait two seconds");
  std::optional<supervisor::Person> found;
  std::error_code error;
  if (fs::exists(database_, error)) found = TrainingLog(database_, TrainingLog::Access::kRead).FindPerson(name);
  if (!found || !training::IsHashOf(found->pin_hash, pin)) {
    locked_until_ns_ = now_ns + kAfterWrongPin;
    throw InputError("name or PIN is wrong; a new name needs New trainee");
  }
  person_ = found;
}

void TrainingDesk::Create(const std::string& name, const std::string& pin, bool instructor) {
  if (name == kExpert) throw InputError("this name is that of the demonstrations; choose another");
  TrainingLog log(database_);
  if (instructor && log.HasInstructor() && !(person_ && person_->instructor)) {
    throw InputError("there is an instructor already, who must enter first to add another");
  }
  supervisor::Person person{name, training::HashOfPin(pin), instructor};
  log.AddPerson(person);
  person_ = std::move(person);
}

std::string TrainingDesk::OverviewJson(const std::vector<SceneChoice>& scenes) const {
  const bool instructor = person_ && person_->instructor;
  const TrainingGroup group(person_ ? database_ : fs::path());
  const std::vector<training::Course> all = training::ReadCourses(courses_);
  Json courses('[');
  for (const training::Course& course : all) {
    Json exercises('[');
    for (const training::Exercise& exercise : course.exercises) {
      const auto scene = std::ranges::find(scenes, exercise.scene, &SceneChoice::name);
      if (scene == scenes.end()) continue;
      Json scores('[');
      for (const double score : group.ScoresOf(person(), exercise.scene)) scores.Item(Json::Rounded(score, 0.1));
      Json cohort('[');
      for (const training::Spread& spread : group.CohortOf(exercise.scene, person())) {
        Json one('{');
        one.Raw("people", std::to_string(spread.people)).Number("low", spread.low, 0.1);
        cohort.Item(one.Number("median", spread.median, 0.1).Number("high", spread.high, 0.1).Done());
      }
      Json one('{');
      one.Text("scene", exercise.scene).Text("description", scene->description).Number("pass", exercise.pass_pct, 0.1);
      exercises.Item(one.Raw("scores", scores.Done()).Raw("cohort", cohort.Done()).Done());
    }
    Json one('{');
    courses.Item(one.Text("name", course.name)
                     .Text("description", course.description)
                     .Raw("exercises", exercises.Done())
                     .Done());
  }
  std::vector<TrainingRow> attempts;
  for (const auto& [trainee, sessions] : group.sessions()) {
    if (instructor || trainee == person()) std::ranges::copy(sessions, std::back_inserter(attempts));
  }
  std::ranges::stable_sort(attempts, std::greater<>(), &TrainingRow::started_utc);
  Json rows('[');
  for (std::size_t i = 0; i < std::min(attempts.size(), kMostAttempts); ++i) rows.Item(JsonOf(attempts[i]));
  Json json('{');
  json.Text("person", person()).Flag("instructor", instructor).Raw("courses", courses.Done());
  return json.Raw("attempts", rows.Done()).Raw("group", instructor ? group.TableJson(all) : "[]").Done();
}

std::string TrainingDesk::Csv() const {
  const TrainingGroup group(person_ ? database_ : fs::path());
  return group.Csv(person_ && person_->instructor ? std::string() : person(), training::ReadCourses(courses_));
}

fs::path TrainingDesk::FolderOf(const std::string& session) const {
  std::error_code error;
  if (!person_ || !IsPlainName(session) || !fs::exists(database_, error)) return {};
  const TrainingLog log(database_, TrainingLog::Access::kRead);
  for (const auto& [trainee, sessions] : log.Trainees()) {
    if (trainee != kExpert && trainee != person_->name && !person_->instructor) continue;
    const std::vector<TrainingRow> rows = log.SessionsOf(trainee, "");
    if (std::ranges::find(rows, session, &TrainingRow::session) != rows.end()) return out_ / session;
  }
  return {};
}

std::string TrainingDesk::AttemptJson(const std::string& session) const {
  const fs::path folder = FolderOf(session);
  if (folder.empty()) throw InputError("no attempt \"" + session + "\" of yours");
  const std::string sheet = TextOf(folder / "assessment.json");
  if (sheet.empty()) throw InputError(folder.string() + ": the session's folder is gone; its score is kept");
  const TrainingLog log(database_, TrainingLog::Access::kRead);
  std::string expert;
  for (const TrainingRow& row : log.SessionsOf(kExpert, "")) {
    if (session.ends_with("-" + row.scene)) expert = row.session;
  }
  Json json('{');
  json.Raw("sheet", sheet).Text("expert", expert);
  Json labels('{');
  for (const MeasureInfo& info : kMeasures) {
    labels.Text(info.key, std::string(info.label) + (*info.unit == '\0' ? "" : std::string(" [") + info.unit + "]"));
  }
  return json.Raw("labels", labels.Done()).Done();
}

}  // namespace fulcrum::console
