// Where session folders name a trainee: in assessment.json and report.html, the only files that the supervisor writes
// the name to.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace fulcrum::supervisor {

/// Files of the session folders in `out` that name the trainee, in order. A folder that does not exist has none.
[[nodiscard]] std::vector<std::filesystem::path> FindTraces(const std::filesystem::path& out,
                                                            const std::string& trainee);

/// Removes the name from a file of FindTraces; all else stays. Throws InputError.
void RemoveName(const std::filesystem::path& file, const std::string& trainee);

}  // namespace fulcrum::supervisor
