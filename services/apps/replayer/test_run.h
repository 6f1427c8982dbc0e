// replayer --test: one node headless against a recording, with a report for people and for a CI system.
#pragma once

#include "services/apps/replayer/options.h"

namespace fulcrum::replay {

/// Prints the result and writes it to `options.junit`. Returns the exit code: 0 passed, 1 failed. What keeps the test
/// from being made is written there, too, and thrown: InputError, MismatchError, std::runtime_error.
int RunTest(const Options& options);

}  // namespace fulcrum::replay
