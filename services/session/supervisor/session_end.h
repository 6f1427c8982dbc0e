// The end of a session: its verdict, and the files with its results.
#pragma once

#include <optional>
#include <string>

#include "services/base/core/exit_code.h"
#include "services/session/supervisor/outcome.h"
#include "services/session/supervisor/session_nodes.h"
#include "services/session/supervisor/session_record.h"
#include "services/session/supervisor/session_setup.h"

namespace fulcrum::supervisor {

/// Whether a session went well.
struct Verdict {
  ExitCode code = ExitCode::kDone;
  std::string why;  ///< One line; empty: all well.

  /// Records a failure; only the first one is kept.
  void Fail(ExitCode cause, const std::string& reason) {
    if (code == ExitCode::kDone) {
      code = cause;
      why = reason;
    }
  }
};

/// Fails the verdict of a session whose nodes have ended when a node failed for good, when a node never reported, or
/// when an effect is missing that the script demands up to session time `reached_s` [s].
void Judge(const SessionSetup& setup, const SessionNodes& nodes, const SessionRecord& record, double reached_s,
           Verdict* verdict);

/// Writes assessment.json, the row of the trainees' database, summary.json, the cut map, the clip and report.html.
/// Throws InputError when a file cannot be written.
/// @param sheet score sheet of an assessed session.
/// @param verdict is failed when the row cannot be added.
/// @return table, verdict and path of the report, for the terminal.
[[nodiscard]] std::string WriteResults(SessionSetup* setup, const SessionRecord& record, double reached_s,
                                       const std::optional<ScoreSheet>& sheet, Verdict* verdict);

}  // namespace fulcrum::supervisor
