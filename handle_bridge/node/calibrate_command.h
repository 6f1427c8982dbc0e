// `handle_bridge calibrate`: an operator holds a handle's jaw at known angles, the bridge stores what the converter
// says.
#pragma once

namespace fulcrum::handle_bridge {

/// True when the command line asks for it.
[[nodiscard]] bool IsCalibrateCommand(int argc, const char* const* argv);
/// main() of the subcommand: prompts on stdout, one line (Enter) per point from stdin. Returns the exit code.
[[nodiscard]] int CalibrateMain(int argc, const char* const* argv);

}  // namespace fulcrum::handle_bridge
