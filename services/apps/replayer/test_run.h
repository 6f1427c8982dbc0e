// replayer --test: test of one node against a recording, with a report as text and for a CI system.
#pragma once

#include "services/apps/replayer/options.h"

namespace fulcrum::replay {

/// Prints the result and writes it to `options.junit`. Returns the exit code: 0 passed, 1 failed. An error that
/// prevents the test is also written there and then thrown: InputError, MismatchError, std::runtime_error.
int RunTest(const Options& options);

}  // namespace fulcrum::replay
