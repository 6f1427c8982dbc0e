#pragma once

#include <filesystem>

#include "tests/benchmark/report.h"

namespace fulcrum::benchmark {

/// Adds import.anatomy_s, .hausdorff_voxels and .orientation_errors. Files go into `folder`.
void MeasureAnatomy(Report* report, const std::filesystem::path& folder);

}  // namespace fulcrum::benchmark
