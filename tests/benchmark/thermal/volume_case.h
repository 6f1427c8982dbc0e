// Run time and error of the tissue beneath the sheet, and its share of a frame.
#pragma once

#include "tests/benchmark/report.h"

namespace fulcrum::thermal {

void BenchmarkVolume(benchmark::Report* report);

}  // namespace fulcrum::thermal
