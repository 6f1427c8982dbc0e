// fulcrum test-node: test of one node without other processes against a recording. The program `replayer` contains the
// node classes and executes the test.
#include "services/apps/fulcrum/commands.h"
#include "services/base/core/error.h"

namespace fulcrum::supervisor::cli {
namespace {

namespace po = boost::program_options;

/// Options that replayer has under the same name.
constexpr const char* kPassedOn[] = {"expect", "junit", "scene", "cart", "threads", "until"};

}  // namespace

ExitCode TestNode(const Words& words) {
  po::options_description options;
  options.add_options()  //
      ("inputs", po::value<std::string>()->value_name("LOG"),
       "recording of a session (fulcrum up --record); the node computes its ticks again from the recorded inputs")  //
      ("expect", po::value<std::string>()->value_name("HASH"),
       "expected state hash after the last tick, 16 hexadecimal digits, as printed by an earlier test")  //
      ("assert", po::value<std::vector<std::string>>()->value_name("EXPR"),
       "FIGURE < | <= | == | != | >= | > NUMBER, for example \"cut_length_mm > 30\", over the figures of the node's "
       "Health (NAME: the last value, NAME.min and NAME.max of the session) and ticks, compared, hash_mismatches, "
       "starts, session_s, busy_s, step_p50_ms, step_p99_ms; may be repeated")                       //
      ("junit", po::value<std::string>()->value_name("FILE"), "also write the result as JUnit XML")  //
      ("scene", po::value<std::string>()->value_name("FILE"),
       "compiled scene (default: scene.fulcrum beside the log)")  //
      ("cart", po::value<std::string>()->value_name("FILE"),
       "cart file (default: cart.yaml beside the log)")  //
      ("threads", po::value<std::string>()->value_name("N"),
       "threads per step of physics, 1 to 64 (default: number of cores); the states do not depend on it")  //
      ("until", po::value<std::string>()->value_name("S"), "end at this session time [s] (default: end of the log)");
  const Arguments arguments = Parse("test-node", words, options, {"node"});
  if (arguments.help) {
    std::puts(
        "Nodes: physics, thermal, haptics, render. Without --expect and --assert, each state must equal the recorded "
        "one.\n"
        "Exit codes: 0 passed, 1 failed, 2 bad use or file, 3 the log is of another scene.");
    return ExitCode::kDone;
  }
  const auto& values = arguments.values;
  if (values.count("node") == 0 || values.count("inputs") == 0) {
    throw InputError(
        "NODE or --inputs LOG is missing. For example: fulcrum test-node thermal --inputs out/latest/recording.mcap "
        "--assert \"cut_length_mm > 30\"");
  }
  Words command{"replayer", values["inputs"].as<std::string>(), "--test", values["node"].as<std::string>()};
  for (const char* name : kPassedOn) {
    if (values.count(name) != 0) command.push_back(std::string("--") + name + '=' + values[name].as<std::string>());
  }
  if (values.count("assert") != 0) {
    for (const std::string& text : values["assert"].as<std::vector<std::string>>()) {
      command.push_back("--assert=" + text);
    }
  }
  Become(command);
}

}  // namespace fulcrum::supervisor::cli
