// Process exit codes of every Fulcrum program (contract 7 of the architecture page).
#pragma once

namespace fulcrum {

enum class ExitCode : int {
  kDone = 0,
  kFailure = 1,     ///< Any failure without a code of its own.
  kBadUsage = 2,    ///< Bad command line or configuration.
  kMismatch = 3,    ///< Scene or schema mismatch.
  kDeviceLost = 4,  ///< A device is lost for good.
};

}  // namespace fulcrum
