// The replayer on a recording, as a developer runs it.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace fulcrum::testing {

struct ReplayRun {
  int exit_code = -1;
  std::string said;
  std::map<std::string, double> figures;  ///< Numeric values of its --json output.
};

/// Runs bin/replayer RECORDING with `arguments`; it is killed after `limit_s`.
[[nodiscard]] ReplayRun Replay(const std::filesystem::path& recording, const std::vector<std::string>& arguments,
                               double limit_s);

}  // namespace fulcrum::testing
