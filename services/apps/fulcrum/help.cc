#include <algorithm>
#include <cstdio>
#include <string_view>

#include "services/apps/fulcrum/commands.h"

namespace fulcrum::supervisor::cli {
namespace {

void PrintCommands() {
  std::puts("usage: fulcrum COMMAND [options]\n\nRuns and supervises a Fulcrum cart.\n");
  std::size_t width = 0;
  for (const CommandEntry& entry : Commands()) {
    width = std::max(width, std::string_view(entry.name).size());
  }
  // help2man makes a list of lines that have two spaces behind the name.
  for (const CommandEntry& entry : Commands()) {
    std::printf("  %-*s  %s\n", static_cast<int>(width), entry.name, entry.purpose);
  }
  std::puts(
      "\nfulcrum PROGRAM ... runs another program of the installation with its own options (--help):\n"
      "handle_bridge calibrate, haptics_node calibrate-trocar, replayer, scene_compiler, or a node.\n\n"
      "Exit codes: 0 done, 1 failure, 2 bad use or configuration, 3 scene or schema mismatch, 4 device lost.");
}

}  // namespace

ExitCode Help(const Words& words) {
  if (words.empty()) {
    PrintCommands();
    return ExitCode::kDone;
  }
  if (words[0] != "--help") {
    return Dispatch({words[0], "--help"});
  }
  (void)Parse("help", words, {});
  return ExitCode::kDone;
}

}  // namespace fulcrum::supervisor::cli
