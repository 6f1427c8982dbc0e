// Cost of keys and encryption for a session, against an open bus.
#pragma once

#include <filesystem>
#include <string>

#include "tests/benchmark/report.h"

namespace fulcrum {

/// Adds guard.keys_start_extra_ms_p50, guard.rate_change_pct and guard.encrypted_rate_change_pct.
/// @param scratch folder for keys. @return empty, or what went wrong.
[[nodiscard]] std::string MeasureKeysCost(const std::filesystem::path& scratch, benchmark::Report* report);

}  // namespace fulcrum
