// A replay that is led by hand: go, pause, step, seek.
#pragma once

#include <iosfwd>

#include "services/apps/replayer/lock_step.h"
#include "services/base/config/cart.h"
#include "services/base/core/scene_view.h"

namespace fulcrum::replay {

/// Reads commands, a line each, from standard input and answers on standard output; a line that comes while it runs
/// pauses it. `settings.rate` paces "go" (0: as fast as it can). Returns the exit code: 0 when every state was the same
/// that was compared last, 1 when one differed. The process must have one thread.
int RunConsole(const LockStepSettings& settings, const SceneView& scene, const config::CartConfig& cart);

/// What the commands are.
void PrintConsoleHelp(std::ostream& out);

}  // namespace fulcrum::replay
