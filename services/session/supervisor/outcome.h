// How a session ended, and its figures as flat JSON and as a table for the terminal.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "services/base/core/exit_code.h"
#include "services/session/assessment/score.h"
#include "services/session/supervisor/session_record.h"
#include "services/session/supervisor/verdict.h"
#include "services/session/supervisor/video.h"

namespace fulcrum::supervisor {

/// Measures and score of an assessed session.
struct ScoreSheet {
  assessment::Figures figures;
  assessment::Score score;
};

struct SessionOutcome {
  std::string scene_name;
  std::string session_id;
  std::string started_utc;          ///< "2024-05-01 12:34:56 UTC".
  std::string machine;              ///< CPU model and count.
  std::string configuration;        ///< Effective configuration, YAML.
  std::vector<NodeId> nodes;        ///< Nodes of the session, in the order of their start.
  std::vector<std::string> solids;  ///< Names of the scene's solids; empty: it has one organ.
  double duration_s = 0;            ///< Session time reached [s].
  double wanted_s = 0;              ///< Session time requested [s]; 0: until stopped.
  ExitCode exit_code = ExitCode::kDone;
  /// First recording of all topics; each restart of the recorder adds a file beside it, "-2" and so on. Empty: none.
  std::filesystem::path recording;
  SessionVideo video;
  std::filesystem::path cut_map;     ///< Picture of what was cut; empty: no recording, or nothing cut.
  std::optional<ScoreSheet> sheet;   ///< None: the scene has no section `assessment`.
  std::string trainee;               ///< Empty: not named.
  std::vector<std::string> notices;  ///< What the operator must know of this session, one line each.
  std::vector<Fault> faults;         ///< Empty: all well.

  /// All faults in one line; empty: all well.
  [[nodiscard]] std::string verdict() const;
};

/// A named figure of a session. Table, JSON and report all use this list.
struct KeyFigure {
  std::string key;    ///< Key in summary.json.
  std::string label;  ///< Label in table and report.
  const char* unit;
  int decimals;
  double value;
};
/// Figures of the nodes that reported, and what was burnt of each solid.
[[nodiscard]] std::vector<KeyFigure> KeyFigures(const SessionOutcome& outcome, const SessionRecord& record);

/// Text on the samples that are missing from the recording: "no sample lost" or a count, and the recorder's restarts.
[[nodiscard]] std::string RecordingLosses(const SessionRecord& record);

/// Flat JSON object; the keys are documented in services/session/supervisor/DESIGN.md.
[[nodiscard]] std::string SummaryJson(const SessionOutcome& outcome, const SessionRecord& record);

/// Node table, key figures, restarts and verdict.
[[nodiscard]] std::string FinalTable(const SessionOutcome& outcome, const SessionRecord& record);

/// `value` with a fixed number of decimals, and 0 instead of "-0".
[[nodiscard]] std::string Fixed(double value, int decimals);

}  // namespace fulcrum::supervisor
