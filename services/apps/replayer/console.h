// A replay that is controlled by commands: go, pause, step, seek.
#pragma once

#include <iosfwd>

#include "services/apps/replayer/lock_step.h"
#include "services/base/config/cart.h"
#include "services/base/core/scene_view.h"

namespace fulcrum::replay {

/// Reads commands, one per line, from standard input and writes replies to standard output. A line that arrives during
/// "go" pauses it, except at full speed where standard input is no terminal. `settings.rate` is the speed of "go" (0:
/// as fast as possible). Returns the exit code: 0 when the last compared state of each node was equal, 1 when one
/// differed. The process must have one thread.
int RunConsole(const LockStepSettings& settings, const SceneView& scene, const config::CartConfig& cart);

/// Prints the list of commands.
void PrintConsoleHelp(std::ostream& out);

}  // namespace fulcrum::replay
