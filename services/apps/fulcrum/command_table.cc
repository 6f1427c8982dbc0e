// Every subcommand with its help line, in the order in which the help shows them.
#include <array>

#include "services/apps/fulcrum/commands.h"

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
      {"help", "help [COMMAND]", "Print the commands, or the options of one.", Help},
      {"version", "version", "Print the version.", Version},
  });
  return kCommands;
}

}  // namespace fulcrum::supervisor::cli
