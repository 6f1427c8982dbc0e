// The paper's model beside the accurate one.
#pragma once

#include "tests/benchmark/report.h"

namespace fulcrum::thermal {

/// Prints thermal.paper.*; with FULCRUM_PICTURES=DIR it leaves both models' pictures of one cut there.
void PaperCases(benchmark::Report* report);

}  // namespace fulcrum::thermal
