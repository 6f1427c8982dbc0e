// replayer --live: publishes the recording until its end or a stop signal.
#pragma once

#include "services/apps/replayer/live.h"

namespace fulcrum::replay {

/// Prints the counts of messages. Returns the exit code: 0 when at least one was published, else 1. Throws InputError.
int RunLive(const LiveSettings& settings);

}  // namespace fulcrum::replay
