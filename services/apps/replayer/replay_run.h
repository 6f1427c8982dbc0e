// replayer --into: nodes make the session again, as it was or with a parameter changed, at once or led by hand.
#pragma once

#include "services/apps/replayer/options.h"

namespace fulcrum::replay {

/// Prints the result and writes it to `options.json`. Returns the exit code: 0 when every state was the same, 1 when
/// one differed or the recording lacks something. Throws InputError, MismatchError, std::runtime_error.
int RunReplay(const Options& options);

}  // namespace fulcrum::replay
