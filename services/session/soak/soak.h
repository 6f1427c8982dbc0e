// A long session under watch, and under blows if asked for: does anything grow, drift, end or say nonsense?
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "services/base/core/exit_code.h"
#include "services/session/soak/soak_record.h"

namespace fulcrum::soak {

struct SoakSettings {
  std::filesystem::path scene;    ///< Compiled.
  std::filesystem::path program;  ///< fulcrum
  std::filesystem::path out;      ///< A folder for this soak is made in here.
  std::vector<std::string> up;    ///< Further words for `fulcrum up`.
  int domain = 7;
  double minutes = 10;
  bool chaos = false;
  std::uint32_t seed = 1;
  Limits limits;
};

/// Runs the session as a child, says each minute how it is, and writes soak.json, soak.html and samples.csv. The nodes'
/// blows end a third before the end, so that what does not heal is seen. kFailure when a limit is passed. Throws
/// InputError. Call from the main thread.
[[nodiscard]] ExitCode RunSoak(const SoakSettings& settings);

}  // namespace fulcrum::soak
