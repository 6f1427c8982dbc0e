// scene_profiler FILE [--seconds S] [--threads N] [--json FILE]
#pragma once

#include <string>
#include <vector>

#include "services/base/core/exit_code.h"

namespace fulcrum::physics {

/// Profiles a compiled scene and prints figures and advice. kFailure: no preset is in time. Throws InputError for words
/// or a scene that it cannot use, MismatchError for a scene of another version.
[[nodiscard]] ExitCode ProfileCommand(const std::vector<std::string>& words);

}  // namespace fulcrum::physics
