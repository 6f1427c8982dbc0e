// Threads that draw, and their priority relative to the solvers.
#pragma once

#include <span>
#include <vector>

namespace fulcrum::render {

/// Thread ids of all threads of this process.
[[nodiscard]] std::vector<int> ThreadsOfProcess();

/// Lowers the priority of these threads and of threads that they start later. Logs a warning if that is not permitted.
void LowerPriority(std::span<const int> threads);

}  // namespace fulcrum::render
