// What keys of its own cost a session, against an open bus.
#pragma once

#include <string>

#include "tests/benchmark/report.h"

namespace fulcrum {

/// Adds guard.keys_start_extra_ms_p50 and guard.rate_change_pct. @return empty, or what went wrong.
[[nodiscard]] std::string MeasureKeysCost(benchmark::Report* report);

}  // namespace fulcrum
