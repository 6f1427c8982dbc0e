// The end of a session: whether it went well, and the files that say what came of it.
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

  /// The first cause counts.
  void Fail(ExitCode cause, const std::string& reason) {
    if (code == ExitCode::kDone) {
      code = cause;
      why = reason;
    }
  }
};

/// Judges a session once its nodes have ended: a node that failed for good, one that never reported, what the script
/// demands up to session time `reached_s` [s] and did not bring about.
void Judge(const SessionSetup& setup, const SessionNodes& nodes, const SessionRecord& record, double reached_s,
           Verdict* verdict);

/// Writes assessment.json, the row of the trainees' database, summary.json, the cut map, the clip and report.html.
/// Throws InputError when a file cannot be written.
/// @param sheet of an assessed session.
/// @param verdict fails when the row cannot be added.
/// @return table, verdict and place of the report, for the terminal.
[[nodiscard]] std::string WriteResults(SessionSetup* setup, const SessionRecord& record, double reached_s,
                                       const std::optional<ScoreSheet>& sheet, Verdict* verdict);

}  // namespace fulcrum::supervisor
