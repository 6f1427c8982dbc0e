#include "services/session/supervisor/session_end.h"

#include <cstdint>
#include <exception>
#include <filesystem>

#include "services/base/core/error.h"
#include "services/records/log_tools/merge.h"
#include "services/session/supervisor/cut_map_file.h"
#include "services/session/supervisor/report.h"
#include "services/session/supervisor/score_sheet.h"
#include "services/session/supervisor/script_outlook.h"
#include "services/session/supervisor/session_folder.h"
#include "services/session/supervisor/training_log.h"
#include "services/session/supervisor/video.h"

namespace fulcrum::supervisor {
namespace {

SessionOutcome OutcomeOf(const SessionSetup& setup, double reached_s) {
  SessionOutcome outcome;
  outcome.scene_name = setup.scene.view().name;
  outcome.session_id = setup.folder.session_id;
  outcome.started_utc = setup.folder.started_utc;
  outcome.machine = DescribeMachine();
  outcome.configuration = setup.folder.configuration;
  outcome.nodes = setup.node_ids;
  outcome.nodes.insert(outcome.nodes.end(), setup.remote_ids.begin(), setup.remote_ids.end());
  for (const Solid& solid : setup.scene.view().solids) outcome.solids.emplace_back(solid.name);
  outcome.duration_s = reached_s;
  outcome.wanted_s = setup.end_s;
  outcome.recording = setup.recording;
  outcome.trainee = setup.settings.trainee;
  outcome.notices = setup.notices;
  return outcome;
}

void SetVerdict(const Verdict& verdict, SessionOutcome* outcome) {
  outcome->exit_code = verdict.code();
  outcome->faults = verdict.faults();
}

/// Calls `write`; what cannot be written fails the verdict.
template <class Write>
void Try(double time_s, Verdict* verdict, const Write& write) {
  try {
    write();
  } catch (const std::exception& error) {
    verdict->Fail(time_s, ExitCode::kFailure, error.what());
  }
}

/// Joins the files of a recorder that was restarted.
log_tools::JoinResult JoinRecordings(const SessionSetup& setup) {
  if (setup.recording.empty()) return {};
  const auto keep_free_B = static_cast<std::uint64_t>(1e6 * setup.settings.cart.recorder.keep_free_MB);
  return log_tools::JoinSegments(setup.recording, keep_free_B);
}

void WriteReport(const SessionSetup& setup, const SessionRecord& record, SessionOutcome* outcome, Verdict* verdict) {
  const SessionFolder& folder = setup.folder;
  // Written again when one of them cannot be written, so that the other one says so.
  std::size_t known = 0;
  do {
    known = verdict->faults().size();
    SetVerdict(*verdict, outcome);
    const double reached_s = outcome->duration_s;
    Try(reached_s, verdict,
        [&] { WriteFile(folder.path / "report.html", ReportHtml(*outcome, record, folder.frames)); });
    Try(reached_s, verdict, [&] { WriteFile(folder.path / "summary.json", SummaryJson(*outcome, record)); });
  } while (verdict->faults().size() != known);
}

/// A path as a word of a shell.
std::string Quoted(const std::filesystem::path& path) { return "'" + path.string() + "'"; }

}  // namespace

Verdict::Session VerdictSession(const SessionSetup& setup) {
  return {setup.node_ids, setup.remote_ids, setup.settings.cart.verdict.restarts};
}

void Judge(const SessionSetup& setup, const SessionNodes& nodes, const SessionRecord& record, double reached_s,
           Verdict* verdict) {
  verdict->Close(reached_s, record);
  const auto fail = [&](const std::string& why) { verdict->Fail(reached_s, ExitCode::kFailure, why); };
  for (const auto& node : nodes.all()) {
    if (!record.node(node->id()).seen) fail(std::string(NodeName(node->id())) + " never reported; see " + node->log());
  }
  for (const NodeId node : setup.remote_ids) {
    if (!record.node(node).seen) {
      fail(std::string(NodeName(node)) + " on " + setup.settings.peer +
           " never reported; does `fulcrum host` run there, with this machine as its --peer, in link domain " +
           std::to_string(setup.settings.link_domain) + "?");
    }
  }
  const ScriptDemands demands =
      PossibleDemands(DemandsUntil(setup.scene.view(), reached_s), setup.scene.view().node_mask, setup.settings.cart);
  if (const std::string missing = MissingFrom(record, demands); !missing.empty()) fail(missing);
}

SessionResults WriteResults(SessionSetup* setup, const SessionRecord& record, double reached_s,
                            const std::optional<ScoreSheet>& sheet, Verdict* verdict) {
  const SessionFolder& folder = setup->folder;
  SessionResults results{OutcomeOf(*setup, reached_s), {}};
  SessionOutcome& outcome = results.outcome;
  outcome.sheet = sheet;
  if (sheet) {
    Try(reached_s, verdict, [&] {
      WriteFile(folder.path / "assessment.json",
                SheetJson(*sheet, {outcome.scene_name, outcome.session_id, outcome.trainee, outcome.started_utc}));
    });
  }
  if (sheet && setup->training) {
    SetVerdict(*verdict, &outcome);
    // Without the row the figures are still in assessment.json.
    Try(reached_s, verdict, [&] { setup->training->Add(TrainingRowOf(outcome)); });
  }
  log_tools::JoinResult joined;
  Try(reached_s, verdict, [&] { joined = JoinRecordings(*setup); });
  outcome.video.is_part = !joined.whole;
  if (!joined.said.empty()) joined.said += "\n";
  Try(reached_s, verdict, [&] { outcome.cut_map = WriteCutMap(setup->recording, setup->scene.view(), folder.path); });
  WriteReport(*setup, record, &outcome, verdict);
  results.text = "\n" + FinalTable(outcome, record) + joined.said + "report: " + (folder.path / "report.html").string();
  return results;
}

bool HasVideo(const SessionSetup& setup) {
  const bool drawn = (setup.scene.view().node_mask >> static_cast<unsigned>(NodeId::kRender) & 1u) != 0;
  return !setup.recording.empty() && setup.settings.video && drawn;
}

std::string AddVideo(const SessionSetup& setup, const SessionRecord& record, const std::function<bool()>& goes_on,
                     SessionResults* results, Verdict* verdict) {
  SessionVideo& video = results->outcome.video;
  const bool is_part = video.is_part;
  const std::filesystem::path scene = setup.folder.path / "scene.fulcrum";
  video = MakeVideo({.replayer = setup.settings.programs / "replayer",
                     .recording = setup.recording,
                     .scene = scene,
                     .video = setup.folder.path / "video.mp4",
                     .log = setup.folder.logs / "video.log"},
                    goes_on);
  video.command = "fulcrum log video " + Quoted(setup.recording) + " --scene " + Quoted(scene);
  video.is_part = is_part;
  WriteReport(setup, record, &results->outcome, verdict);
  return video.file.empty() ? "no video: " + video.missing : "video: " + video.file.string();
}

}  // namespace fulcrum::supervisor
