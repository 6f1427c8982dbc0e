// The result of a lock-step replay as text and as JSON.
#pragma once

#include <filesystem>
#include <string>

#include "services/apps/replayer/lock_step.h"

namespace fulcrum::replay {

/// One line per node with its verdict, its first difference and missing data, then the speed.
[[nodiscard]] std::string ReportText(const LockStepResult& result);

/// One flat object: `same`, `speed_x_realtime`, `session_s`, and for each node `<node>.ticks`, `.compared`,
/// `.mismatches` (at most 1 when a node stops at its first), `.starts`, `.busy_s`, `.departure`, `.missing`. Throws
/// InputError when the file cannot be written.
void WriteReportJson(const LockStepResult& result, const std::filesystem::path& file);

}  // namespace fulcrum::replay
