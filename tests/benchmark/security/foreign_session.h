// Effect of another session in the same domain on a session on an open bus.
#pragma once

#include <string>

#include "tests/benchmark/report.h"

namespace fulcrum {

/// Adds security.foreign_session_effect and security.foreign_samples. @return empty, or what went wrong.
[[nodiscard]] std::string MeasureForeignSession(benchmark::Report* report);

}  // namespace fulcrum
