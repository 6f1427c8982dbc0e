// What draws off screen on this machine, for `fulcrum doctor`.
#pragma once

#include <functional>

#include "services/base/core/exit_code.h"

namespace fulcrum::render {

/// Whether a command line asks for it: --graphics and nothing else.
[[nodiscard]] bool AsksForGraphics(int argc, char** argv);
/// Prints the device that a session would draw with, or on stderr why there is none.
/// @param confine called before a device is opened: confines the process as in a session.
ExitCode PrintGraphics(const std::function<void()>& confine);

}  // namespace fulcrum::render
