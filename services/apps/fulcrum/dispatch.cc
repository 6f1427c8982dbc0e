// Selection of the subcommand or program that the command line names.
#include "services/apps/fulcrum/commands.h"
#include "services/base/core/error.h"

namespace fulcrum::supervisor::cli {

ExitCode Dispatch(const Words& words) {
  if (words.empty()) {
    Help({});
    return ExitCode::kBadUsage;
  }
  if (words[0] == "--help") {
    return Help({});
  }
  if (words[0] == "--version") {
    return Version({});
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
