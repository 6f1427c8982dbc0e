#include "services/session/console/training_desk.h"

#include <algorithm>
#include <fstream>
#include <functional>
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
/// A demonstration is complete if it lasted for this share of the longest one: others were stopped by hand.
constexpr double kComplete = 0.9;

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
  const std::optional<TrainingLog> log = Open();
  const std::optional<supervisor::Person> found = log ? log->FindPerson(name) : std::nullopt;
  if (!found || !training::IsHashOf(found->pin_hash, pin)) {
    locked_until_ns_ = now_ns + kAfterWrongPin;
    throw InputError("name or PIN is wrong; a new name needs New trainee");
  }
  Seat(found);
}

void TrainingDesk::Seat(std::optional<supervisor::Person> person) {
  person_ = std::move(person);
  ++person_changes_;
}

std::optional<TrainingLog> TrainingDesk::Open() {
  std::optional<TrainingLog> log;
  std::error_code error;
  if (fs::exists(database_, error)) log.emplace(database_, TrainingLog::Access::kRead, &checked_);
  if (person_) {
    const auto account = log ? log->FindPerson(person_->name) : std::nullopt;
    if (!account || account->pin_hash != person_->pin_hash) Seat({});
  }
  return log;
}

void TrainingDesk::Expect(const std::string& shown) {
  (void)Open();
  if (!person_) throw InputError("no trainee has entered; enter with name and PIN first");
  if (!shown.empty() && shown != person_->name) throw InputError(person_->name + " is at the cart now");
}

void TrainingDesk::Create(const std::string& name, const std::string& pin, bool instructor) {
  if (name == kExpert) throw InputError("this name is that of the demonstrations; choose another");
  TrainingLog log(database_);
  (void)Open();
  if (instructor && log.HasInstructor() && !(person_ && person_->instructor)) {
    throw InputError("there is an instructor already, who must enter first to add another");
  }
  supervisor::Person person{name, training::HashOfPin(pin), instructor};
  log.AddPerson(person);
  Seat(std::move(person));
}

std::string TrainingDesk::OverviewJson(const std::vector<SceneChoice>& scenes) {
  const std::optional<TrainingLog> log = Open();
  const bool instructor = person_ && person_->instructor;
  const TrainingGroup group(person_ && log ? &*log : nullptr, TrainingLog::Rows::kWithoutMeasures);
  const std::vector<training::Course> all = training::ReadCourses(courses_);
  Json courses('[');
  for (const training::Course& course : all) {
    Json exercises('[');
    for (const training::Exercise& exercise : course.exercises) {
      const auto scene = std::ranges::find(scenes, exercise.scene, &SceneChoice::name);
      if (scene == scenes.end()) continue;
      Json scores('[');
      bool passed = false;  // By the exact scores, as in the instructor's table.
      for (const double score : group.ScoresOf(person(), exercise.scene)) {
        scores.Item(Json::Rounded(score, 0.001));
        passed = passed || score >= exercise.pass_pct;
      }
      Json cohort('[');
      for (const training::Spread& spread : group.CohortOf(exercise.scene, person())) {
        Json one('{');
        one.Raw("people", std::to_string(spread.people)).Number("low", spread.low, 0.1);
        cohort.Item(one.Number("median", spread.median, 0.1).Number("high", spread.high, 0.1).Done());
      }
      Json one('{');
      one.Text("scene", exercise.scene).Text("description", scene->description).Number("pass", exercise.pass_pct, 0.1);
      one.Flag("passed", passed);
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
  std::ranges::sort(attempts, std::greater<>(), &TrainingRow::id);
  Json rows('[');
  for (std::size_t i = 0; i < std::min(attempts.size(), kMostAttempts); ++i) rows.Item(JsonOf(attempts[i]));
  Json json('{');
  json.Text("person", person()).Flag("instructor", instructor).Raw("courses", courses.Done());
  return json.Raw("attempts", rows.Done()).Raw("group", instructor ? group.TableJson(all) : "[]").Done();
}

std::string TrainingDesk::Csv() {
  const std::optional<TrainingLog> log = Open();
  const TrainingGroup group(person_ && log ? &*log : nullptr);
  return group.Csv(person_ && person_->instructor ? std::string() : person(), training::ReadCourses(courses_));
}

std::optional<TrainingRow> TrainingDesk::Find(const TrainingLog& log, const std::string& session) const {
  if (!person_ || !IsPlainName(session)) return {};
  const std::vector<TrainingRow> rows = log.RowsOf(session);
  const auto found = std::ranges::find_if(rows, [&](const TrainingRow& row) {
    return row.trainee == kExpert || row.trainee == person_->name || person_->instructor;
  });
  return found == rows.end() ? std::nullopt : std::optional(*found);
}

fs::path TrainingDesk::FolderOf(const std::string& session) {
  const std::optional<TrainingLog> log = Open();
  return log && Find(*log, session) ? out_ / session : fs::path();
}

std::string TrainingDesk::DemonstrationOf(const TrainingLog& log, const std::string& scene) const {
  std::vector<TrainingRow> rows = log.SessionsOf(kExpert, scene, TrainingLog::Rows::kWithoutMeasures);
  std::erase_if(rows, [&](const TrainingRow& row) {
    std::error_code error;
    return !fs::is_regular_file(out_ / row.session / "recording.mcap", error);
  });
  // One of a failed cart, for example of a machine that is too slow, is better than none.
  if (std::ranges::any_of(rows, &TrainingRow::well)) std::erase_if(rows, std::not_fn(std::mem_fn(&TrainingRow::well)));
  double longest_s = 0;
  for (const TrainingRow& row : rows) longest_s = std::max(longest_s, row.seconds);
  std::string newest;
  for (const TrainingRow& row : rows) {
    if (row.seconds >= kComplete * longest_s) newest = row.session;
  }
  return newest;
}

std::string TrainingDesk::AttemptJson(const std::string& session) {
  const std::optional<TrainingLog> log = Open();
  const std::optional<TrainingRow> attempt = log ? Find(*log, session) : std::nullopt;
  if (!attempt) throw InputError("no attempt \"" + session + "\" of yours");
  const fs::path folder = out_ / session;
  const std::string sheet = TextOf(folder / "assessment.json");
  if (sheet.empty()) throw InputError(folder.string() + ": the session's folder is gone; its score is kept");
  const std::string expert = DemonstrationOf(*log, attempt->scene);
  Json json('{');
  json.Raw("sheet", sheet).Text("expert", expert);
  Json labels('{');
  for (const MeasureInfo& info : kMeasures) {
    labels.Text(info.key, std::string(info.label) + (*info.unit == '\0' ? "" : std::string(" [") + info.unit + "]"));
  }
  return json.Raw("labels", labels.Done()).Done();
}

}  // namespace fulcrum::console
