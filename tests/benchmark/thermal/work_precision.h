// Steppers of the heat equation against each other: run time and error on the moving Gaussian.
#pragma once

#include "tests/benchmark/report.h"

namespace fulcrum::thermal {

/// Prints thermal.work_precision.* and, when all methods ran, draws thermal_work_precision.svg into FULCRUM_BENCH_OUT.
void WorkPrecision(benchmark::Report* report);

}  // namespace fulcrum::thermal
