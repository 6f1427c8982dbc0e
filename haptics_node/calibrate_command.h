// The subcommand `haptics_node calibrate-trocar`.
#pragma once

namespace fulcrum::haptics {

/// True when the command line asks for it.
[[nodiscard]] bool IsCalibrateCommand(int argc, const char* const* argv);
/// main() of the subcommand: its exit code.
[[nodiscard]] int CalibrateMain(int argc, const char* const* argv);

}  // namespace fulcrum::haptics
