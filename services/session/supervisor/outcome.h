// How a session ended, and its figures as flat JSON and as a table for the terminal.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "services/base/core/exit_code.h"
#include "services/session/assessment/score.h"
#include "services/session/supervisor/session_record.h"

namespace fulcrum::supervisor {

/// What an assessed session came to.
struct ScoreSheet {
  assessment::Figures figures;
  assessment::Score score;
};

struct SessionOutcome {
  std::string scene_name;
  std::string session_id;
  std::string started_utc;    ///< "2024-05-01 12:34:56 UTC".
  std::string machine;        ///< CPU model and count.
  std::string configuration;  ///< Effective configuration, YAML.
  std::vector<NodeId> nodes;  ///< Those that were started, in order.
  double duration_s = 0;      ///< Session time reached.
  double wanted_s = 0;        ///< Session time asked for; 0: until stopped.
  ExitCode exit_code = ExitCode::kDone;
  /// Of all topics; a recorder that was restarted has written another beside it, "-2" and so on. Empty: none.
  std::filesystem::path recording;
  std::filesystem::path cut_map;    ///< Picture of what was cut; empty: no recording, or nothing cut.
  std::optional<ScoreSheet> sheet;  ///< None: the scene has no section `assessment`.
  std::string trainee;              ///< Empty: not told.
  std::string verdict;              ///< Empty when all is well; else one line that says what is not.
};

/// The figures of a session by name: the one list that table, JSON and report take theirs from.
struct KeyFigure {
  const char* key;    ///< In summary.json.
  const char* label;  ///< For people.
  const char* unit;
  int decimals;
  double value;
};
/// Of the nodes that took part.
[[nodiscard]] std::vector<KeyFigure> KeyFigures(const SessionRecord& record);

/// "no sample lost" or how many, and whether the recorder was down.
[[nodiscard]] std::string RecordingLosses(const SessionRecord& record);

/// Flat JSON object; the keys are documented in services/session/supervisor/DESIGN.md.
[[nodiscard]] std::string SummaryJson(const SessionOutcome& outcome, const SessionRecord& record);

/// Node table, key figures, restarts and verdict.
[[nodiscard]] std::string FinalTable(const SessionOutcome& outcome, const SessionRecord& record);

/// printf for one number: fixed, without "-0".
[[nodiscard]] std::string Fixed(double value, int decimals);

}  // namespace fulcrum::supervisor
