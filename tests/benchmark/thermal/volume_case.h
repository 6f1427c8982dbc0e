// Time and error of the tissue beneath the sheet, and what it costs a frame.
#pragma once

#include "tests/benchmark/report.h"

namespace fulcrum::thermal {

void BenchmarkVolume(benchmark::Report* report);

}  // namespace fulcrum::thermal
