// replayer --live: publishes the recording until its end or a stop signal.
#pragma once

#include "services/apps/replayer/live.h"

namespace fulcrum::replay {

/// Prints what was published. Returns the exit code: 0 when something was, else 1. Throws InputError.
int RunLive(const LiveSettings& settings);

}  // namespace fulcrum::replay
