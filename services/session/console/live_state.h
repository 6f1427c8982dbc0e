// The present state of the page as JSON. services/session/console/DESIGN.md lists the fields.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "services/session/console/guided_task.h"
#include "services/session/console/session_run.h"
#include "services/session/console/session_watch.h"

namespace fulcrum::console {

/// Reply to the last request that was sent to the supervisor.
struct Notice {
  std::uint64_t number = 0;  ///< 0: none yet.
  bool ok = true;
  std::string text;
};

struct LiveState {
  std::int64_t now_ns = 0;
  const SessionWatch* watch = nullptr;
  const SessionRun* run = nullptr;
  const GuidedTask* task = nullptr;  ///< nullptr: no task was started yet.
  std::string session;               ///< Name of the running or last session; empty: none.
  std::string picture;               ///< Name of the newest picture; empty: none.
  std::uint64_t person_changes = 0;  ///< As of TrainingDesk.
  bool has_report = false;
  Notice notice;
};

/// One JSON object in one line. It contains the plot points after number `*cursor`, which is set to the last of them.
[[nodiscard]] std::string LiveJson(const LiveState& state, std::uint64_t* cursor);

}  // namespace fulcrum::console
