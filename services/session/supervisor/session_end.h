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

struct Wait {
  std::function<void(const std::string&)> say;  ///< Prints a line.
  /// Called every few milliseconds; false leaves the video out.
  std::function<bool()> goes_on;
};

/// Writes assessment.json, the row of the trainees' database, summary.json, the cut map, the video and report.html.
/// @param sheet score sheet of an assessed session.
/// @param verdict is failed when a file or the row cannot be written; the files then say so, as far as they can be.
/// @param wait what happens while the video is drawn.
/// @return table, verdict and path of the report, for the terminal.
[[nodiscard]] std::string WriteResults(SessionSetup* setup, const SessionRecord& record, double reached_s,
                                       const std::optional<ScoreSheet>& sheet, Verdict* verdict, const Wait& wait);

}  // namespace fulcrum::supervisor
