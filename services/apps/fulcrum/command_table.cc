// All subcommands with their help texts, in the order in which the help lists them.
#include <array>

#include "services/apps/fulcrum/commands.h"

namespace fulcrum::supervisor::cli {

std::span<const CommandEntry> Commands() {
  static constexpr auto kCommands = std::to_array<CommandEntry>({
      {"up", "up SCENE [options]",
       "Run a session: compile the scene if needed, start and supervise its nodes, write a report.",
       "up built-in --seconds 20 --record", Up},
      {"scene", "scene new|check|preview|explain|schema|list|materials ...",
       "Make a scene around a mesh of an organ, check and draw a scene, explain a key.",
       "scene new liver --from liver.stl", Scene},
      {"import-anatomy", "import-anatomy LABELS [--map FILE --out DIR]",
       "Make a scene from a patient's segmentation: NIfTI, DICOM, or a folder with a surface per organ.",
       "import-anatomy pelvis.nii.gz --map labels.yaml --out pelvis", ImportAnatomy},
      {"console", "console [options]",
       "Serve the page of the cart's touch screen, which starts, shows and stops sessions, calibrates and replays.",
       "console --port 8480", Console},
      {"host", "host --peer ADDR [options]", "Run nodes for the cart on another machine, for one session.",
       "host --peer 192.168.7.1 --nodes render_node", Host},
      {"status", "status [--domain N]", "Print the nodes of the running session once.", "status", Status},
      {"top", "top [--domain N]", "Show the nodes of the running session, refreshed until Ctrl-C.", "top", Top},
      {"restart", "restart NODE [--domain N]", "Restart one node of the running session.", "restart physics_node",
       Restart},
      {"swap", "swap NODE --with COMMAND [--domain N]",
       "Replace a node of the running session by another build or by a recording.",
       "swap physics_node --with build/other/bin/physics_node", Swap},
      {"down", "down [--domain N]", "End the running session.", "down", Down},
      {"dump", "dump [--domain N]",
       "Write the newest seconds of a session started with fulcrum up --keep-last into a file.", "dump", Dump},
      {"generator", "generator [--cut W] [--coag W] [--blend W] [--domain N]",
       "Set the power of the generator of the running session, or print it when no power is given.",
       "generator --cut 40 --coag 25", Generator},
      {"log", "log TOOL FILE...", "Read recordings: info, list, cat, export, verify, diff, recover, map.",
       "log info out/latest/recording.mcap", Log},
      {"test-node", "test-node NODE --inputs LOG [--expect HASH] [--assert EXPR]... [--junit FILE]",
       "Test one node without other processes against a recording, for QA and CI.",
       "test-node thermal --inputs out/latest/recording.mcap --assert \"cut_length_mm > 30\"", TestNode},
      {"validate", "validate [--list] [--out DIR] [CASE...]",
       "Compare the models with exact solutions, other solvers and experiments, and print the errors.",
       "validate tube-pinch boiling-front", Validate},
      {"profile", "profile SCENE [--seconds S] [--threads N] [--json FILE]",
       "Measure what a scene costs on this machine and how right each preset is, and advise on preset and threads.",
       "profile built-in", Profile},
      {"soak", "soak SCENE [--minutes N] [--chaos]",
       "Run a long session, optionally with injected faults, and check memory growth, drift and crashes.",
       "soak small --minutes 30 --chaos", Soak},
      {"keys", "keys init|show|check [DIR] | issue|revoke NAME [--read TOPICS] [--write TOPICS] [--out DIR]",
       "Make and check the keys of a secured cart, which permit participants to join, write and read topics, and admit "
       "tools of somebody else.",
       "keys issue probe --read Health --out probe-keys", Keys},
      {"assess", "assess RECORDING [--scene FILE] [--json FILE]",
       "Score a recorded session with the same measures as live.", "assess out/latest/recording.mcap", Assess},
      {"trainee", "trainee [NAME] [--scene NAME] [--svg FILE] [--delete [--out DIR] [--yes]] [--database FILE]",
       "Print or delete a trainee's scored sessions (fulcrum up --trainee), or without NAME list the trainees.",
       "trainee Ann --svg ann.svg", Trainee},
      {"questionnaire", "questionnaire [SESSION] [--answers LIST] [--summary] [--out DIR]",
       "Ask a surgeon's opinion after a session, or summarise all answers beside the paper's.",
       "questionnaire --summary", Questionnaire},
      {"doctor", "doctor [--security] [--domain N] [--out DIR]",
       "Check whether this machine can run sessions, or what protects them, and print a fix for each problem.",
       "doctor --security", Doctor},
      {"inputs", "inputs [--watch [--seconds N]] [--json] [--cart FILE]",
       "List the gamepads and SpaceMice that are plugged in, or show live what they report.", "inputs --watch", Inputs},
      {"reference", "reference cart|scene FILE...",
       "Print every key of cart or scene files with default and valid values.",
       "reference cart deploy/carts/simulated.yaml", Reference},
      {"help", "help [COMMAND]", "Print the commands, or the options of one.", "help up", Help},
      {"version", "version", "Print the version.", "version", Version},
  });
  return kCommands;
}

}  // namespace fulcrum::supervisor::cli
