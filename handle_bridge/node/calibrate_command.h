// `handle_bridge calibrate`: an operator holds a handle's jaw at known angles, the program stores the converter's
// codes.
#pragma once

namespace fulcrum::handle_bridge {

/// True if the command line calls the subcommand.
[[nodiscard]] bool IsCalibrateCommand(int argc, const char* const* argv);
/// main() of the subcommand: prompts on stdout, one line (Enter) per point from stdin. Returns the exit code.
[[nodiscard]] int CalibrateMain(int argc, const char* const* argv);

}  // namespace fulcrum::handle_bridge
