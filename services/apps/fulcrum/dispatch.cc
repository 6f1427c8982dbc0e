// Selection of the subcommand or program that the command line names.
#include <cstdio>

#include "services/apps/fulcrum/commands.h"
#include "services/base/core/error.h"
#include "services/nodes/app/version.h"

namespace fulcrum::supervisor::cli {
namespace {

void PrintHelp() {
  std::puts("usage: fulcrum COMMAND [options]\n\nRuns and supervises a Fulcrum cart.\n");
  for (const CommandEntry& entry : Commands()) {
    std::printf("  %-9s %s\n", entry.name, entry.purpose);
  }
  std::puts(
      "  help      help COMMAND: print the options of one command.\n"
      "  version   Print the version.\n\n"
      "fulcrum PROGRAM ... runs another program of the installation with its own options (--help):\n"
      "  handle_bridge calibrate, haptics_node calibrate-trocar, replayer, scene_compiler, or a node.\n\n"
      "Exit codes: 0 done, 1 failure, 2 bad use or configuration, 3 scene or schema mismatch, 4 device lost.");
}

}  // namespace

ExitCode Dispatch(Words words) {
  if (words.empty() || words[0] == "--help" || words == Words{"help"}) {
    PrintHelp();
    return words.empty() ? ExitCode::kBadUsage : ExitCode::kDone;
  }
  if (words[0] == "version" || words[0] == "--version") {
    std::printf("fulcrum %s\n", app::kVersion);
    return ExitCode::kDone;
  }
  if (words[0] == "help") {
    words = {words[1], "--help"};
  }
  for (const CommandEntry& entry : Commands()) {
    if (words[0] == entry.name) {
      return entry.run({words.begin() + 1, words.end()});
    }
  }
  if (IsProgram(words[0])) {
    Become(words);
  }
  throw InputError("unknown command \"" + words[0] + "\"; fulcrum --help lists the valid ones");
}

}  // namespace fulcrum::supervisor::cli
