// fulcrum: the operator's command.
#include <array>
#include <cstdio>
#include <cstring>

#include "services/apps/fulcrum/commands.h"
#include "services/base/core/error.h"
#include "services/base/runtime/realtime.h"
#include "services/nodes/app/version.h"

namespace fulcrum::supervisor::cli {

std::span<const CommandEntry> Commands() {
  static constexpr auto kCommands = std::to_array<CommandEntry>({
      {"up", "up SCENE [options]", "Run a session: compile the scene if need be, start its nodes, watch, report.", Up},
      {"console", "console [options]",
       "Serve the page of the cart's touch screen: start, watch, stop, calibrate, replay.", Console},
      {"host", "host --peer ADDR [options]", "Run nodes of a cart that is on another machine, one session.", Host},
      {"status", "status [--domain N]", "Print the nodes of the running session once.", Status},
      {"top", "top [--domain N]", "Show the nodes of the running session, refreshed until Ctrl-C.", Top},
      {"restart", "restart NODE [--domain N]", "Restart one node of the running session.", Restart},
      {"swap", "swap NODE --with COMMAND [--domain N]",
       "Replace a node of the running session by another build, or by a recording.", Swap},
      {"down", "down [--domain N]", "End the running session.", Down},
      {"dump", "dump [--domain N]",
       "Write the newest seconds of the running session into a file (fulcrum up --keep-last).", Dump},
      {"generator", "generator [--cut W] [--coag W] [--blend W] [--domain N]",
       "Set the power of the generator of the running session; without options: show it.", Generator},
      {"log", "log TOOL FILE...", "Read recordings: info, list, cat, export, verify, diff, recover.", Log},
      {"test-node", "test-node NODE --inputs LOG [--expect HASH] [--assert EXPR]... [--junit FILE]",
       "Run one node headless against a recording, for QA and CI.", TestNode},
      {"soak", "soak SCENE [--minutes N] [--chaos]",
       "Run a session for long, under blows if asked for: what grows, drifts, ends?", Soak},
      {"keys", "keys init|show|check [DIR] [--days N] [--force]",
       "Make and check the keys of a secured cart: who may join, and write and read what.", Keys},
      {"assess", "assess RECORDING [--scene FILE] [--json FILE]",
       "Score a recorded session, as it was scored while it lasted.", Assess},
      {"trainee", "trainee [NAME] [--scene NAME] [--svg FILE] [--database FILE]",
       "A trainee's sessions (fulcrum up --trainee) as a table and plots; without a name: who there is.", Trainee},
      {"doctor", "doctor [--domain N] [--out DIR]", "Check what this machine permits, and say how to permit more.",
       Doctor},
      {"reference", "reference cart|scene FILE...", "Print every key of cart or scene files, with what is valid.",
       Reference},
  });
  return kCommands;
}

namespace {

void PrintHelp() {
  std::puts("usage: fulcrum COMMAND [options]\n\nRuns and watches a Fulcrum cart.\n");
  for (const CommandEntry& entry : Commands()) {
    std::printf("  %-9s %s\n", entry.name, entry.purpose);
  }
  std::puts(
      "  help      help COMMAND: options of one command.\n"
      "  version   Print the version.\n\n"
      "fulcrum PROGRAM ... runs another program of the installation with its own options (--help):\n"
      "  handle_bridge calibrate, haptics_node calibrate-trocar, replayer, scene_compiler, or a node.\n\n"
      "Exit codes: 0 done, 1 failure, 2 bad use or configuration, 3 scene or schema mismatch, 4 device lost.");
}

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
  throw InputError("unknown command \"" + words[0] + "\"; see fulcrum --help");
}

}  // namespace
}  // namespace fulcrum::supervisor::cli

int main(int argc, char** argv) {
  using fulcrum::ExitCode;
  fulcrum::runtime::SetLogName("fulcrum");
  fulcrum::runtime::InstallStopSignals();
  const auto fail = [](ExitCode code, const std::exception& error) {
    std::fprintf(stderr, "fulcrum: %s\n", error.what());
    return static_cast<int>(code);
  };
  try {
    return static_cast<int>(fulcrum::supervisor::cli::Dispatch({argv + 1, argv + argc}));
  } catch (const fulcrum::InputError& error) {
    return fail(ExitCode::kBadUsage, error);
  } catch (const fulcrum::MismatchError& error) {
    return fail(ExitCode::kMismatch, error);
  } catch (const std::exception& error) {
    return fail(ExitCode::kFailure, error);
  }
}
