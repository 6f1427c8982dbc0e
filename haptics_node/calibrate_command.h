// The subcommand `haptics_node calibrate-trocar`.
#pragma once

namespace fulcrum::haptics {

/// True if the command line calls the subcommand.
[[nodiscard]] bool IsCalibrateCommand(int argc, const char* const* argv);
/// main() of the subcommand; returns the exit code.
[[nodiscard]] int CalibrateMain(int argc, const char* const* argv);

}  // namespace fulcrum::haptics
