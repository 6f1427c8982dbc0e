// The end of a session: its verdict, and the files with its results.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "services/session/supervisor/outcome.h"
#include "services/session/supervisor/session_nodes.h"
#include "services/session/supervisor/session_record.h"
#include "services/session/supervisor/session_setup.h"
#include "services/session/supervisor/verdict.h"

namespace fulcrum::supervisor {

/// The rules for the verdict of this session.
[[nodiscard]] Verdict::Session VerdictSession(const SessionSetup& setup);

/// The verdict at the end, when the nodes have ended: beside what was found while the session ran, a node that never
/// reported, a rate, or an effect that is missing although the script demands it up to session time `reached_s` [s].
void Judge(const SessionSetup& setup, const SessionNodes& nodes, const SessionRecord& record, double reached_s,
           Verdict* verdict);

struct SessionResults {
  SessionOutcome outcome;
  std::string text;  ///< Table, verdict and path of the report, for the terminal.
};

/// Writes assessment.json, the row of the trainees' database, summary.json, the cut map and report.html.
/// @param sheet score sheet of an assessed session.
/// @param verdict is failed when a file or the row cannot be written; the files then say so, as far as they can be.
[[nodiscard]] SessionResults WriteResults(SessionSetup* setup, const SessionRecord& record, double reached_s,
                                          const std::optional<ScoreSheet>& sheet, Verdict* verdict);

/// Whether the session gets a video: it was recorded and has pictures.
[[nodiscard]] bool HasVideo(const SessionSetup& setup);

/// Draws the video and writes the report again, with it. Returns a line for the terminal.
/// @param goes_on called every few milliseconds; false leaves the video out.
[[nodiscard]] std::string AddVideo(const SessionSetup& setup, const SessionRecord& record,
                                   const std::function<bool()>& goes_on, SessionResults* results, Verdict* verdict);

}  // namespace fulcrum::supervisor
