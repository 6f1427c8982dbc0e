#include "services/session/supervisor/session_end.h"

#include <filesystem>

#include "services/base/core/error.h"
#include "services/session/supervisor/clip.h"
#include "services/session/supervisor/cut_map_file.h"
#include "services/session/supervisor/report.h"
#include "services/session/supervisor/score_sheet.h"
#include "services/session/supervisor/script_outlook.h"
#include "services/session/supervisor/session_folder.h"
#include "services/session/supervisor/training_log.h"

namespace fulcrum::supervisor {
namespace {

SessionOutcome OutcomeOf(const SessionSetup& setup, double reached_s, const Verdict& verdict) {
  SessionOutcome outcome;
  outcome.scene_name = setup.scene.view().name;
  outcome.session_id = setup.folder.session_id;
  outcome.started_utc = setup.folder.started_utc;
  outcome.machine = DescribeMachine();
  outcome.configuration = setup.folder.configuration;
  outcome.nodes = setup.node_ids;
  outcome.nodes.insert(outcome.nodes.end(), setup.remote_ids.begin(), setup.remote_ids.end());
  outcome.duration_s = reached_s;
  outcome.wanted_s = setup.end_s;
  outcome.exit_code = verdict.code;
  outcome.verdict = verdict.why;
  outcome.recording = setup.recording;
  outcome.trainee = setup.settings.trainee;
  return outcome;
}

/// Adds a row to the trainees' database. Without the row the figures are still in assessment.json.
void AddRow(TrainingLog* training, SessionOutcome* outcome, Verdict* verdict) {
  try {
    training->Add(TrainingRowOf(*outcome));
  } catch (const InputError& error) {
    verdict->Fail(ExitCode::kFailure, error.what());
    outcome->exit_code = verdict->code;
    outcome->verdict = verdict->why;
  }
}

}  // namespace

void Judge(const SessionSetup& setup, const SessionNodes& nodes, const SessionRecord& record, double reached_s,
           Verdict* verdict) {
  if (const SessionNodes::Failure& failure = nodes.failure(); failure.code != ExitCode::kDone) {
    verdict->Fail(failure.code, failure.why);
  }
  for (const auto& node : nodes.all()) {
    if (!record.node(node->id()).seen) {
      verdict->Fail(ExitCode::kFailure, std::string(NodeName(node->id())) + " never reported; see " + node->log());
    }
  }
  for (const NodeId node : setup.remote_ids) {
    if (!record.node(node).seen) {
      verdict->Fail(ExitCode::kFailure,
                    std::string(NodeName(node)) + " on " + setup.settings.peer +
                        " never reported; does `fulcrum host` run there, with this machine as its --peer?");
    }
  }
  if (const std::string missing = MissingFrom(record, DemandsUntil(setup.scene.view(), reached_s)); !missing.empty()) {
    verdict->Fail(ExitCode::kFailure, missing);
  }
}

std::string WriteResults(SessionSetup* setup, const SessionRecord& record, double reached_s,
                         const std::optional<ScoreSheet>& sheet, Verdict* verdict) {
  const SessionFolder& folder = setup->folder;
  SessionOutcome outcome = OutcomeOf(*setup, reached_s, *verdict);
  if (sheet) {
    outcome.sheet = sheet;
    WriteFile(folder.path / "assessment.json",
              SheetJson(*sheet, {outcome.scene_name, outcome.session_id, outcome.trainee, outcome.started_utc}));
    if (setup->training) AddRow(&*setup->training, &outcome, verdict);
  }
  WriteFile(folder.path / "summary.json", SummaryJson(outcome, record));
  outcome.cut_map = WriteCutMap(setup->recording, setup->scene.view(), folder.path);
  const std::filesystem::path clip = folder.path / "clip.mp4";
  (void)MakeClip(folder.frames, clip, folder.logs / "clip.log");
  const std::filesystem::path report = folder.path / "report.html";
  WriteFile(report, ReportHtml(outcome, record, folder.frames, clip));
  return "\n" + FinalTable(outcome, record) + "report: " + report.string();
}

}  // namespace fulcrum::supervisor
