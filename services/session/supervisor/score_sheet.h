// The score sheet of an assessed session: as a table for the terminal, a section of the report, and JSON.
#pragma once

#include <string>

#include "services/session/supervisor/outcome.h"

namespace fulcrum::supervisor {

/// Table for the terminal.
[[nodiscard]] std::string SheetTable(const ScoreSheet& sheet);

/// Section of report.html. `trainee` may be empty.
[[nodiscard]] std::string SheetHtml(const ScoreSheet& sheet, const std::string& trainee);

/// assessment.json: flat, keys as in services/session/supervisor/DESIGN.md. `trainee` and `started_utc` may be empty.
struct SheetFacts {
  std::string scene, session, trainee, started_utc;
};
[[nodiscard]] std::string SheetJson(const ScoreSheet& sheet, const SheetFacts& facts);

}  // namespace fulcrum::supervisor
