// What the page shows now, as JSON. The names of its fields are those of services/session/console/DESIGN.md.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "services/session/console/guided_task.h"
#include "services/session/console/session_run.h"
#include "services/session/console/session_watch.h"

namespace fulcrum::console {

/// The answer to the last request that took its time.
struct Notice {
  std::uint64_t number = 0;  ///< 0: none yet.
  bool ok = true;
  std::string text;
};

struct LiveState {
  std::int64_t now_ns = 0;
  const SessionWatch* watch = nullptr;
  const SessionRun* run = nullptr;
  const GuidedTask* task = nullptr;  ///< nullptr: none yet.
  std::string session;               ///< That runs or ran last; empty: none.
  std::string picture;               ///< Newest; empty: none.
  bool has_report = false;
  Notice notice;
};

/// One JSON object in one line. Plot points after number `*cursor` are in it, and `*cursor` is moved on.
[[nodiscard]] std::string LiveJson(const LiveState& state, std::uint64_t* cursor);

}  // namespace fulcrum::console
