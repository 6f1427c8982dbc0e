// The threads that draw, and their priority against the solvers'.
#pragma once

#include <span>
#include <vector>

namespace fulcrum::render {

/// Numbers of all threads of this process.
[[nodiscard]] std::vector<int> ThreadsOfProcess();

/// Lowers the priority of these threads and of those that they start from now on. Logs a warning when that is not
/// permitted.
void LowerPriority(std::span<const int> threads);

}  // namespace fulcrum::render
