// A soak: a long session, optionally with injected faults, that is checked for growth of memory, drift, crashes and
// invalid samples.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "services/base/config/cart.h"
#include "services/base/core/exit_code.h"
#include "services/session/soak/soak_record.h"

namespace fulcrum::soak {

struct SoakSettings {
  std::filesystem::path scene;    ///< Compiled scene file.
  std::filesystem::path program;  ///< Path of the program fulcrum.
  std::filesystem::path out;      ///< Folder in which the folder of this soak is made.
  std::vector<std::string> up;    ///< Further arguments of `fulcrum up`.
  config::CartConfig cart;
  int domain = config::DefaultDomain();
  double minutes = 10;
  bool chaos = false;
  std::uint32_t seed = 1;
  Limits limits;
};

/// Runs the session as a child, shows its progress, and writes soak.json, soak.html and samples.csv. The last third has
/// no blows, so that lasting damage is detected. Returns kFailure when a limit is exceeded. Throws InputError. Call
/// from the main thread.
[[nodiscard]] ExitCode RunSoak(const SoakSettings& settings);

}  // namespace fulcrum::soak
